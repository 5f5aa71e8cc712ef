'use strict';
// The text of a packed script element: gzip in base64.
window.unpack = function (id) {
  const bytes = Uint8Array.from(atob(document.getElementById(id).textContent),
    function (byte) { return byte.charCodeAt(0); });
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Response(stream).text();
};
