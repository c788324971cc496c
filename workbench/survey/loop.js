// SPDX-License-Identifier: Apache-2.0
// A loop's page: trends of the whole export and of the stretch that shows most, and PV over CO.
(() => {
  const data = JSON.parse(document.getElementById('data').textContent);
  // Of the page as it is being shown, on a screen or on paper.
  const css = (name) => () => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  const ink = css('--ink'), grid = {stroke: 'rgba(128,128,128,.18)', width: 1};
  const colours = {pv: css('--measured'), sp: css('--sp'), co: css('--after')};
  const wall = data.start_s !== null;
  // The export's own clock, wherever the page is read.
  const tzDate = (t) => uPlot.tzDate(new Date(t * 1e3), 'Etc/UTC');
  const stamp = (t) => new Date(t * 1e3).toISOString();
  const moments = (u, ticks, axis, space, step) => ticks.map((t, k) => {
    const at = stamp(t), day = at.slice(0, 10);
    if (step >= 86400) return day.slice(5) + (k === 0 ? '\n' + day.slice(0, 4) : '');
    const begins = k === 0 || stamp(ticks[k - 1]).slice(0, 10) !== day;
    return at.slice(11, step < 60 ? 19 : 16) + (begins ? '\n' + day : '');
  });
  const plots = [];
  const keep = (u, box) => {
    plots.push(() => { u.setSize({width: box.clientWidth, height: 260}); u.redraw(); });
    new ResizeObserver(plots[plots.length - 1]).observe(box);
  };
  const axes = (time) => [
    {stroke: ink, grid, values: time ? moments : (u, ticks) => ticks.map((t) => t + ' s')},
    {stroke: ink, grid, size: 60}, {stroke: colours.co, side: 1, grid: {show: false}, size: 60}];
  const draw = (id, t, what, time) => {
    const box = document.getElementById(id), columns = [t];
    const series = [{value: (u, t) => t === null || t === undefined ? '--' : time ? stamp(t).slice(0, 19).replace('T', ' ') : t + ' s'}];
    for (const name of ['sp', 'pv', 'co']) {
      if (!what[name]) continue;
      series.push({label: name.toUpperCase(), stroke: colours[name], width: name === 'pv' ? 1.5 : 1, scale: name === 'co' ? 'co' : 'y',
        points: {show: false}});
      columns.push(what[name]);
    }
    const u = new uPlot({width: box.clientWidth, height: 260, tzDate, scales: {x: {time}}, axes: axes(time).map((a, k) =>
      k === 2 ? {...a, scale: 'co'} : k === 1 ? {...a, scale: 'y'} : a), series}, columns, box);
    keep(u, box);
  };
  const p = data.picture, n = p.pv.length;
  const at = (s) => wall ? data.start_s + s : s;
  draw('trend', Array.from({length: n}, (_, k) => at(p.from_s + (p.to_s - p.from_s) * k / (n - 1))), p, wall);
  const z = p.zoom;
  draw('zoom', z.pv.map((_, k) => at(z.from_s + z.step_s * k)), z, wall);
  if (z.co) {
    const box = document.getElementById('phase');
    const dots = (u, series, from, to) => {
      const d = u.ctx, size = 3 * devicePixelRatio;
      d.save();
      d.strokeStyle = colours.pv();
      d.globalAlpha = 0.55;
      d.beginPath();
      let pen = false;
      for (let k = 0; k < u.data[series].length; k++) {
        const x = data.picture.zoom.co[k], y = data.picture.zoom.pv[k];
        if (x === null || y === null) { pen = false; continue; }
        const cx = u.valToPos(x, 'x', true), cy = u.valToPos(y, 'y', true);
        pen ? d.lineTo(cx, cy) : d.moveTo(cx, cy);
        pen = true;
      }
      d.lineWidth = size / 3;
      d.stroke();
      d.restore();
      return null;
    };
    const known = z.co.map((v, k) => [v, z.pv[k]]).filter(([a, b]) => a !== null && b !== null).sort((a, b) => a[0] - b[0]);
    if (known.length > 1) {
      const xs = known.map((v) => v[0]), ys = known.map((v) => v[1]);
      const room = (v) => { const low = Math.min(...v), high = Math.max(...v), r = (high - low) * .05 || 1; return [low - r, high + r]; };
      const xr = room(xs), yr = room(ys);
      // The drawing takes the samples in their order; uPlot wants them sorted for its axes only.
      const u = new uPlot({width: box.clientWidth, height: 260, legend: {show: false}, cursor: {show: false},
        scales: {x: {time: false, range: () => xr}, y: {range: () => yr}},
        axes: [{stroke: ink, grid, label: 'CO', labelSize: 18}, {stroke: ink, grid, size: 60}],
        series: [{}, {stroke: ink, paths: dots, points: {show: false}}]}, [xs, ys], box);
      keep(u, box);
    }
  }
  matchMedia('print').addEventListener('change', () => plots.forEach((draw) => draw()));
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => plots.forEach((draw) => draw()));
})();
