'use strict';
// What is in a packed script element: gzip in base64.
window.unpacked = function (id) {
  const bytes = Uint8Array.from(atob(document.getElementById(id).textContent),
    function (byte) { return byte.charCodeAt(0); });
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Response(stream);
};
// A number as the language of the page writes it.
window.decimal = function (number) {
  const text = String(number);
  return document.documentElement.lang === 'de' ? text.replace('.', ',') : text;
};
