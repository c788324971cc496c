// SPDX-License-Identifier: Apache-2.0
// Draws curves over time with uPlot, in one or more panes with one span and one cursor.
import {actions} from './dialog.js';
import {el, icon, setText, svg} from './dom.js';
import {NONE, decimalsFor, decimalsOfStep, fixed} from './format.js';
import {extent, kept, nearest, scaleOf, timeMarks} from './history.js';

const FONT = '12px system-ui, sans-serif';
const LANE = 17, EDGE = 3; // height for alarms, pixels
let plotter = null;

// uPlot is loaded when the first curve is drawn, because the overview doesn't need it.
export function loadPlotter() {
  plotter ??= new Promise((done, failed) => {
    document.head.append(el('link', {rel: 'stylesheet', href: '/uplot/uPlot.min.css'}));
    document.head.append(el('script', {src: '/uplot/uPlot.iife.min.js', load: () => done(window.uPlot),
      error: () => { plotter = null; failed(new Error('uPlot')); }}));
  });
  return plotter;
}

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

const inkOf = (band) => colour(band.priority === 'high' ? 'high' : 'low');

// Draws a stroke in a curve's colour and dash, next to its name.
export const swatch = (ink, dash) => svg('svg', {class: `swatch stroke-${ink}`, viewBox: '0 0 22 8', 'aria-hidden': 'true'},
  svg('path', {d: 'M1 4h20', 'stroke-dasharray': dash ? dash.join(' ') : null}));

export class Trend {
  // panes: [{label, unit, range, high, curves: [{key, name, ink, dash}]}]; x: {clock} for UTC ms on a wall clock,
  // {unit} for seconds. onSpan([from, to]): the user requests another span. keys: id of the text on keys.
  constructor(uPlot, box, {panes, x, onSpan, onCursor, keys, limits = () => null, least = 1000}) {
    Object.assign(this, {uPlot, box, panes, x, onSpan, onCursor, limits, least, bands: [], notes: [], laneCount: 0, data: {t: []}, span: [0, 1], at: null});
    this.plots = panes.map((pane, i) => this.#pane(pane, i, keys));
    this.observer = new ResizeObserver(() => this.#resize());
    this.observer.observe(box);
  }

  end() {
    this.observer.disconnect();
    for (const plot of this.plots) plot.u.destroy();
  }

  #pane(pane, number, keys) {
    const heads = pane.curves.map((curve) => {
      const value = el('span', {class: 'value'});
      return {curve, value, node: el('span', {class: 'curve'}, swatch(curve.ink, curve.dash), el('span', {}, curve.name), value)};
    });
    const holder = el('div', {class: 'plot', tabindex: 0, role: 'img', 'aria-label': pane.label, 'aria-describedby': keys ?? null});
    if (keys) holder.setAttribute('role', 'application');
    const time = number === 0 ? this.time = el('span', {class: 'cursor-time'}) : null;
    this.box.append(el('div', {class: 'pane'}, el('div', {class: 'curves'}, heads.map((h) => h.node), time), holder));
    const u = new this.uPlot(this.#options(pane, number, holder), this.#columns(pane), holder);
    const plot = {pane, heads, holder, u};
    this.#listen(plot);
    return plot;
  }

  #options(pane, number, holder) {
    const axis = {stroke: () => colour('soft'), grid: {stroke: () => colour('grid'), width: 1}, ticks: {show: false}, font: FONT, gap: 5};
    return {
      width: Math.max(holder.clientWidth, 200), height: this.#height(pane, holder), padding: [() => 6 + (number === 0 ? LANE * this.laneCount : 0), 10, 0, 0], legend: {show: false},
      cursor: {sync: null, y: false, drag: {x: true, y: false, dist: 5, setScale: false}, points: {size: 6},
        bind: {dblclick: () => () => { this.onSpan?.(null); return null; }}, dataIdx: null},
      select: {show: Boolean(this.onSpan)},
      scales: {x: {time: false, range: () => this.span}, y: {range: () => this.#scale(pane)}},
      axes: [{...axis, size: 26, splits: (u) => this.#marks(u), values: (u, splits) => splits.map((at) => this.#mark(u, at))},
        {...axis, size: 52, space: 32, values: (u, splits) => splits.map((v) => fixed(v, this.#decimals(splits)))}],
      series: [{}, ...pane.curves.map((curve) => ({label: curve.name, stroke: () => colour(curve.ink), width: curve.width ?? 1.5,
        dash: curve.dash, points: {show: false}, spanGaps: false}))],
      hooks: {
        draw: [(u) => { if (number === 0) this.#lanes(u); else this.#edge(u); this.#flags(u); }],
        setCursor: [(u) => this.#follow(u)],
        setSelect: [(u) => this.#selected(u)],
      },
    };
  }

  #height(pane, holder) {
    const full = document.documentElement.clientWidth >= 700 ? pane.high ?? 240 : Math.min(pane.high ?? 240, 200);
    return holder.clientWidth > 1800 ? full * 1.5 : full;
  }
  #columns(pane) {
    const empty = Array(this.data.t.length).fill(null);
    return [this.data.t, ...pane.curves.map((curve) => this.data[curve.key] ?? empty)];
  }
  #scale(pane) {
    return scaleOf(extent(this.data, pane.curves.map((curve) => curve.key), ...this.span), pane.range);
  }
  #decimals(splits) {
    return decimalsOfStep(splits.length > 1 ? Math.abs(splits[1] - splits[0]) : 1);
  }

  // --- the axis of time ---
  #marks(u) {
    const most = Math.max(2, Math.floor(u.bbox.width / devicePixelRatio / 95)), [from, to] = this.span;
    if (!this.x.clock) {
      const rough = (to - from) / most, ten = 10 ** Math.floor(Math.log10(rough));
      const step = [1, 2, 5, 10].map((n) => n * ten).find((n) => n >= rough), marks = [];
      for (let k = Math.ceil(from / step); k * step <= to; ++k) marks.push(k * step);
      return marks;
    }
    const {step, marks} = timeMarks(from, to, most, this.x.clock.offset_ms(from));
    this.step = step;
    return marks;
  }
  // Omitted if the right edge would cut it off.
  #mark(u, at) {
    const text = this.#markText(at);
    u.ctx.font = FONT;
    return u.valToPos(at, 'x') + u.bbox.left / devicePixelRatio + u.ctx.measureText(text).width / 2 <= u.width ? text : '';
  }
  #markText(at) {
    if (!this.x.clock) return `${Number(at.toPrecision(6))} ${this.x.unit}`;
    const {clock} = this.x, time = clock.time(at);
    if (this.step >= 86_400_000 || time === '00:00:00') return clock.date(at);
    if (this.step >= 60_000) return time.slice(0, 5);
    return this.step >= 1000 ? time : clock.fine(at, this.step).slice(11);
  }

  // --- above the curves: bands have separate lanes over the first pane and a line at the edge of the others. They cover no curve ---
  #edges(u, band) {
    const {left, width} = u.bbox, at = (time) => Math.min(Math.max(u.valToPos(time, 'x', true), left), left + width);
    const [from, to] = this.span;
    const begin = at(Math.max(band.from_ms, from)), end = at(Math.min(band.to_ms ?? Infinity, to));
    return (band.to_ms ?? Infinity) < from || band.from_ms > to ? null : [begin, Math.max(end, begin + 2)];
  }
  #edge(u) {
    const {ctx, bbox} = u, high = EDGE * devicePixelRatio;
    ctx.save();
    for (const band of this.bands) {
      const edges = this.#edges(u, band);
      ctx.fillStyle = inkOf(band);
      if (edges) ctx.fillRect(edges[0], bbox.top - high, edges[1] - edges[0], high);
    }
    ctx.restore();
  }
  #lanes(u) {
    const {ctx, bbox} = u, dots = devicePixelRatio, high = (LANE - 2) * dots, first = bbox.top - (LANE * this.laneCount + 2) * dots;
    ctx.save();
    ctx.font = `600 ${11 * dots}px system-ui, sans-serif`;
    ctx.textBaseline = 'middle';
    ctx.textAlign = 'left';
    for (const band of this.bands) {
      const edges = this.#edges(u, band);
      if (!edges) continue;
      const [a, b] = edges, top = first + band.lane * LANE * dots;
      ctx.fillStyle = inkOf(band);
      ctx.fillRect(a, top, b - a, high);
      ctx.beginPath();
      ctx.rect(a, top, b - a - 2 * dots, high);
      ctx.save();
      ctx.clip();
      ctx.fillStyle = colour(band.priority === 'high' ? 'on-high' : 'on-signal');
      ctx.fillText(band.label, a + 4 * dots, top + high / 2);
      ctx.restore();
    }
    ctx.restore();
  }

  // A note is a stroke with its number at the lower end.
  #flags(u) {
    const {ctx, bbox} = u, dots = devicePixelRatio, [from, to] = this.span;
    ctx.save();
    ctx.strokeStyle = colour('accent');
    ctx.fillStyle = colour('accent');
    ctx.font = `600 ${11 * dots}px system-ui, sans-serif`;
    ctx.lineWidth = dots;
    ctx.setLineDash([2 * dots, 3 * dots]);
    for (const {at_ms, number, on_disk} of this.notes) {
      if (at_ms < from || at_ms > to) continue;
      const x = Math.round(u.valToPos(at_ms, 'x', true));
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
      ctx.fillText(on_disk === false ? `${number} …` : String(number), x + 3 * dots, bbox.top + bbox.height - 4 * dots);
    }
    ctx.restore();
  }

  // --- the cursor ---
  #follow(u) {
    if (this.following) return;
    const {left} = u.cursor;
    this.#put(left >= 0 ? nearest(this.data.t, u.posToVal(left, 'x')) : null, u);
  }
  // Row `row` is under the cursor of all panes; null: no row.
  #put(row, from = null) {
    this.following = true;
    this.at = row !== null && row >= 0 ? this.data.t[row] : null;
    for (const {u} of this.plots) {
      if (u === from) continue;
      u.setCursor(this.at === null ? {left: -10, top: -10} : {left: u.valToPos(this.at, 'x'), top: 0});
    }
    this.following = false;
    this.#read();
  }
  #read() {
    const last = this.data.t.length - 1, row = this.at === null ? last : nearest(this.data.t, this.at);
    for (const {pane, heads} of this.plots) {
      for (const {curve, value} of heads) {
        const v = row < 0 ? null : this.#near(this.data[curve.key], row), text = fixed(v, decimalsFor(pane.range));
        setText(value, text === NONE || !pane.unit ? text : `${text} ${pane.unit}`);
      }
    }
    const time = row < 0 ? null : this.data.t[row];
    const step = row > 0 ? this.data.t[row] - this.data.t[row - 1] : 1000;
    setText(this.time, time === null ? '' : this.x.clock ? this.x.clock.fine(time, step) : `${Number(time.toFixed(3))} ${this.x.unit}`);
    this.onCursor?.(this.at === null ? null : row);
  }
  // Announces the values at a cursor that was moved by keys, for screen readers.
  #tell() {
    const values = this.plots.flatMap(({heads}) => heads.map(({curve, value}) => `${curve.name} ${value.textContent}`));
    actions.say([this.time.textContent, ...values].join(', '));
  }
  // A decimated row may lack a column that its neighbour has. If loops share the axis, most rows are another loop's.
  #near(column, row) {
    let at = row;
    while (at > 0 && column?.[at] === undefined) --at;
    return column?.[at] ?? column?.[at - 1] ?? null;
  }

  // --- user actions ---
  #selected(u) {
    const {left, width} = u.select;
    if (width < 5) return;
    const wish = [u.posToVal(left, 'x'), u.posToVal(left + width, 'x')], limits = this.limits();
    // The part of the selection outside the record is cut off, so that the rest keeps its limits.
    if (limits && wish[0] < limits[1] && wish[1] > limits[0]) {
      wish[0] = Math.max(wish[0], limits[0]);
      wish[1] = Math.min(wish[1], limits[1]);
    }
    u.setSelect({left: 0, width: 0, top: 0, height: 0}, false);
    this.want(wish);
  }
  want(span) {
    if (!this.onSpan) return;
    const limits = this.limits();
    this.onSpan(limits ? kept(span, limits, this.least) : span);
  }
  zoom(factor, at = (this.span[0] + this.span[1]) / 2) {
    this.want([at - (at - this.span[0]) * factor, at + (this.span[1] - at) * factor]);
  }
  move(share) {
    const step = (this.span[1] - this.span[0]) * share;
    this.want([this.span[0] + step, this.span[1] + step]);
  }
  #listen({holder, u}) {
    holder.addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const act = this.#keyOf(event);
      if (!act) return;
      event.preventDefault();
      act();
    });
    if (!this.onSpan) return;
    u.over.addEventListener('wheel', (event) => {
      if (!event.ctrlKey && !event.metaKey && document.activeElement !== holder) return;
      event.preventDefault();
      this.zoom(event.deltaY > 0 ? 1.25 : 0.8, u.posToVal(event.clientX - u.over.getBoundingClientRect().left, 'x'));
    }, {passive: false});
    u.over.addEventListener('mousedown', () => holder.focus({preventScroll: true}));
    this.#fingers(u.over);
  }
  #keyOf(event) {
    const last = this.data.t.length - 1, row = this.at === null ? last : nearest(this.data.t, this.at);
    const inside = this.data.t.length / Math.max(1, this.plots[0].u.bbox.width) * 4;
    const to = (n) => () => {
      this.#put(Math.min(Math.max(n, 0), last));
      this.#tell();
    };
    const by = (n) => to(row + n * Math.max(1, Math.round(inside)));
    if (event.key === 'ArrowLeft') return event.shiftKey ? () => this.move(-0.25) : by(-1);
    if (event.key === 'ArrowRight') return event.shiftKey ? () => this.move(0.25) : by(1);
    return {Home: to(0), End: to(last), Escape: () => this.#put(null), '+': () => this.zoom(0.5), '=': () => this.zoom(0.5),
      '-': () => this.zoom(2), 0: () => this.onSpan?.('all')}[event.key];
  }
  // One finger moves the span and two zoom it. Vertical movement scrolls the page.
  #fingers(over) {
    const down = new Map();
    let begin = null;
    const restart = () => { begin = {span: [...this.span], points: [...down.values()].map((p) => ({...p}))}; };
    const lift = (event) => { if (down.delete(event.pointerId) && down.size) restart(); };
    over.addEventListener('pointerdown', (event) => {
      if (event.pointerType !== 'touch') return;
      down.set(event.pointerId, {x: event.clientX});
      restart();
    });
    over.addEventListener('pointermove', (event) => {
      if (!down.has(event.pointerId)) return;
      down.get(event.pointerId).x = event.clientX;
      const now = [...down.values()], then = begin.points, [from, to] = begin.span;
      const per = (to - from) / over.clientWidth, edge = over.getBoundingClientRect().left;
      if (now.length === 1) {
        const by = (then[0].x - now[0].x) * per;
        if (Math.abs(by) > 4 * per) this.want([from + by, to + by]);
        return;
      }
      const apart = Math.max(20, Math.abs(then[0].x - then[1].x)), apartNow = Math.max(20, Math.abs(now[0].x - now[1].x));
      const width = (to - from) * apart / apartNow, middle = from + ((then[0].x + then[1].x) / 2 - edge) * per;
      const share = ((now[0].x + now[1].x) / 2 - edge) / over.clientWidth;
      this.want([middle - width * share, middle + width * (1 - share)]);
    });
    for (const type of ['pointerup', 'pointercancel', 'pointerleave']) over.addEventListener(type, lift);
  }

  // --- display ---
  show(data, span, bands = this.bands, notes = this.notes) {
    Object.assign(this, {data, span, bands, notes});
    this.laneCount = bands.reduce((most, band) => Math.max(most, band.lane + 1), 0);
    for (const {u, pane} of this.plots) {
      u.batch(() => {
        u.setData(this.#columns(pane), false);
        u.setScale('x', {min: span[0], max: span[1]});
      });
      u.redraw(true, true);
    }
    if (this.at !== null) this.#put(nearest(this.data.t, this.at));
    else this.#read();
  }
  redraw() {
    for (const {u} of this.plots) u.redraw(false, true);
  }
  #resize() {
    for (const {u, pane, holder} of this.plots) {
      const width = holder.clientWidth;
      if (width > 0 && (width !== u.width || this.#height(pane, holder) !== u.height)) u.setSize({width, height: this.#height(pane, holder)});
    }
  }
}

export const zoomButton = (name, label, act) => el('button', {class: 'square', type: 'button', 'aria-label': label, title: label, click: act}, icon(name));
