'use strict';
// The table of the logs: filters, order, pages, and a card for each machine. All text is set as text, never as HTML.
unpacked('data').json().then(function (data) {
  const rows = data.machine.length, perPage = 50;
  const place = document.getElementById('explorer');
  const words = data.words;
  const said = function (name, values) { return words[name].replace(/\{(\w+)\}/g, function (_, value) { return values[value]; }); };
  const known = function (value) { return value !== null && value !== undefined; };
  // numbers have the decimal mark of the page's language
  const decimals = function (number) { return data.comma ? String(number).replace('.', ',') : String(number); };
  const fixed = function (number, digits) { return decimals(number.toFixed(digits)); };
  const percent = function (thousandths) { return known(thousandths) ? fixed(thousandths / 10, 1) + ' %' : words.unknown; };
  const seconds = function (s) { return s < 120 ? decimals(+s.toFixed(s < 10 ? 2 : 0)) + ' s' : s < 7200 ? fixed(s / 60, 1) + ' min' : fixed(s / 3600, 1) + ' h'; };
  const date = function (day) { return known(day) ? new Date(day * 864e5).toISOString().slice(0, 10) : words.unknown; };
  const machineName = function (i) { const m = data.machine[i]; return known(m) ? data.machines[m].name : words.unknown; };
  const element = function (tag, text, parent, attributes) {
    const made = document.createElement(tag);
    if (text !== undefined && text !== null) made.textContent = text;
    for (const name in attributes || {}) made.setAttribute(name, attributes[name]);
    if (parent) parent.appendChild(made);
    return made;
  };
  const link = function (i, parent) {
    const full = data.folders[data.folder[i]] + data.name[i];
    if (data.report[i]) element('a', data.name[i], parent, {href: 'reports/' + data.report[i] + '/report.html', title: full});
    else element('span', data.name[i], parent, {title: full});
  };
  const margin = function (i) {
    if (!known(data.margin[i])) return data.group[i] === data.groups.length - 1 ? '' : words.not_computable;
    const value = percent(data.margin[i]);
    return (known(data.sigma[i]) ? value + ' ± ' + percent(2 * data.sigma[i]) : said('no_uncertainty', {margin: value})) +
      (data.marks[i] & 2 ? data.contradicted : '');
  };
  const posture = function (i) {
    if (!known(data.posture[i])) return '';
    const names = data.joints[data.posture[i][0]].split('\n');
    return data.posture[i][1].map(function (position, j) {
      const metres = names[j].endsWith(' m'), name = names[j].slice(0, metres ? -2 : -1);
      return name + ' ' + (!known(position) ? words.unknown : metres ? fixed(position / 100, 2) + ' m' : position + '°');
    }).join(', ');
  };
  const certainty = function (i) { return known(data.certainty[i]) ? data.certainties[data.certainty[i]] : ''; };
  const logsIn = function (n) { return n === 1 ? words.one_log : said('logs', {count: n}); };
  const named = function (names, places) { return function (i) { return known(places[i]) ? names[places[i]] : null; }; };
  const wheel = named(data.wheels, data.wheel), cause = named(data.causes, data.cause), told = named(data.texts, data.text);
  // in the order of their heads
  const columns = [
    // logs of one rank by margin
    {key: function (i) { return data.rank[i] + (known(data.margin[i]) ? Math.min(9e4, data.margin[i] + 3e4) : 9e4) / 1e5; },
      text: function (i) { return data.tied[i] ? said('range', {first: data.rank[i], last: data.rank[i] + data.tied[i]}) : data.rank[i]; }},
    {key: machineName, cell: function (i, parent) {
      if (!known(data.machine[i])) { parent.textContent = machineName(i); return; }
      const button = element('button', machineName(i), parent, {type: 'button'});
      button.addEventListener('click', function () { filters.machine.value = String(data.machine[i]); page = 0; show(); });
    }},
    {key: function (i) { return data.name[i]; }, cell: link},
    {key: function (i) { return data.group[i]; }, text: function (i) { return data.groups[data.group[i]]; }},
    {key: function (i) { return data.margin[i]; }, text: margin},
    {key: function (i) { return data.any[i]; }, text: function (i) { return known(data.any[i]) ? data.any[i] + ' %' : ''; }},
    {key: wheel, text: wheel},
    {down: true, key: function (i) { return data.lifted[i]; }, text: function (i) { return data.lifted[i] ? seconds(data.lifted[i] / 100) : ''; }},
    {down: true, key: function (i) { return data.sure[i]; }, text: certainty},
    {key: function (i) { return data.valid[i]; }, text: function (i) { return (known(data.valid[i]) ? percent(data.valid[i]) : '') + (data.marks[i] & 1 ? words.undecided : ''); }},
    {key: cause, text: cause},
    {down: true, key: function (i) { return data.speed[i]; }, text: function (i) { return known(data.speed[i]) ? fixed(data.speed[i] / 10, 1) + ' m/s' : ''; }},
    {down: true, key: function (i) { return data.tilt[i]; }, text: function (i) { return known(data.tilt[i]) ? data.tilt[i] + '°' : ''; }},
    {key: function (i) { return posture(i) || null; }, text: posture},
    {key: function (i) { return data.day[i]; }, text: function (i) { return date(data.day[i]); }},
    {key: told, text: told}
  ];
  const state = {by: 0, down: false};
  let page = 0, chosen = [];
  place.textContent = '';
  const bar = element('div', null, place, {'class': 'filters'});
  const filters = {};
  const select = function (name, label, options) {
    const box = element('label', label + ' ', bar);
    filters[name] = element('select', null, box, {name: name});
    element('option', words.all, filters[name], {value: ''});
    options.forEach(function (option) { element('option', option[1], filters[name], {value: option[0]}); });
  };
  const input = function (name, label, type) {
    const box = element('label', label + ' ', bar);
    filters[name] = element('input', null, box, {name: name, type: type});
  };
  const indexed = function (names) { return names.map(function (name, i) { return [i, name]; }); };
  const byName = function (a, b) { return a[1] < b[1] ? -1 : 1; };
  const types = Array.from(new Set(data.machines.map(function (m) { return m.kind; }).filter(known))).sort();
  select('machine', words.machine, indexed(data.machines.map(function (m) { return m.name; })).sort(byName));
  select('type', words.type, types.map(function (kind) { return [kind, kind]; }));
  select('group', words.finding, indexed(data.groups));
  select('event', words.event, indexed(data.kinds));
  select('cause', words.cause, indexed(data.causes));
  input('from', words.from, 'date');
  input('to', words.to, 'date');
  input('text', words.text, 'search');
  const clear = element('button', words.clear, bar, {type: 'button'});
  const card = element('div', null, place, {'class': 'card'});
  const count = element('p', null, place, {'class': 'hint', 'aria-live': 'polite'});
  const wide = element('div', null, place, {'class': 'wide ranking'});
  const table = element('table', null, wide);
  const head = element('tr', null, element('thead', null, table));
  const body = element('tbody', null, table);
  const pager = element('div', null, place, {'class': 'filters'});
  const before = element('button', words.before, pager, {type: 'button'});
  const where = element('span', null, pager);
  const after = element('button', words.after, pager, {type: 'button'});
  columns.forEach(function (column, c) {
    const cell = element('th', null, head, {scope: 'col'});
    column.button = element('button', data.heads[c], cell, {type: 'button'});
    column.th = cell;
    column.button.addEventListener('click', function () {
      state.down = state.by === c ? !state.down : Boolean(column.down); state.by = c; page = 0; show();
    });
  });
  const matching = function () {
    const value = function (name) { return filters[name].value === '' ? null : +filters[name].value; };
    const machine = value('machine'), group = value('group'), event = value('event'), cause = value('cause');
    const kind = filters.type.value, text = filters.text.value.toLowerCase();
    const day = function (name) { return filters[name].value ? Date.parse(filters[name].value) / 864e5 : null; };
    const from = day('from'), to = day('to');
    const found = [];
    for (let i = 0; i < rows; i++) {
      if (machine !== null && data.machine[i] !== machine) continue;
      if (kind && !(known(data.machine[i]) && data.machines[data.machine[i]].kind === kind)) continue;
      if (group !== null && data.group[i] !== group) continue;
      if (event !== null && !(data.events[i] >> event & 1)) continue;
      if (cause !== null && data.cause[i] !== cause) continue;
      if (from !== null && !(known(data.day[i]) && data.day[i] >= from)) continue;
      if (to !== null && !(known(data.day[i]) && data.day[i] <= to)) continue;
      if (text && !(data.folders[data.folder[i]] + data.name[i] + ' ' + machineName(i)).toLowerCase().includes(text)
          && !(known(data.text[i]) && data.texts[data.text[i]].toLowerCase().includes(text))) continue;
      found.push(i);
    }
    const key = columns[state.by].key, sign = state.down ? -1 : 1, keys = new Array(rows);
    found.forEach(function (i) { keys[i] = key(i); });
    found.sort(function (a, b) {
      const x = keys[a], y = keys[b];
      if (!known(x) || !known(y)) return (known(y) ? 1 : 0) - (known(x) ? 1 : 0) || a - b;
      return x < y ? -sign : x > y ? sign : a - b;
    });
    return found;
  };
  const svg = function (tag, parent, attributes, title) {
    const made = document.createElementNS('http://www.w3.org/2000/svg', tag);
    for (const name in attributes) made.setAttribute(name, attributes[name]);
    if (title) { const t = document.createElementNS('http://www.w3.org/2000/svg', 'title'); t.textContent = title; made.appendChild(t); }
    parent.appendChild(made);
    return made;
  };
  // the margins of a machine over its days: the lowest of each day as a line, and the logs as dots
  const history = function (m) {
    const dots = [];
    for (let i = 0; i < rows; i++) if (data.machine[i] === m && known(data.day[i]) && known(data.margin[i])) dots.push(i);
    if (!dots.length) { element('p', words.no_history, card); return; }
    let first = Infinity, last = -Infinity, floor = -100;
    dots.forEach(function (i) { first = Math.min(first, data.day[i]); last = Math.max(last, data.day[i]); floor = Math.min(floor, data.margin[i]); });
    floor = Math.max(floor, -500);
    const width = 900, height = 200, x = function (day) { return 44 + (width - 60) * (last > first ? (day - first) / (last - first) : 0.5); };
    const y = function (value) { return 10 + (height - 40) * (1 - (Math.max(floor, Math.min(1000, value)) - floor) / (1000 - floor)); };
    const chart = svg('svg', card, {viewBox: '0 0 ' + width + ' ' + height, 'class': 'chart', role: 'img'}, words.history);
    [0, 500, 1000].forEach(function (value) {
      svg('line', chart, {x1: 44, x2: width - 16, y1: y(value), y2: y(value), stroke: value ? 'var(--grid)' : 'var(--axis)', 'stroke-dasharray': value ? '' : '4 3'});
      svg('text', chart, {x: 40, y: y(value) + 4, fill: 'var(--ink)', 'text-anchor': 'end', 'font-size': 12}).textContent = value / 10 + ' %';
    });
    [[first, 'start'], [last, 'end']].forEach(function (end) {
      svg('text', chart, {x: x(end[0]), y: height - 6, fill: 'var(--ink)', 'text-anchor': last > first ? end[1] : 'middle', 'font-size': 12}).textContent = date(end[0]);
    });
    const lowest = new Map();
    dots.forEach(function (i) { const d = data.day[i]; if (!lowest.has(d) || data.margin[i] < data.margin[lowest.get(d)]) lowest.set(d, i); });
    const days = Array.from(lowest.keys()).sort(function (a, b) { return a - b; });
    svg('polyline', chart, {fill: 'none', stroke: 'var(--accent)', points: days.map(function (d) { return x(d) + ',' + y(data.margin[lowest.get(d)]); }).join(' ')});
    (dots.length > 600 ? days.map(function (d) { return lowest.get(d); }) : dots).forEach(function (i) {
      const lifted = data.group[i] < 3;
      if (known(data.sigma[i])) svg('line', chart, {x1: x(data.day[i]), x2: x(data.day[i]), y1: y(data.margin[i] - 2 * data.sigma[i]), y2: y(data.margin[i] + 2 * data.sigma[i]), stroke: 'var(--soft)'});
      svg('circle', chart, {cx: x(data.day[i]), cy: y(data.margin[i]), r: 3.5, fill: lifted ? 'var(--limit)' : 'var(--accent)'},
        data.name[i] + ', ' + date(data.day[i]) + ': ' + margin(i) + ', ' + data.groups[data.group[i]]);
    });
  };
  const showCard = function () {
    card.textContent = '';
    if (filters.machine.value === '') return;
    const m = +filters.machine.value, machine = data.machines[m];
    element('h3', machine.name + (known(machine.kind) ? ' (' + machine.kind + ')' : ''), card);
    let logs = 0, computable = 0, exposed = 0, lifted = 0, unknown = 0;
    const groups = data.groups.map(function () { return 0; });
    for (let i = 0; i < rows; i++) if (data.machine[i] === m) {
      logs++; computable += data.computable[i]; exposed += data.exposed[i] || 0; unknown += known(data.exposed[i]) ? 0 : 1; lifted += data.lifted[i] / 100; groups[data.group[i]]++;
    }
    const found = groups.map(function (n, g) { return n ? n + ': ' + data.groups[g] : ''; }).filter(Boolean).join('; ');
    const below = unknown === logs ? words.unknown_time : unknown ? said('at_least', {time: seconds(exposed)}) : seconds(exposed);
    element('p', said('card', {logs: logsIn(logs), computable: seconds(computable), exposed: below, lifted: seconds(lifted), found: found}), card);
    if (data.left_out) element('p', said('left_out', {rows: rows, all: rows + data.left_out}), card, {'class': 'holes'});
    // a machine that became better is no warning
    machine.outliers.forEach(function (told) { element('p', told[0], card, told[1] ? {'class': 'holes'} : {}); });
    history(m);
  };
  const show = function () {
    chosen = matching();
    const pages = Math.max(1, Math.ceil(chosen.length / perPage));
    page = Math.min(page, pages - 1);
    body.textContent = '';
    chosen.slice(page * perPage, (page + 1) * perPage).forEach(function (i) {
      const line = element('tr', null, body);
      columns.forEach(function (column) {
        const cell = element('td', column.text ? column.text(i) : null, line);
        if (column.cell) column.cell(i, cell);
      });
    });
    columns.forEach(function (column, c) {
      column.th.setAttribute('aria-sort', state.by !== c ? 'none' : state.down ? 'descending' : 'ascending');
    });
    count.textContent = said('shown', {shown: chosen.length, all: logsIn(rows)});
    where.textContent = ' ' + said('page', {page: page + 1, pages: pages}) + ' ';
    before.disabled = page === 0; after.disabled = page + 1 >= pages;
    showCard();
    place.setAttribute('data-shown', String(chosen.length));
  };
  bar.addEventListener('input', function () { page = 0; show(); });
  clear.addEventListener('click', function () {
    for (const name in filters) filters[name].value = '';
    state.by = 0; state.down = false; page = 0; show();
  });
  before.addEventListener('click', function () { page--; show(); });
  after.addEventListener('click', function () { page++; show(); });
  // links of the page's other sections choose a machine: #machine=NAME
  const fromAddress = function () {
    const wanted = /^#machine=(.*)$/.exec(location.hash);
    if (!wanted) return;
    const name = decodeURIComponent(wanted[1]);
    const m = data.machines.findIndex(function (machine) { return machine.name === name; });
    if (m >= 0) { filters.machine.value = String(m); page = 0; }
  };
  window.addEventListener('hashchange', function () { fromAddress(); show(); place.scrollIntoView(); });
  fromAddress();
  show();
});
