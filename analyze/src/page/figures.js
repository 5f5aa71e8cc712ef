'use strict';
// Draws the figures of a page on canvases: curves, areas, points and lanes over one common time axis.
(async function () {
  const places = document.querySelectorAll('.plot');
  if (places.length === 0) { return; }
  const words = document.getElementById('plots-help').dataset;
  if (!window.DecompressionStream) {
    places[0].textContent = words.old;
    return;
  }
  const figures = await window.unpacked('figures').json();
  const columns = new Uint8Array(await window.unpacked('columns').arrayBuffer());

  // A column is "type:first byte:count": the first bytes of all its numbers, then the second ones, and so on. A tick is
  // 0.1 ms, or as long as is told behind the count, and stands as what it is more than the one before.
  const ARRAYS = { ticks: Uint32Array, f32: Float32Array, f64: Float64Array };
  function numbers(column) {
    const parts = column.split(':'), first = Number(parts[1]), count = Number(parts[2]);
    const found = new ARRAYS[parts[0]](count), bytes = new Uint8Array(found.buffer), width = found.BYTES_PER_ELEMENT;
    for (let rank = 0; rank < width; rank++) {
      for (let place = 0; place < count; place++) {
        bytes[place * width + rank] = columns[first + rank * count + place];
      }
    }
    let tick = 0;
    const seconds = parts.length > 3 ? function () { return tick * Number(parts[3]); } : function () { return tick / 1e4; };
    return parts[0] === 'ticks'
      ? Float64Array.from(found, function (step) { tick = (tick + step) >>> 0; return seconds(); }) : found;
  }

  const LEFT = 62, RIGHT = 12, TOP = 8, BOTTOM = 24, LANE_LETTERS = 12;
  const DASHES = [[], [7, 4], [2, 3], [9, 3, 2, 3], [12, 4], [12, 3, 3, 3]];
  const whole = figures.reduce(function (span, figure) {
    return [Math.min(span[0], figure.span[0]), Math.max(span[1], figure.span[1])];
  }, [Infinity, -Infinity]);
  const view = { from: whole[0], to: whole[1] };
  const plots = [];

  function theme(name) { return getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim(); }
  function colours() {
    return { ink: theme('ink'), grid: theme('grid'), axis: theme('axis'), paper: theme('paper'), limit: theme('limit'),
      palette: [0, 1, 2, 3, 4, 5, 6].map(function (k) { return theme('c' + k); }),
      shade: { tip: theme('shade-tip'), lift: theme('shade-lift'), light: theme('shade-light'), input: theme('shade-input') } };
  }

  // Round numbers for the marks of an axis.
  function marks(low, high, most) {
    const rough = (high - low) / Math.max(most, 1), power = Math.pow(10, Math.floor(Math.log10(rough)));
    const step = [1, 2, 5, 10].map(function (k) { return k * power; }).find(function (s) { return s >= rough; }) || rough;
    const found = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) { found.push(k * step); }
    const digits = Math.max(0, Math.min(6, -Math.floor(Math.log10(step) + 1e-9)));
    return { values: found, text: function (value) { return window.decimal((Math.abs(value) < step / 1e6 ? 0 : value).toFixed(digits)); } };
  }

  // The first point at or after a time; times of a line never go back.
  function after(times, time) {
    let low = 0, high = times.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] < time) { low = middle + 1; } else { high = middle; }
    }
    return low;
  }

  // What a trace shows between two times: shapes go back in time, so all their points are looked at.
  function extent(trace, from, to) {
    const x = trace.x, y = trace.y, sorted = trace.look === 'line' || trace.look === 'points';
    const first = sorted ? Math.max(0, after(x, from) - 1) : 0, last = sorted ? Math.min(x.length, after(x, to) + 1) : x.length;
    let low = Infinity, high = -Infinity;
    for (let k = first; k < last; k++) {
      if (y[k] === y[k] && (sorted || (x[k] >= from && x[k] <= to))) {
        if (y[k] < low) { low = y[k]; }
        if (y[k] > high) { high = y[k]; }
      }
    }
    return [low, high];
  }

  function range(figure) {
    if (figure.lanes.length) { return [0.65 - figure.lanes.length, 0.85]; }
    let low = Infinity, high = -Infinity;
    const shown = figure.traces.filter(function (t) { return !t.hidden; });
    // envelopes are cut where they would dwarf the curves
    let traces = shown.filter(function (t) { return t.look !== 'envelope'; });
    if (traces.length === 0) { traces = shown; }
    traces.forEach(function (trace) {
      const found = extent(trace, view.from, view.to);
      low = Math.min(low, found[0]); high = Math.max(high, found[1]);
    });
    if (!(low <= high)) { return [0, 1]; }
    const reach = Math.max(high - low, 1e-9 + 0.01 * Math.abs(high));
    figure.limits.forEach(function (limit) {
      // a limit that is near belongs into the picture
      if (limit.at > low - 1.5 * reach && limit.at < high + 1.5 * reach) { low = Math.min(low, limit.at); high = Math.max(high, limit.at); }
    });
    const room = 0.06 * Math.max(high - low, reach);
    return [low - room, high + room];
  }

  function hatch(context, index, colour, ink) {
    const tile = document.createElement('canvas'), kind = index % 6;
    tile.width = tile.height = 8;
    const c = tile.getContext('2d');
    c.globalAlpha = 0.55; c.fillStyle = colour; c.fillRect(0, 0, 8, 8);
    c.globalAlpha = 0.5; c.strokeStyle = ink; c.lineWidth = 0.8; c.beginPath();
    if (kind === 1 || kind === 5) { c.moveTo(0, 8); c.lineTo(8, 0); }
    if (kind === 2 || kind === 5) { c.moveTo(0, 0); c.lineTo(8, 8); }
    if (kind === 3) { c.moveTo(0, 4); c.lineTo(8, 4); }
    if (kind === 4) { c.moveTo(4, 0); c.lineTo(4, 8); }
    c.stroke();
    return context.createPattern(tile, 'repeat');
  }

  // Bands of one kind that overlap are one: their colours would add up. Those of the first figure are shaded in all.
  const bands = once(figures[0].bands);
  function once(bands) {
    const found = [];
    bands.slice().sort(function (a, b) { return a.from - b.from; }).forEach(function (band) {
      const last = found.filter(function (other) { return other.kind === band.kind; }).pop();
      if (last && band.from <= last.to) { last.to = Math.max(last.to, band.to); } else {
        found.push({ from: band.from, to: band.to, kind: band.kind });
      }
    });
    return found;
  }

  function draw(plot) {
    const figure = plot.figure, canvas = plot.canvas, width = plot.holder.clientWidth;
    if (width < 50) { return; }
    plot.stale = false;
    const ratio = Math.min(window.devicePixelRatio || 1, 3), height = figure.height;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
      canvas.style.height = height + 'px';
    }
    const c = canvas.getContext('2d'), look = colours();
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    c.fillStyle = look.paper; c.fillRect(0, 0, width, height);
    c.font = '11px system-ui, sans-serif';
    const left = figure.lanes.length ? 8 : LEFT, right = width - RIGHT, floor = height - BOTTOM;
    const limits = range(figure), low = limits[0], high = limits[1];
    const atX = function (t) { return left + (t - view.from) / (view.to - view.from) * (right - left); };
    const atY = function (v) { return floor - (v - low) / (high - low) * (floor - TOP); };
    plot.time = function (x) { return view.from + (x - left) / (right - left) * (view.to - view.from); };
    plot.place = atX;

    c.save();
    c.beginPath(); c.rect(left, TOP, right - left, floor - TOP); c.clip();
    bands.forEach(function (band) {
      const from = atX(band.from), to = Math.max(atX(band.to), from + 1);
      c.fillStyle = look.shade[band.kind]; c.fillRect(from, TOP, to - from, floor - TOP);
    });
    c.restore();

    c.strokeStyle = look.grid; c.lineWidth = 1; c.fillStyle = look.axis;
    const times = marks(view.from, view.to, Math.max(2, (right - left) / 90));
    c.textAlign = 'center'; c.textBaseline = 'top';
    c.beginPath();
    times.values.forEach(function (t) {
      const x = Math.round(atX(t)) + 0.5;
      c.moveTo(x, TOP); c.lineTo(x, floor);
      if (x < right - 14) { c.fillText(times.text(t), x, floor + 6); }
    });
    c.textAlign = 'right'; c.fillText('s', width - 2, floor + 6);
    if (!figure.lanes.length) {
      const values = marks(low, high, Math.max(2, (floor - TOP) / 34));
      c.textBaseline = 'middle';
      values.values.forEach(function (v) {
        const y = Math.round(atY(v)) + 0.5;
        c.moveTo(left, y); c.lineTo(right, y);
        c.fillText(values.text(v), left - 5, y);
      });
      c.save(); c.translate(10, (TOP + floor) / 2); c.rotate(-Math.PI / 2); c.textAlign = 'center';
      c.fillText(figure.unit, 0, 0); c.restore();
    }
    c.stroke();

    c.save();
    c.beginPath(); c.rect(left, TOP, right - left, floor - TOP); c.clip();
    figure.traces.forEach(function (trace) { if (!trace.hidden) { drawTrace(c, trace, look, atX, atY); } });
    c.strokeStyle = look.limit; c.fillStyle = look.limit; c.lineWidth = 1.2; c.textAlign = 'right'; c.textBaseline = 'bottom';
    figure.limits.forEach(function (limit) {
      const y = atY(limit.at);
      if (y < TOP - 1 || y > floor + 1) { return; }
      c.setLineDash([9, 4]); c.beginPath(); c.moveTo(left, y); c.lineTo(right, y); c.stroke(); c.setLineDash([]);
      c.fillText(limit.name, right - 3, y - 2 < TOP + 11 ? y + 13 : y - 2);
    });
    c.fillStyle = look.ink; c.textAlign = 'left'; c.textBaseline = 'alphabetic'; c.font = LANE_LETTERS + 'px system-ui, sans-serif';
    figure.lanes.forEach(function (name, place) { c.fillText(name, left + 2, atY(-place) - 9); });
    if (plot.pointer !== undefined) {
      const x = atX(plot.pointer);
      c.strokeStyle = look.ink; c.lineWidth = 1; c.beginPath(); c.moveTo(x, TOP); c.lineTo(x, floor); c.stroke();
    }
    if (plot.held !== undefined && plot.drag !== undefined) {
      c.fillStyle = look.ink; c.globalAlpha = 0.12;
      c.fillRect(Math.min(plot.held, plot.drag), TOP, Math.abs(plot.drag - plot.held), floor - TOP);
      c.globalAlpha = 1;
    }
    c.restore();
  }

  function drawTrace(c, trace, look, atX, atY) {
    const x = trace.x, y = trace.y, colour = look.palette[trace.colour % look.palette.length];
    c.setLineDash([]);
    if (trace.look === 'points') {
      c.fillStyle = colour;
      for (let k = 0; k < x.length; k++) { if (y[k] === y[k]) { c.fillRect(atX(x[k]) - 1.2, atY(y[k]) - 1.2, 2.4, 2.4); } }
      return;
    }
    const shape = trace.look === 'area' || trace.look === 'envelope';
    // of a line only what is in the picture
    const sorted = trace.look === 'line';
    const first = sorted ? Math.max(0, after(x, view.from) - 1) : 0, last = sorted ? Math.min(x.length, after(x, view.to) + 1) : x.length;
    let open = false;
    c.beginPath();
    for (let k = first; k < last; k++) {
      if (y[k] !== y[k]) { if (shape && open) { c.closePath(); } open = false; continue; }
      if (open) { c.lineTo(atX(x[k]), atY(y[k])); } else { c.moveTo(atX(x[k]), atY(y[k])); open = true; }
    }
    if (shape) {
      if (trace.hatched) { c.fillStyle = hatch(c, trace.colour, colour, look.ink); } else {
        c.fillStyle = colour; c.globalAlpha = trace.look === 'envelope' ? 0.13 : 0.28;
      }
      c.fill(); c.globalAlpha = 1;
      return;
    }
    c.strokeStyle = colour; c.lineJoin = 'round';
    if (trace.look === 'bar') { c.lineWidth = 8; } else { c.lineWidth = 1.7; c.setLineDash(DASHES[trace.dash % DASHES.length]); }
    c.stroke(); c.setLineDash([]);
  }

  // The values under the pointer, as text below the plot.
  function read(plot, time) {
    const texts = plot.figure.traces.filter(function (t) { return !t.hidden && t.look === 'line'; }).map(function (trace) {
      const k = Math.min(after(trace.x, time), trace.x.length - 1);
      const best = k > 0 && time - trace.x[k - 1] < trace.x[k] - time ? k - 1 : k;
      const value = trace.y[best];
      return (trace.name ? trace.name + ' ' : '') + (value === value ? window.decimal(Number(value.toPrecision(4))) : words.unknown);
    });
    plot.readout.textContent = 't = ' + window.decimal(time.toFixed(2)) + ' s' + (texts.length ? ': ' + texts.join(', ') : '');
  }

  let waiting = false;
  function redraw() {
    plots.forEach(function (plot) { plot.stale = true; });
    if (waiting) { return; }
    waiting = true;
    window.requestAnimationFrame(function () {
      waiting = false;
      plots.forEach(function (plot) { if (plot.stale && plot.visible) { draw(plot); } });
    });
  }
  function show(from, to) {
    const least = Math.max(1e-3, 1e-6 * (whole[1] - whole[0]));
    if (to - from < least) { return; }
    const width = Math.min(to - from, whole[1] - whole[0]);
    view.from = Math.max(whole[0], Math.min(from, whole[1] - width));
    view.to = view.from + width;
    redraw();
  }
  // For tests, and for other scripts of the page.
  window.plotView = function (from, to) { if (from !== undefined) { show(from, to); } return [view.from, view.to]; };

  function legend(plot) {
    const names = {};
    plot.figure.traces.forEach(function (trace) {
      if (!trace.named || !trace.name) { return; }
      const same = plot.figure.traces.filter(function (t) { return t.name === trace.name; });
      if (names[trace.name]) { return; }
      names[trace.name] = true;
      const button = document.createElement('button'), swatch = document.createElement('span');
      button.type = 'button'; swatch.className = 'swatch look-' + trace.look + (trace.hatched ? ' hatched' : '');
      swatch.style.setProperty('--swatch', 'var(--c' + trace.colour % 7 + ')');
      if (trace.look === 'line' && trace.dash % 6) { swatch.style.borderTopStyle = trace.dash % 2 ? 'dashed' : 'dotted'; }
      button.append(swatch, trace.name);
      const tell = function () { button.setAttribute('aria-pressed', String(!trace.hidden)); };
      button.addEventListener('click', function () {
        const hidden = !trace.hidden;
        same.forEach(function (t) { t.hidden = hidden; });
        tell(); draw(plot);
      });
      tell();
      plot.legend.append(button);
    });
  }

  const seen = new IntersectionObserver(function (entries) {
    entries.forEach(function (entry) {
      const plot = plots.find(function (p) { return p.holder === entry.target; });
      plot.visible = entry.isIntersecting;
      if (plot.visible && plot.stale) { draw(plot); }
    });
  }, { rootMargin: '400px' });
  const sized = new ResizeObserver(redraw);

  figures.forEach(function (figure, index) {
    const holder = document.getElementById('plot-' + index);
    if (!holder) { return; }
    figure.traces.forEach(function (trace) { trace.x = numbers(trace.x); trace.y = numbers(trace.y); });
    const canvas = document.createElement('canvas'), below = document.createElement('div'), readout = document.createElement('p');
    below.className = 'legend'; readout.className = 'readout screen';
    holder.append(canvas); holder.after(below, readout);
    const plot = { figure: figure, holder: holder, canvas: canvas, legend: below, readout: readout, stale: true, visible: false };
    plots.push(plot);
    legend(plot);
    const at = function (event) { return event.clientX - canvas.getBoundingClientRect().left; };
    canvas.addEventListener('pointerdown', function (event) {
      if (event.pointerType === 'touch') { return; }
      plot.held = at(event); canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener('pointermove', function (event) {
      if (!plot.time) { return; }
      plot.pointer = plot.time(at(event));
      if (plot.held !== undefined) { plot.drag = at(event); }
      read(plot, plot.pointer); draw(plot);
    });
    canvas.addEventListener('pointerleave', function () { plot.pointer = undefined; draw(plot); });
    canvas.addEventListener('pointerup', function (event) {
      if (!plot.time) { return; }
      const from = plot.held, to = at(event);
      plot.held = plot.drag = undefined;
      if (from !== undefined && Math.abs(to - from) > 5) {
        show(plot.time(Math.min(from, to)), plot.time(Math.max(from, to)));
      } else if (window.showMoment) { window.showMoment(plot.time(to)); }
      draw(plot);
    });
    canvas.addEventListener('dblclick', function () { show(whole[0], whole[1]); });
    holder.addEventListener('keydown', function (event) {
      const width = view.to - view.from, middle = (view.from + view.to) / 2;
      const known = {
        ArrowLeft: [view.from - 0.2 * width, view.to - 0.2 * width], ArrowRight: [view.from + 0.2 * width, view.to + 0.2 * width],
        '+': [middle - 0.25 * width, middle + 0.25 * width], '-': [middle - width, middle + width], '0': whole };
      if (!known[event.key]) { return; }
      event.preventDefault();
      show(known[event.key][0], known[event.key][1]);
    });
    seen.observe(holder); sized.observe(holder);
  });
  window.drawPlots = function () { plots.forEach(draw); };
  window.addEventListener('theme', redraw);
  document.documentElement.dataset.plots = String(plots.length);
})();
