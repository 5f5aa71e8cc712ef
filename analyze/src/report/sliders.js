'use strict';
// The overturning force of a wheel to first order, as the sliders say.
(function () {
  const holder = document.getElementById('what-if-data');
  if (!holder) { return; }
  const facts = JSON.parse(holder.textContent);
  const inputs = facts.changes.map(function (it, k) { return document.getElementById('what-if-' + k); });
  const result = document.getElementById('what-if-result');
  const text = function (value) { return String(Number(value.toPrecision(3))); };
  function show() {
    let otf = facts.otf_n;
    facts.changes.forEach(function (it, k) {
      const value = Number(inputs[k].value), shown = text(value) + ' ' + it.unit;
      otf += (value - it.range[1]) * it.per_unit_n;
      document.getElementById('what-if-' + k + '-value').textContent = shown;
      inputs[k].setAttribute('aria-valuetext', shown);
    });
    const band = facts.sigma_n === null ? '' : ' ± ' + Math.round(2 * facts.sigma_n);
    const words = result.dataset, is = Math.abs(otf) < 2 * (facts.sigma_n || 0) ? words.open : otf < 0 ? words.lifts : words.stays;
    const values = { otf: Math.round(otf) + band, logged: Math.round(facts.otf_n), lifts: is };
    result.textContent = words.result.replace(/\{(otf|logged|lifts)\}/g, function (_, name) { return values[name]; });
  }
  function reset() { facts.changes.forEach(function (it, k) { inputs[k].value = it.range[1]; }); show(); }
  inputs.forEach(function (input) { input.addEventListener('input', show); });
  document.getElementById('what-if-reset').addEventListener('click', reset);
  reset();
})();
