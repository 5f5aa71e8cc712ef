'use strict';
(function () {
  const figures = JSON.parse(document.getElementById('figures').textContent);
  // A copy: zooming changes the layout itself.
  const whole = figures[0].layout.xaxis.range.slice();
  const plots = [];
  let following = false;

  // The time axis of every plot follows the one that was zoomed or moved.
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

  figures.forEach(function (figure, index) {
    const plot = document.getElementById('plot-' + index);
    Plotly.newPlot(plot, figure.data, figure.layout, figure.config);
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
