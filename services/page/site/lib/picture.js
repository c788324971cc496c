// SPDX-License-Identifier: Apache-2.0
// Saves a trend as a PNG: its panes as drawn, with title, span and the names of the curves.

const LINE = 18, EDGE = 12;
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// `box` holds the panes of a Trend; `lines`: texts above them.
export function pictureOf(box, lines) {
  const dots = devicePixelRatio || 1, panes = [...box.querySelectorAll('.pane')].map((pane) => ({canvas: pane.querySelector('canvas'), curves: [...pane.querySelectorAll('.curve')]}));
  const width = Math.max(...panes.map(({canvas}) => canvas.width)) / dots + 2 * EDGE;
  const height = LINE * (lines.length + panes.length) + panes.reduce((sum, {canvas}) => sum + canvas.height / dots, 0) + 3 * EDGE;
  const picture = document.createElement('canvas');
  Object.assign(picture, {width: Math.round(width * dots), height: Math.round(height * dots)});
  const ctx = picture.getContext('2d');
  ctx.scale(dots, dots);
  ctx.fillStyle = colour('panel');
  ctx.fillRect(0, 0, width, height);
  ctx.textBaseline = 'top';
  let y = EDGE;
  lines.forEach((line, i) => {
    ctx.font = `${i ? 400 : 650} 13px system-ui, sans-serif`;
    ctx.fillStyle = colour(i ? 'soft' : 'ink');
    ctx.fillText(line, EDGE, y);
    y += LINE;
  });
  for (const {canvas, curves} of panes) {
    legend(ctx, curves, y + EDGE / 2);
    y += LINE;
    ctx.drawImage(canvas, EDGE, y + EDGE / 2, canvas.width / dots, canvas.height / dots);
    y += canvas.height / dots;
  }
  return picture;
}

function legend(ctx, curves, y) {
  ctx.font = '13px system-ui, sans-serif';
  let x = EDGE;
  for (const curve of curves) {
    const stroke = curve.querySelector('.swatch'), path = stroke.querySelector('path');
    ctx.strokeStyle = getComputedStyle(stroke).stroke;
    ctx.lineWidth = 2;
    ctx.setLineDash((path.getAttribute('stroke-dasharray') ?? '').split(' ').filter(Boolean).map(Number));
    ctx.beginPath();
    ctx.moveTo(x, y + 8);
    ctx.lineTo(x + 22, y + 8);
    ctx.stroke();
    ctx.setLineDash([]);
    ctx.fillStyle = colour('ink');
    const text = [...curve.querySelectorAll('span')].map((one) => one.textContent).join(' ');
    ctx.fillText(text, x + 28, y);
    x += 44 + ctx.measureText(text).width;
  }
}

export function save(picture, name) {
  picture.toBlob((blob) => {
    const href = URL.createObjectURL(blob), link = Object.assign(document.createElement('a'), {href, download: name});
    link.click();
    setTimeout(() => URL.revokeObjectURL(href), 10_000);
  }, 'image/png');
}
