'use strict';
// Colours by the reader's setting and a switch; parts that fold; paper shows everything in light colours.
(function () {
  const root = document.documentElement;
  const tell = function () { window.dispatchEvent(new Event('theme')); };
  const button = document.getElementById('theme');
  const dark = window.matchMedia('(prefers-color-scheme: dark)');
  const isDark = function () { return root.dataset.theme ? root.dataset.theme === 'dark' : dark.matches; };
  if (button) {
    const label = function () { button.setAttribute('aria-pressed', String(isDark())); };
    button.hidden = false; label();
    button.addEventListener('click', function () { root.dataset.theme = isDark() ? 'light' : 'dark'; label(); tell(); });
  }
  dark.addEventListener('change', tell);

  const parts = function () { return Array.from(document.querySelectorAll('details')); };
  const all = document.getElementById('open-all');
  if (all) {
    const closed = all.textContent;
    all.hidden = false;
    all.addEventListener('click', function () {
      const open = parts().some(function (part) { return !part.open; });
      parts().forEach(function (part) { part.open = open; });
      all.textContent = open ? all.dataset.fold : closed;
    });
  }
  // A link into a folded part opens it.
  const reveal = function () {
    const target = location.hash.length > 1 && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    for (let part = target; part; part = part.parentElement) { if (part.tagName === 'DETAILS') { part.open = true; } }
    if (target) { target.scrollIntoView(); }
  };
  window.addEventListener('hashchange', reveal);
  reveal();

  let before = null;
  window.addEventListener('beforeprint', function () {
    before = { theme: root.dataset.theme, closed: parts().filter(function (part) { return !part.open; }) };
    before.closed.forEach(function (part) { part.open = true; });
    root.dataset.theme = 'light';
    if (window.drawPlots) { window.drawPlots(); }
  });
  window.addEventListener('afterprint', function () {
    if (!before) { return; }
    before.closed.forEach(function (part) { part.open = false; });
    if (before.theme) { root.dataset.theme = before.theme; } else { delete root.dataset.theme; }
    before = null; tell();
  });
})();
