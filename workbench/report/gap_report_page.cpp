// SPDX-License-Identifier: Apache-2.0
#include "workbench/report/gap_report_page.hpp"

namespace loopwarden::workbench {

const char* const kReportStyle = R"css(
:root {
  color-scheme: light dark;
  --paper: #ffffff; --panel: #f6f7f8; --ink: #1b1f24; --soft: #5b6570; --line: #d5dae0; --grid: #e7eaee;
  --measured: #1b1f24; --before: #d55e00; --after: #0072b2; --sp: #7a828c;
  --shade: #e69f00; --held: #5b6570; --good: #00724f; --bad: #b23a00; --open: #7a5b00;
  --removed: #fbe9df; --added: #e0f0fa;
}
@media (prefers-color-scheme: dark) {
  :root {
    --paper: #14171b; --panel: #1c2026; --ink: #e6e9ec; --soft: #9aa5b1; --line: #363d46; --grid: #272d34;
    --measured: #e6e9ec; --before: #ff8f45; --after: #58b4f0; --sp: #89939e;
    --shade: #e69f00; --held: #9aa5b1; --good: #3cc79a; --bad: #ff8f5c; --open: #e0b84a;
    --removed: #43261a; --added: #12344a;
  }
}
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", "DejaVu Sans", sans-serif; }
main { max-width: 1080px; margin: 0 auto; padding: 2rem 1.25rem 4rem; }
header .kind { color: var(--soft); font-size: .875rem; margin: 0 0 .5rem; overflow-wrap: anywhere; }
h1 { font-size: 1.625rem; line-height: 1.3; font-weight: 600; margin: 0 0 1rem; max-width: 60ch;
  text-wrap: balance; overflow-wrap: anywhere; }
h2 { font-size: 1.1875rem; margin: 2.75rem 0 .5rem; padding-top: .75rem; border-top: 1px solid var(--line); }
h3 { font-size: 1rem; margin: 1.25rem 0 .25rem; }
p { margin: .375rem 0; max-width: 78ch; }
.note { color: var(--soft); font-size: .875rem; }
.verdict { display: inline-block; font-size: .8125rem; font-weight: 600; padding: .125rem .625rem; margin: 0 0 .5rem;
  border: 1.5px solid currentColor; border-radius: 1rem; }
.missing_effect { color: var(--bad); } .no_gap { color: var(--good); } .unexplained { color: var(--open); }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: .75rem; margin: 1rem 0; }
.tile { background: var(--panel); border-radius: 8px; padding: .75rem .875rem; }
.tile dt { font-size: .8125rem; color: var(--soft); }
.tile dd { margin: 0; }
.tile b { display: block; font-size: 1.375rem; font-weight: 600; font-variant-numeric: tabular-nums; }
.tile span { font-size: .8125rem; color: var(--soft); }
.effect, .refusal { border: 1px solid var(--line); border-left: 4px solid var(--after); border-radius: 6px;
  padding: .75rem 1rem; margin: .75rem 0; }
.refusal { border-left-color: var(--bad); }
.effect h3 { margin: 0; }
table { border-collapse: collapse; width: 100%; font-size: .875rem; margin: .5rem 0; }
th, td { text-align: left; padding: .3125rem .75rem .3125rem 0; border-bottom: 1px solid var(--grid); vertical-align: top;
  overflow-wrap: break-word; }
th { color: var(--soft); font-weight: 500; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; white-space: nowrap; overflow-wrap: normal; }
td.n + td:not(.n), th.n + th:not(.n) { padding-left: .75rem; }
td.b { width: 30%; min-width: 110px; }
.tried td.b { width: 14%; min-width: 80px; } .tried td:last-child { width: 34%; }
table.shares { table-layout: fixed; min-width: 560px; } .shares th:nth-child(1) { width: 38%; }
.shares th:nth-child(3) { width: 4rem; } .shares th:nth-child(4) { width: 24%; }
caption { text-align: left; color: var(--soft); padding-bottom: .25rem; }
.wide { overflow-x: auto; }
svg.bar { display: block; width: 100%; height: .875rem; margin-top: .25rem; }
svg.bar .rest { fill: var(--grid); } svg.bar .v { fill: var(--after); } svg.bar .w { fill: var(--before); }
svg.bar .floor { stroke: var(--ink); stroke-width: 2; vector-effect: non-scaling-stroke; }
code, pre { font-family: ui-monospace, "SF Mono", "Cascadia Mono", "DejaVu Sans Mono", monospace; font-size: .8125rem; }
pre { background: var(--panel); border-radius: 6px; padding: .75rem 1rem; overflow-x: auto; margin: .5rem 0; line-height: 1.45; }
pre.diff { padding: .75rem 0; }
pre.diff span { display: block; padding: 0 1rem; min-height: 1.45em; }
pre.diff .removed { background: var(--removed); } pre.diff .added { background: var(--added); }
pre.diff .cut { color: var(--soft); }
figure { margin: 1.25rem 0 0; }
figcaption { font-size: .875rem; color: var(--soft); }
figcaption b { color: var(--ink); font-size: .9375rem; }
svg.plot { display: block; width: 100%; height: auto; touch-action: pan-y; }
#plots.live svg.time { cursor: crosshair; } #plots.zoomed svg.time { cursor: grab; }
svg.plot text { fill: var(--soft); font-size: 12.5px; font-family: inherit; font-variant-numeric: tabular-nums; }
svg.plot text.axis { fill: var(--ink); }
svg.plot .grid line { stroke: var(--grid); } svg.plot .frame { fill: none; stroke: var(--line); }
svg.plot path { fill: none; vector-effect: non-scaling-stroke; stroke-width: 1.4; stroke-linejoin: round; }
svg.plot line.zero { stroke: var(--line); vector-effect: non-scaling-stroke; }
svg.plot line.floor { stroke: var(--soft); stroke-dasharray: 2 4; vector-effect: non-scaling-stroke; }
svg.plot line.cursor { stroke: var(--soft); vector-effect: non-scaling-stroke; }
.measured { stroke: var(--measured); } .before { stroke: var(--before); } .after { stroke: var(--after); }
.sp { stroke: var(--sp); stroke-dasharray: 6 4; } svg.plot path.before { stroke-dasharray: 7 3; }
svg.phase path { stroke-width: 1; stroke-opacity: .75; }
rect.located { fill: var(--shade); } rect.held { fill: var(--held); fill-opacity: .1; }
rect.chosen { fill: var(--after); fill-opacity: .15; }
.hidden { display: none; }
.legend { display: flex; flex-wrap: wrap; gap: .25rem 1rem; list-style: none; padding: 0; margin: .375rem 0 .125rem 0; }
.legend button, .legend span.key { font: inherit; font-size: .8125rem; color: var(--ink); background: none; border: 0; padding: 0;
  display: inline-flex; align-items: center; gap: .375rem; }
.live .legend button { cursor: pointer; }
.legend button[aria-pressed="false"] { opacity: .4; text-decoration: line-through; }
.legend svg { width: 28px; height: 12px; } .legend line { stroke-width: 2; } .legend line.before { stroke-dasharray: 7 3; }
.legend output { min-width: 4.5em; font-variant-numeric: tabular-nums; font-weight: 600; }
.tools { display: none; }
.live .tools { display: flex; flex-wrap: wrap; gap: .375rem; align-items: center; position: sticky; top: 0; z-index: 1;
  background: var(--paper); padding: .5rem 0; border-bottom: 1px solid var(--line); font-size: .8125rem; }
.tools button { font: inherit; color: var(--ink); background: var(--panel); border: 1px solid var(--line); border-radius: 6px;
  padding: .1875rem .625rem; cursor: pointer; }
.tools output { margin-left: auto; font-variant-numeric: tabular-nums; color: var(--soft); }
:focus-visible { outline: 2px solid var(--after); outline-offset: 2px; }
a { color: var(--after); }
details { font-size: .875rem; margin: .375rem 0; } summary { cursor: pointer; color: var(--soft); }
.pair { display: grid; grid-template-columns: minmax(0, 1fr) minmax(0, 1fr); gap: 0 2rem; align-items: start; }
@media screen and (max-width: 760px) { .pair { grid-template-columns: minmax(0, 1fr); } h1 { font-size: 1.3125rem; }
  svg.plot.time text { font-size: 18px; } }
footer { margin-top: 3rem; padding-top: .75rem; border-top: 1px solid var(--line); color: var(--soft); font-size: .8125rem; }
@media print {
  :root { color-scheme: light;
    --paper: #ffffff; --panel: #f6f7f8; --ink: #000000; --soft: #4a525b; --line: #b8bec5; --grid: #e3e6ea;
    --measured: #000000; --before: #d55e00; --after: #0072b2; --sp: #6b737c; --shade: #e69f00; --held: #5b6570;
    --good: #00724f; --bad: #b23a00; --open: #7a5b00; --removed: #fbe9df; --added: #e0f0fa; }
  * { -webkit-print-color-adjust: exact; print-color-adjust: exact; }
  @page { size: A4; margin: 14mm; }
  body { font-size: 10.5pt; } main { max-width: none; padding: 0; }
  .live .tools, details { display: none; } .legend output { display: none; }
  figure, .tile, .effect, tr { break-inside: avoid; } h2, h3, figcaption { break-after: avoid; }
  pre { white-space: pre-wrap; }
}
)css";

const char* const kReportScript = R"js(
'use strict';
(() => {
  const box = document.getElementById('plots');
  if (!box) return;
  box.classList.add('live');
  const HEIGHT = 10000, count = +box.dataset.n, t0 = +box.dataset.t0, period = +box.dataset.period;
  const last = count - 1, least = Math.min(last, 8);
  let from = 0, to = last;
  const seconds = (k) => t0 + k * period;
  const sample = (s) => (s - t0) / period;

  const points = (path) => {
    const list = [];
    for (const piece of path.getAttribute('d').split('M').slice(1)) {
      const [start, steps = ''] = piece.split('l');
      let [x, y] = start.match(/-?\d+/g).map(Number);
      list.push({x, y, starts: true});
      const n = (steps.match(/-?\d+/g) || []).map(Number);
      for (let i = 0; i + 1 < n.length; i += 2) list.push({x: x += n[i], y: y += n[i + 1]});
    }
    return list;
  };
  const ticks = (low, high, about) => {
    const raw = (high - low) / about, decade = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((f) => f * decade).find((s) => s >= raw * (1 - 1e-9)) || raw;
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
    const list = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; ++i) {
      list.push([i * step, (i * step + 0).toFixed(digits)]);
    }
    return list;
  };
  const make = (parent, name, attributes, text) => {
    const e = document.createElementNS(parent.namespaceURI, name);
    for (const key in attributes) e.setAttribute(key, attributes[key]);
    if (text !== undefined) e.textContent = text;
    return parent.appendChild(e);
  };
  const shown = (v) => (Number.isFinite(v) ? String(+v.toPrecision(4)) : '-');

  // An outer picture with axes and an inner one, whose viewBox is the span that is shown.
  const picture = (svg) => {
    const inner = svg.querySelector('svg'), number = (a) => +inner.getAttribute(a);
    const title = svg.querySelector('title');
    if (title) {  // a tooltip would hide what the cursor points at
      svg.setAttribute('aria-label', title.textContent);
      svg.removeAttribute('aria-labelledby');
      title.remove();
    }
    return {svg, inner, left: number('x'), top: number('y'), width: number('width'), height: number('height'),
            across: svg.querySelector('.across'), up: svg.querySelector('.up'),
            high: +svg.dataset.high, perUnit: HEIGHT / (svg.dataset.high - svg.dataset.low)};
  };
  const drawUp = (p, top, bottom) => {
    p.up.replaceChildren();
    for (const [value, text] of ticks(p.high - bottom / p.perUnit, p.high - top / p.perUnit, p.height / 38)) {
      const y = p.top + ((p.high - value) * p.perUnit - top) / (bottom - top) * p.height;
      make(p.up, 'line', {x1: p.left, x2: p.left + p.width, y1: y, y2: y});
      make(p.up, 'text', {x: p.left - 6, y: y + 4, 'text-anchor': 'end'}, text);
    }
  };
  const drawAcross = (p, low, high, about) => {
    p.across.replaceChildren();
    for (const [value, text] of ticks(low, high, about)) {
      const x = p.left + (value - low) / (high - low) * p.width;
      make(p.across, 'line', {x1: x, x2: x, y1: p.top, y2: p.top + p.height});
      make(p.across, 'text', {x, y: p.top + p.height + 16, 'text-anchor': 'middle'}, text);
    }
  };
  const fit = (low, high) => {
    const more = Math.max((high - low) * .06, 2);
    return low > high ? [0, HEIGHT] : [low - more, high + more];
  };

  const plots = [...box.querySelectorAll('svg.time')].map((svg) => {
    const p = picture(svg);
    p.marks = [...svg.querySelectorAll('text.mark')];
    p.curves = [...p.inner.querySelectorAll('path')].map((path) => ({path, list: points(path)}));
    p.cursor = make(p.inner, 'line', {class: 'cursor hidden', y1: -1e6, y2: 1e6});
    for (const button of svg.closest('figure').querySelectorAll('.legend button')) {
      const curve = p.curves.find((c) => c.path.dataset.curve === button.dataset.curve);
      if (!curve) continue;
      curve.output = button.querySelector('output');
      button.addEventListener('click', () => {
        const off = curve.path.classList.toggle('hidden');
        button.setAttribute('aria-pressed', String(!off));
        draw();
      });
    }
    return p;
  });
  const phases = [...document.querySelectorAll('svg.phase')].map((svg) => {
    const p = picture(svg);
    p.lowX = +svg.dataset.lowx;
    p.perUnitX = HEIGHT / (svg.dataset.highx - svg.dataset.lowx);
    p.curves = [...p.inner.querySelectorAll('path')].map((path) => {
      const list = points(path), first = path.dataset.first.split(' ').map(Number), stride = +path.dataset.stride;
      let piece = -1, k = 0;
      for (const q of list) {
        k = q.starts ? first[++piece] : k + stride;
        q.k = k;
      }
      return {path, list};
    });
    return p;
  });

  const drawTime = (p) => {
    let low = Infinity, high = -Infinity;
    for (const c of p.curves) {
      if (c.path.classList.contains('hidden')) continue;
      c.list.forEach((q, i) => {
        const next = c.list[i + 1];
        const crosses = next && !next.starts && q.x < from && next.x > to;
        if ((q.x < from || q.x > to) && !crosses) return;
        low = Math.min(low, q.y);
        high = Math.max(high, q.y);
      });
    }
    const [top, bottom] = from > 0 || to < last ? fit(low, high) : [0, HEIGHT];
    p.inner.setAttribute('viewBox', `${from} ${top} ${to - from} ${bottom - top}`);
    drawUp(p, top, bottom);
    drawAcross(p, seconds(from), seconds(to), p.width / 90);
    for (const mark of p.marks) {
      const x = p.left + (mark.dataset.k - from) / (to - from) * p.width;
      mark.setAttribute('x', Math.max(x, p.left) + 5);
      mark.classList.toggle('hidden', x > p.left + p.width - 20);
    }
  };
  const drawPhase = (p) => {
    let box4 = [Infinity, -Infinity, Infinity, -Infinity];
    for (const c of p.curves) {
      let d = '', pen = false;
      for (const q of c.list) {
        if (q.k < from || q.k > to) { pen = false; continue; }
        d += `${pen && !q.starts ? 'L' : 'M'}${q.x} ${q.y}`;
        pen = true;
        box4 = [Math.min(box4[0], q.x), Math.max(box4[1], q.x), Math.min(box4[2], q.y), Math.max(box4[3], q.y)];
      }
      c.path.setAttribute('d', d);
    }
    const all = from <= 0 && to >= last;
    const [left, right] = all ? [0, HEIGHT] : fit(box4[0], box4[1]);
    const [top, bottom] = all ? [0, HEIGHT] : fit(box4[2], box4[3]);
    p.inner.setAttribute('viewBox', `${left} ${top} ${right - left} ${bottom - top}`);
    drawUp(p, top, bottom);
    drawAcross(p, p.lowX + left / p.perUnitX, p.lowX + right / p.perUnitX, p.width / 80);
  };
  const span = document.getElementById('span');
  let queued = false;
  const draw = () => {
    if (queued) return;
    queued = true;
    requestAnimationFrame(() => {
      queued = false;
      plots.forEach(drawTime);
      phases.forEach(drawPhase);
      box.classList.toggle('zoomed', from > 0 || to < last);
      span.textContent = `${shown(seconds(from))} to ${shown(seconds(to))} s`;
    });
  };
  const show = (a, b) => {
    const width = Math.min(last, Math.max(least, b - a));
    from = Math.max(0, Math.min(last - width, (a + b - width) / 2));
    to = from + width;
    draw();
  };
  const zoom = (factor, at = (from + to) / 2) => show(at - (at - from) * factor, at + (to - at) * factor);
  const move = (part) => {
    const step = (to - from) * part;
    show(from + step, to + step);
  };

  const place = (p, event) => {
    const r = p.svg.getBoundingClientRect(), wide = p.svg.viewBox.baseVal.width;
    return from + ((event.clientX - r.left) / r.width * wide - p.left) / p.width * (to - from);
  };
  const read = (k) => {
    for (const p of plots) {
      p.cursor.setAttribute('x1', k);
      p.cursor.setAttribute('x2', k);
      p.cursor.classList.toggle('hidden', k < 0 || k > last);
      for (const c of p.curves) {
        if (!c.output) continue;
        let a = 0, b = c.list.length;
        while (a < b) {
          const m = (a + b) >> 1;
          if (c.list[m].x <= k) a = m + 1; else b = m;
        }
        const q = c.list[a - 1], next = c.list[a];
        let y = NaN;
        if (q && next && !next.starts) y = q.y + (next.y - q.y) * (k - q.x) / (next.x - q.x);
        else if (q && k - q.x < 1) y = q.y;
        c.output.textContent = shown(p.high - y / p.perUnit);
      }
    }
    const at = document.getElementById('at');
    at.textContent = k < 0 || k > last ? '' : `at ${shown(seconds(k))} s`;
  };
  for (const p of plots) {
    let drag = null, rubber = null;
    p.svg.addEventListener('wheel', (event) => {
      if (!event.ctrlKey && !event.metaKey && !p.svg.closest('figure').contains(document.activeElement)) return;
      event.preventDefault();
      zoom(event.deltaY > 0 ? 1.25 : .8, place(p, event));
    }, {passive: false});
    p.svg.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      p.svg.setPointerCapture(event.pointerId);
      const whole = from <= 0 && to >= last;
      drag = {at: place(p, event), from, to, selects: whole || event.shiftKey};
      if (drag.selects) rubber = make(p.inner, 'rect', {class: 'chosen', x: drag.at, y: -1e6, width: 0, height: 2e6});
    });
    p.svg.addEventListener('pointermove', (event) => {
      const k = place(p, event);
      if (!drag) return read(Math.min(last, Math.max(0, k)));
      if (drag.selects) {
        rubber.setAttribute('x', Math.min(k, drag.at));
        rubber.setAttribute('width', Math.abs(k - drag.at));
      } else {
        show(from + drag.at - k, to + drag.at - k);
      }
    });
    const end = (event) => {
      if (rubber) rubber.remove();
      if (drag && drag.selects && event.type === 'pointerup') {
        const k = place(p, event);
        if (Math.abs(k - drag.at) > (to - from) / 100) show(Math.min(k, drag.at), Math.max(k, drag.at));
      }
      drag = rubber = null;
    };
    p.svg.addEventListener('pointerup', end);
    p.svg.addEventListener('pointercancel', end);
    p.svg.addEventListener('pointerleave', () => { if (!drag) read(-1); });
    p.svg.addEventListener('dblclick', () => show(0, last));
    p.svg.addEventListener('keydown', (event) => {
      const act = {'+': () => zoom(.7), '=': () => zoom(.7), '-': () => zoom(1.43), '0': () => show(0, last),
                   ArrowLeft: () => move(-.2), ArrowRight: () => move(.2)}[event.key];
      if (!act || event.ctrlKey || event.metaKey) return;
      event.preventDefault();
      act();
    });
    p.svg.tabIndex = 0;
  }
  const acts = {closer: () => zoom(.6), wider: () => zoom(1 / .6), left: () => move(-.4), right: () => move(.4),
                all: () => show(0, last)};
  box.querySelector('.tools').addEventListener('click', (event) => {
    const button = event.target.closest('button');
    if (!button) return;
    if (button.dataset.from) show(sample(+button.dataset.from), sample(+button.dataset.to));
    else acts[button.dataset.act]();
  });
  for (const link of document.querySelectorAll('a[data-from]')) {
    link.addEventListener('click', () => {
      const a = sample(+link.dataset.from), b = sample(+link.dataset.to), room = Math.max((b - a) * .25, 20);
      show(a - room, b + room);
    });
  }
  draw();
})();
)js";

}  // namespace loopwarden::workbench
