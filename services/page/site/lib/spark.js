// SPDX-License-Identifier: Apache-2.0
// A strip with ten minutes of PV, the set point as a dashed line, and a gauge of PV in its range next to it.
import {scaleOf, strip} from './history.js';

let colours = {};
const NAMES = ['ink', 'soft', 'line', 'measured', 'sp', 'high', 'low', 'track'];

// Called after a change of theme.
export function readColours() {
  const style = getComputedStyle(document.documentElement);
  colours = Object.fromEntries(NAMES.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  return colours;
}

function fitted(canvas) {
  const dots = Math.min(devicePixelRatio || 1, 2), width = canvas.room ?? 200, height = canvas.tall ?? 34;
  if (canvas.width !== Math.round(width * dots) || canvas.height !== Math.round(height * dots)) {
    canvas.width = Math.round(width * dots);
    canvas.height = Math.round(height * dots);
  }
  const ctx = canvas.getContext('2d');
  ctx.setTransform(dots, 0, 0, dots, 0, 0);
  ctx.clearRect(0, 0, width, height);
  return [ctx, width, height];
}

function gauge(ctx, x, height, pv, sp, range) {
  const top = 2, tall = height - 4, at = (v) => top + tall * (1 - Math.min(Math.max((v - range[0]) / (range[1] - range[0]), 0), 1));
  ctx.fillStyle = colours.track;
  ctx.fillRect(x, top, 7, tall);
  if (typeof pv === 'number') {
    ctx.fillStyle = colours.soft;
    ctx.fillRect(x, at(pv), 7, top + tall - at(pv));
  }
  if (typeof sp === 'number') {
    const y = at(sp);
    ctx.fillStyle = colours.ink;
    ctx.beginPath();
    ctx.moveTo(x - 1, y);
    ctx.lineTo(x - 6, y - 3.5);
    ctx.lineTo(x - 6, y + 3.5);
    ctx.fill();
    ctx.fillRect(x - 1, y - 0.75, 9, 1.5);
  }
}

function strokes(ctx, steps, width, at) {
  const {lines, bars} = strip(steps), step = 4 * width / steps.length;
  ctx.strokeStyle = colours.measured;
  ctx.lineJoin = 'round';
  ctx.lineWidth = Math.min(1.2, step / 2);
  ctx.beginPath();
  for (const [x, low, high] of bars) {
    ctx.moveTo(x * step, at(low));
    ctx.lineTo(x * step, at(high));
  }
  ctx.stroke();
  ctx.lineWidth = 1.2;
  ctx.beginPath();
  for (const line of lines) line.forEach(([x, v], i) => { if (i) ctx.lineTo(x * step, at(v)); else ctx.moveTo(x * step, at(v)); });
  ctx.stroke();
}

export function draw(canvas, spark, pv, sp, range) {
  const [ctx, width, height] = fitted(canvas), room = width - 18;
  let low = Infinity, high = -Infinity;
  for (const v of spark.steps) {
    if (v === null) continue;
    if (v < low) low = v;
    if (v > high) high = v;
  }
  if (typeof sp === 'number') { low = Math.min(low, sp); high = Math.max(high, sp); }
  const scale = scaleOf(low <= high ? [low, high] : null, range, 0.1);
  const at = (v) => 2 + (height - 4) * (1 - (v - scale[0]) / (scale[1] - scale[0]));
  if (typeof sp === 'number') {
    ctx.strokeStyle = colours.sp;
    ctx.lineWidth = 1;
    ctx.setLineDash([4, 3]);
    ctx.beginPath();
    ctx.moveTo(0, at(sp));
    ctx.lineTo(room, at(sp));
    ctx.stroke();
    ctx.setLineDash([]);
  }
  strokes(ctx, spark.steps, room, at);
  gauge(ctx, width - 8, height, pv, sp, range);
}
