// SPDX-License-Identifier: Apache-2.0
// Small pictures of a loop: bars of the faceplate, PV over CO, histogram.
import {el, setAttribute, setText, svg} from './dom.js';
import {decimalsFor, fixed} from './format.js';
import {extent, scaleOf} from './history.js';

const HIGH = 190, TOP = 10;

// Draws one upright bar with its scale. set(value, mark): a triangle points at `mark` (the set point, the stem).
export function bar({name, range, unit, limits}) {
  const span = range[1] - range[0] || 1;
  const at = (v) => TOP + HIGH * (1 - Math.min(Math.max((v - range[0]) / span, 0), 1));
  const fillBar = svg('rect', {class: 'bar-fill', x: 34, width: 22, y: at(range[0]), height: 0});
  const mark = svg('path', {class: 'bar-mark', d: ''});
  const ticks = [0, 0.25, 0.5, 0.75, 1].map((share) => {
    const v = range[0] + share * span;
    return svg('g', {}, svg('path', {class: 'bar-tick', d: `M29 ${at(v)}h5`}),
      svg('text', {class: 'bar-text', x: 26, y: at(v) + 3.5, 'text-anchor': 'end'}, share % 0.5 === 0 ? fixed(v, Math.max(0, decimalsFor(range) - 2)) : ''));
  });
  const ends = limits ? [limits[0], limits[1]].filter((v) => v > range[0] && v < range[1])
    .map((v) => svg('path', {class: 'bar-limit', d: `M33 ${at(v)}h24`})) : [];
  const value = el('span', {class: 'bar-value value'});
  const picture = svg('svg', {class: 'bar', viewBox: `0 0 72 ${HIGH + 2 * TOP}`, 'aria-hidden': 'true'},
    svg('rect', {class: 'bar-track', x: 34, width: 22, y: TOP, height: HIGH}), fillBar, ends, ticks, mark);
  const node = el('div', {class: 'bar-box'}, el('div', {class: 'bar-name'}, name), picture, value, el('div', {class: 'unit'}, unit));
  return {
    node,
    set(v, pointer) {
      const known = typeof v === 'number', y = known ? at(v) : at(range[0]);
      setAttribute(fillBar, 'y', String(y));
      setAttribute(fillBar, 'height', String(at(range[0]) - y));
      setText(value, fixed(v, decimalsFor(range)));
      const p = typeof pointer === 'number' ? at(pointer) : null;
      setAttribute(mark, 'd', p === null ? '' : `M58 ${p}l8 -5v10z`);
    },
  };
}

function scaled(canvas, width, height) {
  const dots = devicePixelRatio || 1;
  canvas.width = Math.round(width * dots);
  canvas.height = Math.round(height * dots);
  const ctx = canvas.getContext('2d');
  ctx.setTransform(dots, 0, 0, dots, 0, 0);
  return ctx;
}

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

function frame(ctx, {left, top, width, height}, x, y, units) {
  ctx.strokeStyle = colour('grid');
  ctx.fillStyle = colour('soft');
  ctx.font = '12px system-ui, sans-serif';
  ctx.lineWidth = 1;
  const text = (v, [a, b]) => fixed(v, decimalsFor([a, b]));
  for (let k = 0; k <= 4; ++k) {
    const px = left + width * k / 4, py = top + height * (1 - k / 4);
    ctx.beginPath();
    ctx.moveTo(px, top);
    ctx.lineTo(px, top + height);
    ctx.moveTo(left, py);
    ctx.lineTo(left + width, py);
    ctx.stroke();
    ctx.textAlign = k === 4 ? 'right' : k ? 'center' : 'left';
    ctx.textBaseline = 'top';
    if (k % 2 === 0) ctx.fillText(k === 4 ? `${text(x[1], x)} ${units[0]}` : text(x[0] + (x[1] - x[0]) * k / 4, x), px, top + height + 5);
    ctx.textAlign = 'right';
    ctx.textBaseline = k === 4 ? 'top' : k ? 'middle' : 'bottom';
    if (k % 2 === 0) ctx.fillText(text(y[0] + (y[1] - y[0]) * k / 4, y), left - 5, py);
  }
  ctx.textAlign = 'left';
  ctx.textBaseline = 'bottom';
  ctx.fillText(units[1], left, top - 3);
}

// Samples farther apart than this, pixels, are not joined: others were left out between them, so a line would be invented.
const JOINED = 16;

// Draws PV over CO of a stretch, older parts paler: a sticking valve draws a parallelogram, a healthy one a line. Extremes are not drawn,
// because their PV and CO were not measured at the same time.
export function drawPhase(canvas, history, [from_ms, to_ms], ranges, units) {
  const width = canvas.parentNode.clientWidth, height = Math.min(320, Math.max(220, width * 0.62));
  canvas.style.height = `${height}px`;
  const ctx = scaled(canvas, width, height), area = {left: 46, top: 20, width: width - 58, height: height - 46};
  const x = scaleOf(extent(history, ['co'], from_ms, to_ms), ranges.co), y = scaleOf(extent(history, ['pv'], from_ms, to_ms), ranges.pv);
  frame(ctx, area, x, y, units);
  const rows = [];
  let whole = true;
  for (let i = 0; i < history.t.length; ++i) {
    if (history.t[i] < from_ms || history.t[i] > to_ms) continue;
    if (history.sample?.[i] === 0) whole = false;
    if (history.sample?.[i] !== 0 || history.co[i] === null) rows.push(i);
  }
  ctx.strokeStyle = ctx.fillStyle = colour('measured');
  ctx.lineWidth = 1.2;
  const parts = 6;
  for (let part = 0; part < parts; ++part) {
    ctx.globalAlpha = 0.2 + 0.8 * (part + 1) / parts;
    ctx.beginPath();
    let pen = null;
    for (let k = Math.floor(rows.length * part / parts); k <= Math.min(Math.floor(rows.length * (part + 1) / parts), rows.length - 1); ++k) {
      const co = history.co[rows[k]], pv = history.pv[rows[k]];
      if (co === null || pv === null) { pen = null; continue; }
      const px = area.left + area.width * (co - x[0]) / (x[1] - x[0]), py = area.top + area.height * (1 - (pv - y[0]) / (y[1] - y[0]));
      if (pen && (whole || Math.hypot(px - pen[0], py - pen[1]) <= JOINED)) ctx.lineTo(px, py); else ctx.moveTo(px, py);
      if (!whole) ctx.fillRect(px - 0.75, py - 0.75, 1.5, 1.5);
      pen = [px, py];
    }
    ctx.stroke();
  }
  ctx.globalAlpha = 1;
  const last = rows.at(-1);
  if (last !== undefined && history.co[last] !== null && history.pv[last] !== null) {
    ctx.fillStyle = colour('ink');
    ctx.beginPath();
    ctx.arc(area.left + area.width * (history.co[last] - x[0]) / (x[1] - x[0]), area.top + area.height * (1 - (history.pv[last] - y[0]) / (y[1] - y[0])), 4, 0, 7);
    ctx.fill();
  }
}

// Draws a share as a bar in a table's cell; its number is next to it.
export function meter(share, look = '') {
  const known = typeof share === 'number' && Number.isFinite(share);
  return svg('svg', {class: `meter ${look}`, viewBox: '0 0 100 8', preserveAspectRatio: 'none', 'aria-hidden': 'true'},
    svg('rect', {class: 'meter-track', width: 100, height: 8}),
    known ? svg('rect', {class: 'meter-fill', width: 100 * Math.min(Math.max(share, 0), 1), height: 8}) : null);
}
