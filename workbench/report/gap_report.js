// SPDX-License-Identifier: Apache-2.0
// The plots of gap's report, drawn by uPlot from the JSON in #data: zoom, cursor with values, one span of time for all.
// Without scripts, and on paper, the pictures of the page stand in their place.
'use strict';
(() => {
  const box = document.getElementById('plots'), source = document.getElementById('data');
  if (!box || !source || typeof uPlot === 'undefined') return;
  const data = JSON.parse(source.textContent);
  document.body.classList.add('live');
  const last = data.samples - 1, least = Math.min(last, 8);
  const seconds = (k) => data.first_s + k * data.period_s;
  const begin = seconds(0), end = seconds(last);
  let from = begin, to = end;

  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue('--' + name).trim();
  const dashes = {sp: [6, 4], before: [7, 3]};
  const shown = (v) => (Number.isFinite(v) ? String(+v.toPrecision(4)) : '-');
  // At `time` on the line between a curve's points; NaN where the record has a gap.
  const value = (curve, time) => {
    let a = 0, b = curve.t.length;
    while (a < b) {
      const m = (a + b) >> 1;
      if (curve.t[m] <= time) a = m + 1; else b = m;
    }
    const y0 = curve.y[a - 1], y1 = curve.y[a];
    if (y0 == null) return NaN;
    if (curve.t[a - 1] === time || a === curve.t.length) return curve.t[a - 1] === time ? y0 : NaN;
    return y1 == null ? NaN : y0 + (y1 - y0) * (time - curve.t[a - 1]) / (curve.t[a] - curve.t[a - 1]);
  };
  const fit = (low, high) => {
    if (!(high >= low)) return [0, 1];
    const more = Math.max((high - low) * 0.06, 1e-6 * Math.max(Math.abs(low), Math.abs(high)), 1e-9);
    return [low - more, high + more];
  };
  const axis = (label, size) => ({
    label, size, labelSize: 18, labelGap: 0, gap: 4, font: '12px system-ui, sans-serif', labelFont: '12px system-ui, sans-serif',
    stroke: () => colour('soft'), grid: {stroke: () => colour('grid'), width: 1}, ticks: {show: false},
  });
  const rectangle = (u, a, b, style, alpha) => {
    const left = u.valToPos(a, 'x', true), right = u.valToPos(b, 'x', true), {ctx, bbox} = u;
    const x = Math.max(left, bbox.left), w = Math.min(right, bbox.left + bbox.width) - x;
    if (w <= 0) return;
    ctx.save();
    ctx.globalAlpha = alpha;
    ctx.fillStyle = colour(style);
    ctx.fillRect(x, bbox.top, w, bbox.height);
    ctx.restore();
  };
  const level = (u, at, style, dash) => {
    const y = u.valToPos(at, 'y', true), {ctx, bbox} = u;
    if (y < bbox.top || y > bbox.top + bbox.height) return;
    ctx.save();
    ctx.strokeStyle = colour(style);
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash(dash);
    ctx.beginPath();
    ctx.moveTo(bbox.left, y);
    ctx.lineTo(bbox.left + bbox.width, y);
    ctx.stroke();
    ctx.restore();
  };
  const behind = (plot) => (u) => {
    if (data.held_from_s !== null) rectangle(u, data.held_from_s, end, 'held', 0.1);
    for (const [a, b, share] of plot.shades) rectangle(u, a, b, 'shade', 0.1 + 0.35 * Math.min(Math.max(share, 0), 1));
    if (plot.zero) level(u, 0, 'line', []);
    if (plot.floor > 0) for (const at of [plot.floor, -plot.floor]) level(u, at, 'soft', [2, 4]);
  };

  const times = data.plots.map((plot) => {
    const figure = document.getElementById(plot.id), holder = figure.querySelector('.chart');
    for (const curve of plot.curves) curve.t = curve.k.map(seconds);
    const high = () => (holder.clientWidth < 520 ? 210 : plot.height);
    const u = new uPlot({
      width: holder.clientWidth, height: high(),
      padding: [8, 12, 0, 0],
      cursor: {sync: {key: 'gap'}, drag: {x: true, y: false, dist: 4}, y: false},
      select: {show: true},
      legend: {live: true},
      scales: {x: {time: false}, y: {range: (self, low, top) => fit(low, top)}},
      axes: [axis('s', 22), axis(plot.unit, 46)],
      series: [{label: 'time', value: (self, x) => (x == null ? '-' : `${shown(x)} s`)},
               ...plot.curves.map((curve) => ({
                 label: curve.name, stroke: () => colour(curve.style), width: 1.4, dash: dashes[curve.style],
                 points: {show: false},
                 value: (self, y, series, index) =>
                   (index == null ? '-' : `${shown(value(curve, self.data[0][index]))} ${plot.unit}`),
               }))],
      hooks: {drawClear: [behind(plot)],
              setScale: [(self, key) => { if (key === 'x') show(self.scales.x.min, self.scales.x.max); }]},
    }, uPlot.join(plot.curves.map((curve) => [curve.t, curve.y])), holder);
    return {u, figure, holder, high};
  });

  // Curves over another quantity than time: points in their order, those of the span that is shown.
  const ordered = (u, index) => {
    const [xs, ys] = u.data[index], {ctx, bbox} = u, curve = u.series[index].curve;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.strokeStyle = colour(curve.style);
    ctx.globalAlpha = 0.75;
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash((dashes[curve.style] || []).map((d) => d * devicePixelRatio));
    ctx.beginPath();
    let pen = false;
    for (let i = 0; i < xs.length; ++i) {
      if (xs[i] == null || ys[i] == null) { pen = false; continue; }
      const x = u.valToPos(xs[i], 'x', true), y = u.valToPos(ys[i], 'y', true);
      if (pen) ctx.lineTo(x, y); else ctx.moveTo(x, y);
      pen = true;
    }
    ctx.stroke();
    ctx.restore();
    return null;
  };
  const within = (plot) => [null, ...plot.curves.map((curve) => {
    const xs = [], ys = [];
    curve.k.forEach((k, i) => {
      const t = seconds(k);
      if (t < from || t > to) { xs.push(null); ys.push(null); return; }
      xs.push(curve.x[i]);
      ys.push(curve.y[i]);
    });
    return [xs, ys];
  })];
  const extent = (u, part) => {
    let low = Infinity, high = -Infinity;
    for (const columns of u.data.slice(1)) {
      for (const v of columns[part]) {
        if (v == null) continue;
        low = Math.min(low, v);
        high = Math.max(high, v);
      }
    }
    return fit(low, high);
  };
  const phases = data.phases.map((plot) => {
    const figure = document.getElementById(plot.id), holder = figure.querySelector('.chart');
    const high = () => Math.min(360, Math.max(240, holder.clientWidth * 0.75));
    const facets = [{scale: 'x', auto: true}, {scale: 'y', auto: true}];
    const u = new uPlot({
      mode: 2, width: holder.clientWidth, height: high(), padding: [8, 12, 0, 0],
      cursor: {show: false}, legend: {show: false},
      scales: {x: {time: false, range: (self) => extent(self, 0)}, y: {range: (self) => extent(self, 1)}},
      axes: [axis(plot.across, 22), axis(plot.up, 46)],
      series: [{}, ...plot.curves.map((curve) => ({curve, label: curve.name, paths: ordered, facets}))],
    }, within(plot), holder);
    return {u, plot, holder, high};
  });

  const span = document.getElementById('span');
  let shows = false;
  const show = (a, b) => {
    if (shows) return;
    shows = true;
    const width = Math.min(end - begin, Math.max(least * data.period_s, b - a));
    from = Math.max(begin, Math.min(end - width, (a + b - width) / 2));
    to = from + width;
    for (const {u} of times) u.batch(() => u.setScale('x', {min: from, max: to}));
    for (const {u, plot} of phases) u.setData(within(plot));
    span.textContent = `${shown(from)} to ${shown(to)} s`;
    // uPlot tells of new scales a moment later.
    queueMicrotask(() => { shows = false; });
  };
  const zoom = (factor, at = (from + to) / 2) => show(at - (at - from) * factor, at + (to - at) * factor);
  const move = (part) => {
    const step = (to - from) * part;
    show(from + step, to + step);
  };
  const all = () => show(begin, end);

  for (const {u, figure} of times) {
    u.over.addEventListener('wheel', (event) => {
      if (!event.ctrlKey && !event.metaKey && !figure.contains(document.activeElement)) return;
      event.preventDefault();
      zoom(event.deltaY > 0 ? 1.25 : 0.8, u.posToVal(event.clientX - u.over.getBoundingClientRect().left, 'x'));
    }, {passive: false});
    u.over.addEventListener('mousedown', () => u.root.focus({preventScroll: true}));
    u.root.tabIndex = 0;
    u.root.addEventListener('keydown', (event) => {
      const act = {'+': () => zoom(0.7), '=': () => zoom(0.7), '-': () => zoom(1.43), '0': all,
                   ArrowLeft: () => move(-0.2), ArrowRight: () => move(0.2)}[event.key];
      if (!act || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      act();
    });
  }
  // What is shown, as files: the span of time and the curves of the plots over time.
  const save = (name, blob) => {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  };
  const csv = () => {
    const curves = data.plots.flatMap((plot) =>
      plot.curves.map((curve) => ({curve, head: `"${plot.title}: ${curve.name}, ${plot.unit}"`})));
    const [xs, ...columns] = uPlot.join(curves.map(({curve}) => [curve.t, curve.y]));
    const rows = [['"time, s"', ...curves.map(({head}) => head)].join(',')];
    xs.forEach((x, i) => {
      if (x < from || x > to) return;
      rows.push([+x.toPrecision(12), ...columns.map((column) => column[i] ?? '')].join(','));
    });
    save('gap.csv', new Blob([rows.join('\n') + '\n'], {type: 'text/csv'}));
  };
  const png = () => {
    const head = 22 * devicePixelRatio, parts = times.map(({u}) => u.ctx.canvas);
    const picture = document.createElement('canvas'), ctx = picture.getContext('2d');
    picture.width = Math.max(...parts.map((part) => part.width));
    picture.height = parts.reduce((sum, part) => sum + part.height + head, 0);
    ctx.fillStyle = colour('panel') || '#fff';
    ctx.fillRect(0, 0, picture.width, picture.height);
    ctx.font = `${13 * devicePixelRatio}px system-ui, sans-serif`;
    ctx.textBaseline = 'middle';
    let y = 0;
    parts.forEach((part, i) => {
      const {title, curves} = data.plots[i];
      let x = 8 * devicePixelRatio;
      const write = (text, style) => {
        ctx.fillStyle = colour(style);
        ctx.fillText(text, x, y + head / 2);
        x += ctx.measureText(text).width + 12 * devicePixelRatio;
      };
      write(title, 'ink');
      for (const curve of curves) write(curve.name, curve.style);
      ctx.drawImage(part, 0, y + head);
      y += head + part.height;
    });
    picture.toBlob((blob) => save('gap.png', blob));
  };
  const acts = {png, csv, closer: () => zoom(0.6), wider: () => zoom(1 / 0.6), left: () => move(-0.4), right: () => move(0.4), all};
  box.querySelector('.tools').addEventListener('click', (event) => {
    const button = event.target.closest('button');
    if (!button) return;
    if (button.dataset.from) show(+button.dataset.from, +button.dataset.to);
    else acts[button.dataset.act]();
  });
  for (const link of document.querySelectorAll('a[data-from]')) {
    link.addEventListener('click', () => {
      const a = +link.dataset.from, b = +link.dataset.to, room = Math.max((b - a) * 0.25, 20 * data.period_s);
      show(a - room, b + room);
    });
  }
  new ResizeObserver(() => {
    for (const {u, holder, high} of [...times, ...phases]) {
      if (holder.clientWidth > 0 && holder.clientWidth !== u.width) u.setSize({width: holder.clientWidth, height: high()});
    }
  }).observe(box);
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => {
    for (const {u} of [...times, ...phases]) u.redraw(false, true);
  });
  all();
})();
