'use strict';
// The overturning force of an event's wheels, on straight lines between what was simulated.
(function () {
  const holder = document.getElementById('what-if-data');
  if (!holder) { return; }
  const facts = JSON.parse(holder.textContent), logged = facts.logged;
  const inputs = facts.changes.map(function (it, k) { return document.getElementById('what-if-' + k); });
  // where the sliders stand for what was logged
  const begins = [];
  const result = document.getElementById('what-if-result');
  const text = function (value) { return window.decimal(Number(value.toPrecision(3))); };
  const square = function (of) { return of.sigma_n === null ? NaN : of.sigma_n * of.sigma_n; };
  const between = function (points, at) {
    const exact = points.find(function (it) { return it.at === at; });
    if (exact || points.length < 2) { return { otf: (exact || logged).otf_n, variance: square(exact || logged) }; }
    let k = 1;
    while (k < points.length - 1 && points[k].at < at) { k += 1; }
    const a = points[k - 1], b = points[k], share = (at - a.at) / (b.at - a.at);
    const line = function (from, to) { return from + (to - from) * share; };
    return { otf: line(a.otf_n, b.otf_n), variance: line(square(a), square(b)) };
  };
  function show() {
    let otf = logged.otf_n, variance = square(logged);
    facts.changes.forEach(function (it, k) {
      // the steps of an input need not meet what was simulated
      const set = Number(inputs[k].value), half = inputs[k].step / 2;
      const apart = function (point) { return Math.abs(set - point.at); };
      const met = it.simulated.filter(function (point) { return apart(point) <= half; });
      met.sort(function (a, b) { return apart(a) - apart(b); });
      const value = set === begins[k] ? it.logged : met.length > 0 ? met[0].at : set;
      const shown = text(value) + ' ' + it.unit;
      const found = between(it.simulated, value);
      otf += found.otf - logged.otf_n;
      variance += found.variance - square(logged);
      document.getElementById('what-if-' + k + '-value').textContent = shown;
      inputs[k].setAttribute('aria-valuetext', shown);
    });
    const sigma = Math.sqrt(Math.max(variance, 0));
    const band = Number.isFinite(sigma) ? ' ± ' + Math.round(2 * sigma) : '';
    // what is not finite is open
    const words = result.dataset, is = !(Math.abs(otf) >= 2 * sigma) ? words.open : otf < 0 ? words.lifts : words.stays;
    const values = { otf: (Number.isFinite(otf) ? Math.round(otf) : '–') + band, logged: Math.round(logged.otf_n), lifts: is };
    result.textContent = words.result.replace(/\{(otf|logged|lifts)\}/g, function (_, name) { return values[name]; });
  }
  function reset() {
    facts.changes.forEach(function (it, k) { inputs[k].value = it.logged; begins[k] = Number(inputs[k].value); });
    show();
  }
  inputs.forEach(function (input) { input.addEventListener('input', show); });
  document.getElementById('what-if-reset').addEventListener('click', reset);
  reset();
})();
