'use strict';
(async function () {
  if (!document.getElementById('moments') || !window.DecompressionStream) { return; }
  const moments = await window.unpacked('moments').json();
  if (moments.instants.length === 0) { return; }
  // The numbers of wheels and arm stand one after the other, of all instants.
  moments.instants.forEach(function (instant, i) {
    const numbers = function (columns) { return columns.map(function (column) { return column[i]; }); };
    instant.wheels = moments.wheels_at.map(numbers);
    instant.arm = moments.arm_at.map(numbers);
  });
  const NAMESPACE = 'http://www.w3.org/2000/svg';
  const TRACE_S = 2;
  const DISC_SHARE = 0.24;
  const known = function (values) { return values.every(function (v) { return v !== null; }); };
  // A text with its values, by their names in braces.
  const texts = moments.texts;
  const filled = function (text, values) { return text.replace(/\{(\w+)\}/g, function (_, name) { return values[name]; }); };

  // One scale for all pictures, at which everything fits.
  const box = moments.instants.reduce(function (box, instant) {
    const points = instant.wheels.map(function (w) { return [w[0], w[1]]; });
    instant.arm.forEach(function (s) { points.push([s[0], s[1]], [s[3], s[4]]);
      [s[2], s[5]].forEach(function (h) { if (h !== null) { box.high = Math.max(box.high, h); } }); });
    points.filter(known).forEach(function (p) {
      box.front = Math.max(box.front, p[0]); box.rear = Math.min(box.rear, p[0]);
      box.left = Math.max(box.left, p[1]); box.right = Math.min(box.right, p[1]);
    });
    return box;
  }, { front: -Infinity, rear: Infinity, left: -Infinity, right: Infinity, high: 1 });
  if (!isFinite(box.front)) { return; }
  // The smaller of length and width of the rectangle around the wheels (m).
  function apart(instants) {
    let least = Infinity;
    instants.slice(0, 1).forEach(function (instant) {
      [0, 1].forEach(function (axis) {
        const along = instant.wheels.map(function (w) { return w[axis]; }).filter(function (v) { return v !== null; });
        const width = Math.max.apply(null, along) - Math.min.apply(null, along);
        if (width > 0.01) { least = Math.min(least, width); }
      });
    });
    return isFinite(least) ? least : 1.75;
  }
  const sideways = moments.instants[0].wheels.map(function (w) { return w[1]; });
  const middleOfWheels = (Math.max.apply(null, sideways) + Math.min.apply(null, sideways)) / 2;
  const isLarge = moments.wheels.some(function (w) { return w.at_rest >= 1000; });
  // Room beside the wheels for their labels: names and loads never cover another wheel.
  const letters = Math.max.apply(null, moments.wheels.map(function (w) { return w.name.length; })) + 1;
  const span = Math.max(box.left - box.right, box.front - box.rear) + 2.4;
  const unit = span / 100;
  const margin = Math.max(1.2, 0.6 + Math.max(letters, 8) * 2.1 * unit);
  const widest = { width: box.left - box.right + 2 * margin, height: box.front - box.rear + 2.4 };
  const atRest = moments.wheels.map(function (w) { return w.at_rest || 0; });
  // Radius of a disc (m) per square root of a load: that of the largest load at rest is a share of the smaller distance
  // between wheels.
  const disc = DISC_SHARE * apart(moments.instants) / Math.sqrt(Math.max.apply(null, atRest.concat([1])));
  // Coordinates in the picture: right and down.
  const at = function (x, y) { return [box.left + margin - y, box.front + 1.2 - x]; };

  // What the machine stands on or would stand on: the wheels and feet with loads, all of them where none is known.
  function standing(instant) {
    const loads = instant.wheels.map(function (w) { return w[2] !== null; });
    return loads.some(Boolean) ? loads : loads.map(function () { return true; });
  }
  // What is drawn of a wheel: it carries nothing where it is off the ground, whatever is left of its load within its error.
  function seen(instant, w) {
    const value = instant.wheels[w].slice();
    if (value[2] !== null && instant.off.includes(w)) { value[2] = 0; }
    return value;
  }
  function add(parent, name, attributes, text) {
    const element = document.createElementNS(NAMESPACE, name);
    Object.keys(attributes).forEach(function (key) { element.setAttribute(key, attributes[key]); });
    if (text !== undefined) { element.textContent = text; }
    parent.appendChild(element);
    return element;
  }

  function line(svg, kind, from, to, width) {
    add(svg, 'line', { 'class': kind, x1: from[0], y1: from[1], x2: to[0], y2: to[1], 'stroke-width': width });
  }

  function wheel(svg, facts, value) {
    const place = at(value[0], value[1]);
    add(svg, 'rect', { 'class': 'tyre', x: place[0] - facts.radius * 0.35, y: place[1] - facts.radius,
      width: facts.radius * 0.7, height: facts.radius * 2, rx: facts.radius * 0.12, 'stroke-width': unit * 0.3 });
    if (facts.at_rest > 0) {
      add(svg, 'circle', { 'class': 'at-rest', cx: place[0], cy: place[1], r: disc * Math.sqrt(facts.at_rest),
        'stroke-width': unit * 0.3, 'stroke-dasharray': unit + ' ' + unit });
    }
    const load = value[2];
    if (load !== null && load > 0) {
      const light = facts.limit !== null && load < facts.limit;
      add(svg, 'circle', { 'class': light ? 'load light' : 'load', cx: place[0], cy: place[1],
        r: disc * Math.sqrt(load), 'stroke-width': unit * 0.3 });
    } else if (load !== null) {
      // a foot has no radius
      const r = Math.max(facts.radius * 0.8, unit * 2);
      line(svg, 'lifted', [place[0] - r, place[1] - r], [place[0] + r, place[1] + r], unit);
      line(svg, 'lifted', [place[0] - r, place[1] + r], [place[0] + r, place[1] - r], unit);
    }
  }

  function label(svg, facts, value, isOff) {
    const place = at(value[0], value[1]), load = value[2];
    const isLeft = value[1] > middleOfWheels;
    const beside = Math.max(facts.radius * 0.4, disc * Math.sqrt(Math.max(load || 0, facts.at_rest || 0))) + unit;
    // what is off the ground has a cross: what is computed of it is not a load
    const texts = [facts.name, isOff ? '' : load === null ? '?' : isLarge ? window.decimal((Math.round(load / 100) / 10 + 0).toFixed(1)) + ' kN'
      : window.decimal((Math.round(load * 10) / 10 + 0).toFixed(1)) + ' N'];
    texts.forEach(function (text, line) {
      add(svg, 'text', { x: place[0] + (isLeft ? -beside : beside), y: place[1] + unit * (line * 3.6 - 0.4),
        'font-size': unit * 3.4, 'stroke-width': unit, 'text-anchor': isLeft ? 'end' : 'start' }, text);
    });
  }

  function gravity(svg, instant, size) {
    const corner = [unit * 3, size.height - unit * 3];
    if (!known(instant.gravity) || instant.tilt === null) {
      add(svg, 'text', { x: corner[0], y: corner[1], 'font-size': unit * 3.2, 'stroke-width': unit }, texts.no_gravity);
      return;
    }
    add(svg, 'text', { x: corner[0], y: corner[1], 'font-size': unit * 3.2, 'stroke-width': unit },
      filled(instant.tilt >= 0.5 ? texts.gravity_to : texts.gravity, { angle: window.decimal(instant.tilt.toFixed(1)) }));
    if (instant.tilt < 0.5) { return; }
    const length = Math.hypot(instant.gravity[0], instant.gravity[1]);
    const along = [-instant.gravity[1] / length, -instant.gravity[0] / length];
    const from = [corner[0] + unit * 50, corner[1] - unit * 1];
    const r = unit * 5;
    const tip = [from[0] + along[0] * r, from[1] + along[1] * r];
    line(svg, 'gravity', [from[0] - along[0] * r, from[1] - along[1] * r], tip, unit * 0.8);
    [0.6, -0.6].forEach(function (side) {
      const c = Math.cos(Math.PI - side), s = Math.sin(Math.PI - side);
      line(svg, 'gravity', tip, [tip[0] + (along[0] * c - along[1] * s) * r * 0.5,
        tip[1] + (along[0] * s + along[1] * c) * r * 0.5], unit * 0.8);
    });
  }

  function draw(svg, index) {
    const instant = moments.instants[index];
    const size = { width: widest.width, height: widest.height };
    svg.setAttribute('viewBox', '0 0 ' + size.width + ' ' + size.height);
    svg.replaceChildren();
    const stands = standing(instant);
    const corners = instant.area;
    if (corners.length > 2) {
      add(svg, 'polygon', { 'class': 'support', 'stroke-width': unit * 0.5,
        points: corners.map(function (c) { return at(c[0], c[1]).join(','); }).join(' ') });
    }
    instant.axles.forEach(function (ends) {
      line(svg, 'axle', at(ends[0][0], ends[0][1]), at(ends[1][0], ends[1][1]), unit);
    });
    moments.wheels.forEach(function (facts, w) {
      if (known(instant.wheels[w].slice(0, 2))) { wheel(svg, facts, seen(instant, w)); }
    });
    instant.arm.filter(known).forEach(function (s) {
      line(svg, 'arm', at(s[0], s[1]), at(s[3], s[4]), unit * 1.6);
    });
    const trace = moments.instants.slice(0, index + 1).filter(function (other) {
      return instant.t - other.t <= TRACE_S && known(other.zmp);
    });
    add(svg, 'polyline', { 'class': 'trace', 'stroke-width': unit * 0.6,
      points: trace.map(function (other) { return at(other.zmp[0], other.zmp[1]).join(','); }).join(' ') });
    if (known(instant.com)) {
      const c = at(instant.com[0], instant.com[1]), r = unit * 1.6;
      add(svg, 'circle', { 'class': 'com', cx: c[0], cy: c[1], r: r, 'stroke-width': unit * 0.4 });
      line(svg, 'com', [c[0] - r, c[1]], [c[0] + r, c[1]], unit * 0.4);
      line(svg, 'com', [c[0], c[1] - r], [c[0], c[1] + r], unit * 0.4);
    }
    if (known(instant.zmp)) {
      const z = at(instant.zmp[0], instant.zmp[1]), r = unit * 2;
      add(svg, 'polygon', { 'class': 'zmp', 'stroke-width': unit * 0.3,
        points: [[0, -r], [r, 0], [0, r], [-r, 0]].map(function (d) { return [z[0] + d[0], z[1] + d[1]].join(','); }).join(' ') });
    }
    moments.wheels.forEach(function (facts, w) {
      if (stands[w] && known(instant.wheels[w].slice(0, 2))) { label(svg, facts, seen(instant, w), instant.off.includes(w)); }
    });
    gravity(svg, instant, size);
  }

  // From the right: forward is to the right, heights count from the contact plane.
  function drawSide(svg, index) {
    const instant = moments.instants[index];
    const size = { width: box.front - box.rear + 2.4, height: box.high + 1.6 };
    const to = function (x, z) { return [x - box.rear + 1.2, box.high + 0.8 - z]; };
    svg.setAttribute('viewBox', '0 0 ' + size.width + ' ' + size.height);
    svg.replaceChildren();
    line(svg, 'ground', to(box.rear - 1, 0), to(box.front + 1, 0), unit * 0.4);
    moments.wheels.forEach(function (facts, w) {
      if (!known(instant.wheels[w].slice(0, 2))) { return; }
      const centre = to(instant.wheels[w][0], facts.radius);
      add(svg, 'circle', { 'class': 'tyre', cx: centre[0], cy: centre[1], r: facts.radius, 'stroke-width': unit * 0.3,
        'fill-opacity': 0.5 });
    });
    instant.arm.filter(known).forEach(function (s) { line(svg, 'arm', to(s[0], s[2]), to(s[3], s[5]), unit * 1.6); });
    if (known(instant.com)) {
      const c = to(instant.com[0], instant.com[2]), r = unit * 1.6;
      add(svg, 'circle', { 'class': 'com', cx: c[0], cy: c[1], r: r, 'stroke-width': unit * 0.4 });
      line(svg, 'com', [c[0] - r, c[1]], [c[0] + r, c[1]], unit * 0.4);
      line(svg, 'com', [c[0], c[1] - r], [c[0], c[1] + r], unit * 0.4);
      if (known(instant.gravity) && instant.tilt !== null) {
        const down = Math.cos(instant.tilt * Math.PI / 180), length = Math.hypot(instant.gravity[0], down) || 1;
        const reach = unit * 14;
        line(svg, 'gravity', c, [c[0] + instant.gravity[0] / length * reach, c[1] + down / length * reach], unit * 0.5);
      }
    }
    if (instant.zmp[0] !== null) {
      const z = to(instant.zmp[0], 0), r = unit * 2;
      add(svg, 'polygon', { 'class': 'zmp', 'stroke-width': unit * 0.3,
        points: [[0, -r], [r, 0], [0, r], [-r, 0]].map(function (d) { return [z[0] + d[0], z[1] + d[1]].join(','); }).join(' ') });
    }
  }

  // In space: a parallel projection that a pointer turns.
  const view = { turn: -0.9, tilt: 0.35 };
  const middle = [(box.front + box.rear) / 2, (box.left + box.right) / 2, box.high / 2];
  const reach = Math.hypot(box.front - box.rear + 1, box.left - box.right + 1, box.high) / 2 + 0.3;
  function project(x, y, z) {
    const dx = x - middle[0], dy = y - middle[1], dz = z - middle[2];
    const across = -dx * Math.sin(view.turn) + dy * Math.cos(view.turn);
    const away = dx * Math.cos(view.turn) + dy * Math.sin(view.turn);
    return [-across, -dz * Math.cos(view.tilt) + away * Math.sin(view.tilt) * -1];
  }

  function drawSpace(svg, index) {
    const instant = moments.instants[index];
    svg.setAttribute('viewBox', [-reach, -reach, 2 * reach, 2 * reach].join(' '));
    svg.replaceChildren();
    const shape = function (kind, points, width) {
      add(svg, 'polygon', { 'class': kind, 'stroke-width': width,
        points: points.map(function (p) { return project(p[0], p[1], p[2]).join(','); }).join(' ') });
    };
    const there = instant.wheels.map(function (w) { return known(w.slice(0, 2)); });
    const corners = instant.area;
    shape('support', corners.map(function (c) { return [c[0], c[1], 0]; }), unit * 0.4);
    moments.wheels.forEach(function (facts, w) {
      if (!there[w]) { return; }
      const x = instant.wheels[w][0], y = instant.wheels[w][1], r = facts.radius, ring = [];
      for (let k = 0; k < 20; k += 1) {
        ring.push([x + r * Math.cos(k * Math.PI / 10), y, r + r * Math.sin(k * Math.PI / 10)]);
      }
      shape('tyre', ring, unit * 0.3);
    });
    const radius = Math.max.apply(null, moments.wheels.map(function (w) { return w.radius; }));
    shape('ghost', corners.map(function (c) { return [c[0], c[1], radius]; }), unit * 0.8);
    instant.arm.filter(known).forEach(function (s) {
      line(svg, 'arm', project(s[0], s[1], s[2]), project(s[3], s[4], s[5]), unit * 1.6);
    });
    // What each wheel carries: an arrow's length is its load, that at rest being 1 m for the most loaded wheel.
    const metre = 1 / Math.max.apply(null, atRest.concat([1]));
    moments.wheels.forEach(function (facts, w) {
      const value = seen(instant, w);
      if (!there[w] || value[2] === null) { return; }
      const foot = project(value[0], value[1], 0);
      if (value[2] > 0) {
        const tip = project(value[0], value[1], value[2] * metre);
        add(svg, 'line', { 'class': 'load' + (facts.limit !== null && value[2] < facts.limit ? ' light' : ''),
          x1: foot[0], y1: foot[1], x2: tip[0], y2: tip[1], 'stroke-width': unit * 1.2 });
      } else {
        add(svg, 'circle', { 'class': 'lifted', fill: 'none', cx: foot[0], cy: foot[1], r: unit * 2, 'stroke-width': unit });
      }
      add(svg, 'text', { x: foot[0], y: foot[1] + unit * 4, 'font-size': unit * 3.4, 'stroke-width': unit,
        'text-anchor': 'middle' }, facts.name);
    });
    if (known(instant.com)) {
      const c = project(instant.com[0], instant.com[1], instant.com[2]);
      line(svg, 'com', c, project(instant.com[0], instant.com[1], 0), unit * 0.3);
      add(svg, 'circle', { 'class': 'com', cx: c[0], cy: c[1], r: unit * 1.6, 'stroke-width': unit * 0.4 });
    }
    if (known(instant.zmp)) {
      const z = project(instant.zmp[0], instant.zmp[1], 0);
      add(svg, 'circle', { 'class': 'zmp', cx: z[0], cy: z[1], r: unit * 1.4, 'stroke-width': unit * 0.3 });
    }
  }

  const picture = document.getElementById('moment');
  const side = document.getElementById('moment-side');
  const space = document.getElementById('moment-space');
  const slider = document.getElementById('moment-time');
  const text = document.getElementById('moment-text');
  const table = document.getElementById('moment-loads');

  function row(cells, name) {
    const line = document.createElement('tr');
    cells.forEach(function (cell) {
      const element = document.createElement(name);
      element.textContent = cell;
      line.appendChild(element);
    });
    return line;
  }

  // Who does not see a picture hears what it shows: its name on the page, and the loads.
  function tell(svg, index) {
    const name = svg.dataset.name || (svg.dataset.name = svg.getAttribute('aria-label'));
    const stands = standing(moments.instants[index]);
    const loads = moments.wheels.map(function (facts, w) {
      const instant = moments.instants[index], load = instant.wheels[w][2];
      return facts.name + ' ' + (load === null ? texts.unknown : instant.off.includes(w) ? texts.off : Math.round(load) + ' N');
    });
    svg.setAttribute('aria-label', name + (/ t = /.test(name) ? ': ' : ', t = ' + window.decimal(moments.instants[index].t.toFixed(2)) + ' s: ') +
      loads.filter(function (_, w) { return stands[w]; }).join(', '));
  }

  function show(index) {
    const instant = moments.instants[index];
    [picture, side, space].forEach(function (svg) { tell(svg, index); });
    slider.value = index;
    draw(picture, index);
    drawSide(side, index);
    drawSpace(space, index);
    const mark = moments.events.filter(function (e) { return e.instant === index; })
      .map(function (e) { return e.label; }).join('; ');
    slider.setAttribute('aria-valuetext', window.decimal(instant.t.toFixed(2)) + ' s');
    text.textContent = 't = ' + window.decimal(instant.t.toFixed(2)) + ' s' + (mark ? ': ' + mark.replace(/, t = .*/, '') : '') +
      (instant.reasons ? ' (' + filled(texts.invalid, instant) + ')' : '');
    const number = function (v) { return v === null ? texts.unknown : Math.round(v).toString(); };
    table.replaceChildren(row([moments.word.charAt(0).toUpperCase() + moments.word.slice(1)].concat(texts.head), 'th'));
    moments.wheels.forEach(function (facts, w) {
      const value = instant.wheels[w];
      table.appendChild(row([facts.name, number(value[2]),
        value[3] === null ? texts.unknown : number(2 * value[3]),
        value[4] === null || value[5] === null ? texts.unknown : filled(texts.range, { from: number(value[4]), to: number(value[5]) }),
        number(facts.at_rest)], 'td'));
    });
  }

  function step(direction) {
    const now = Number(slider.value);
    const places = moments.events.map(function (e) { return e.instant; });
    const next = direction > 0 ? places.find(function (p) { return p > now; })
      : places.slice().reverse().find(function (p) { return p < now; });
    if (next !== undefined) { show(next); }
  }

  let held = null;
  space.addEventListener('pointerdown', function (event) {
    held = [event.clientX, event.clientY];
    space.setPointerCapture(event.pointerId);
  });
  space.addEventListener('pointermove', function (event) {
    if (!held) { return; }
    view.turn -= (event.clientX - held[0]) * 0.01;
    view.tilt = Math.max(0, Math.min(1.5, view.tilt + (event.clientY - held[1]) * 0.01));
    held = [event.clientX, event.clientY];
    drawSpace(space, Number(slider.value));
  });
  space.addEventListener('pointerup', function () { held = null; });
  slider.addEventListener('input', function () { show(Number(slider.value)); });
  document.getElementById('moment-before').addEventListener('click', function () { step(-1); });
  document.getElementById('moment-after').addEventListener('click', function () { step(1); });
  // A click in a plot selects that time.
  window.showMoment = function (seconds) {
    const later = moments.instants.findIndex(function (instant) { return instant.t >= seconds; });
    show(later < 0 ? moments.instants.length - 1 : later);
  };
  moments.pictures.forEach(function (event, place) {
    const svg = document.getElementById('picture-' + place);
    draw(svg, moments.events[event].instant);
    tell(svg, moments.events[event].instant);
  });
  show(moments.first);
})();
