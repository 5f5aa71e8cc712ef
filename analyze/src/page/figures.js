'use strict';
(async function () {
  if (!window.DecompressionStream) {
    document.getElementById('plot-0').textContent = 'This browser cannot unpack the figures: it is older than 2023.';
    return;
  }
  if (document.getElementById('plot-library')) {
    const library = document.createElement('script');
    library.textContent = await window.unpacked('plot-library').text();
    document.head.appendChild(library);
  }
  const figures = await window.unpacked('figures').json();

  const columns = new Uint8Array(await window.unpacked('columns').arrayBuffer());

  // A column is "type:first byte:count": the first bytes of all its numbers, then the second ones, and so on. A tick is
  // 0.1 ms, and stands as what it is more than the one before.
  const ARRAYS = { ticks: Uint32Array, f32: Float32Array, f64: Float64Array };
  function numbers(column) {
    const parts = column[0].split(':'), first = Number(parts[1]), count = Number(parts[2]);
    const found = new ARRAYS[parts[0]](count), bytes = new Uint8Array(found.buffer), width = found.BYTES_PER_ELEMENT;
    for (let rank = 0; rank < width; rank++) {
      for (let place = 0; place < count; place++) {
        bytes[place * width + rank] = columns[first + rank * count + place];
      }
    }
    let tick = 0;
    return parts[0] === 'ticks'
      ? Float64Array.from(found, function (step) { tick = (tick + step) >>> 0; return tick / 1e4; }) : found;
  }
  figures.forEach(function (figure) {
    figure.data.forEach(function (trace) {
      trace.x = numbers(trace.x);
      trace.y = numbers(trace.y);
    });
  });

  // A copy: zooming changes the layout itself.
  const whole = figures[0].layout.xaxis.range.slice();
  const plots = [];
  let following = false;

  // All time axes follow the plot that was zoomed or panned.
  function follow(from, change) {
    if (following) { return; }
    const range = 'xaxis.range[0]' in change
      ? { 'xaxis.range': [change['xaxis.range[0]'], change['xaxis.range[1]']] }
      : 'xaxis.range' in change ? { 'xaxis.range': change['xaxis.range'].slice() }
      : change['xaxis.autorange'] ? { 'xaxis.range': whole.slice() } : null;
    if (!range) { return; }
    following = true;
    Promise.all(plots.filter(function (plot) { return plot !== from || change['xaxis.autorange']; })
      .map(function (plot) { return Plotly.relayout(plot, range); }))
      .finally(function () { following = false; });
  }

  // Areas of a stack can be distinguished without colour, too.
  const PATTERNS = ['', '/', '.', '\\', 'x', '-', '+', '|'];
  function addPatterns(traces) {
    const groups = [];
    traces.forEach(function (trace) {
      if (!trace.legendgroup || !trace.fill) { return; }
      if (groups.indexOf(trace.legendgroup) < 0) { groups.push(trace.legendgroup); }
      const shape = PATTERNS[groups.indexOf(trace.legendgroup) % PATTERNS.length];
      trace.fillpattern = { shape: shape, fillmode: 'replace', size: 7, solidity: 0.2,
        fgcolor: '#444', bgcolor: trace.fillcolor };
    });
  }

  // The legend wraps to the width of the page: the figure grows, the plot keeps its height.
  function makeRoom(plot, figure) {
    const legend = plot.querySelector('.legend .bg');
    const lines = legend ? legend.getBoundingClientRect().height : 0;
    const below = figure.room.bottom + lines;
    if (Math.abs(plot.layout.margin.b - below) > 1) {
      plot.style.height = (figure.room.height + lines) + 'px';
      Plotly.relayout(plot, { 'margin.b': below, autosize: true });
    }
  }

  figures.forEach(function (figure, index) {
    const plot = document.getElementById('plot-' + index);
    figure.room = { bottom: figure.layout.margin.b, height: figure.layout.height };
    plot.style.height = figure.room.height + 'px';
    delete figure.layout.height;
    addPatterns(figure.data);
    Plotly.newPlot(plot, figure.data, figure.layout, figure.config);
    makeRoom(plot, figure);
    plot.on('plotly_afterplot', function () { makeRoom(plot, figure); });
    plot.on('plotly_relayout', function (change) { follow(plot, change); });
    plot.on('plotly_click', function (click) {
      if (window.showMoment) { window.showMoment(click.points[0].x); }
    });
    plots.push(plot);
  });

  // Paper is narrower than most windows.
  window.addEventListener('beforeprint', function () {
    plots.forEach(function (plot) { Plotly.relayout(plot, { width: 660 }); });
  });
  window.addEventListener('afterprint', function () {
    plots.forEach(function (plot) { Plotly.relayout(plot, { width: null, autosize: true }); });
  });
})();
