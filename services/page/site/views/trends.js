// SPDX-License-Identifier: Apache-2.0
// Curves of several loops on one axis of time. What is shown stands in the address, so that it can be kept and sent.
import {MOST_CURVES, QUANTITIES, curvesIn, curvesText, joined, panesOf} from '../lib/curves.js';
import {SPANS_S, SpanChoice} from '../lib/span.js';
import {Trend, loadPlotter, swatch, zoomButton} from '../lib/trend.js';
import {askNote, fetchNotes, mayNote, showNotes} from '../lib/trend_notes.js';
import {bandsOf, lanes} from '../lib/bands.js';
import {byTag} from '../lib/order.js';
import {changeName, fill, texts} from '../texts.js';
import {duration} from '../lib/format.js';
import {el, icon, setAttribute, setText} from '../lib/dom.js';
import {field} from '../lib/dialog.js';
import {get, loopPath, query} from '../lib/api.js';
import {live} from '../lib/live.js';
import {pictureOf, save} from '../lib/picture.js';
import {priority} from '../lib/codes.js';
import {wall} from '../lib/shell.js';

const t = texts.trends;
const tt = texts.trend;
const FOLLOWS_MS = 3000, LINES_EACH_MS = 15_000;
const nameOf = (tag, quantity) => `${tag} ${texts.values[quantity]}`;
const find = (tag) => live.describe?.loops[live.places.get(tag)];

class Trends {
  constructor(main, options, scope, uPlot) {
    Object.assign(this, {scope, uPlot, curves: curvesIn(options.curves), choice: SpanChoice.of(options), histories: {}, lines: [], notes: [], asked: 0});
    this.box = el('div', {class: 'panes'});
    this.note = el('p', {class: 'soft small'});
    this.chosen = el('ul', {class: 'chosen-curves'});
    this.noted = el('div', {});
    this.files = el('span', {class: 'buttons'});
    this.spans = SPANS_S.map((s) => el('button', {type: 'button', class: 'chip-button', click: () => { this.choice.pick(s); this.load(); }}, tt.spans[s]));
    this.followButton = el('button', {type: 'button', class: 'chip-button', click: () => { this.choice.pick(this.choice.span_s); this.load(); }}, tt.now);
    main.append(el('h1', {tabindex: -1}, t.title), el('section', {class: 'panel trend'}, this.#adder(), this.chosen, this.#tools(), this.box, el('p', {class: 'unseen', id: 'trend-keys'}, tt.keys),
      el('div', {class: 'under'}, this.note, el('span', {class: 'stretch'}), this.files), this.noted));
    scope.on(live, 'theme', () => this.trend?.redraw());
    scope.atEnd(() => { this.trend?.end(); clearTimeout(this.timer); });
    this.#rebuild();
  }

  #adder() {
    const tags = live.describe.loops.map(({tag}) => tag).sort(byTag);
    const list = el('datalist', {id: 'trend-tags'}, tags.map((tag) => el('option', {value: tag})));
    const tag = el('input', {list: 'trend-tags', required: true, autocomplete: 'off'}), quantity = el('select', {}, QUANTITIES.map((one) => el('option', {value: one}, texts.values[one])));
    this.trouble = el('p', {class: 'trouble', role: 'alert', hidden: true});
    const add = (event) => {
      event.preventDefault();
      const wish = curvesIn(`${tag.value.trim()}:${quantity.value}`)[0];
      const wrong = this.curves.length >= MOST_CURVES ? t.full : !wish || !find(wish.tag) ? fill(t.noLoop, {tag: tag.value}) : '';
      this.trouble.textContent = wrong;
      this.trouble.hidden = !wrong;
      if (wrong) return;
      this.curves = curvesIn(curvesText([...this.curves, wish]));
      this.#rebuild();
    };
    return el('form', {class: 'adder', submit: add}, list, field(t.loop, tag), field(t.quantity, quantity), el('button', {type: 'submit'}, t.add), this.trouble);
  }

  #tools() {
    return el('div', {class: 'tools'}, el('div', {class: 'chips', role: 'group', 'aria-label': tt.span}, this.spans), el('span', {class: 'stretch'}),
      el('div', {class: 'chips', role: 'group', 'aria-label': t.title}, zoomButton('back', tt.earlier, () => this.trend?.move(-0.5)), zoomButton('on', tt.later, () => this.trend?.move(0.5)),
        zoomButton('closer', tt.closer, () => this.trend?.zoom(0.5)), zoomButton('wider', tt.wider, () => this.trend?.zoom(2)), this.followButton));
  }

  // Other curves: other panes.
  #rebuild() {
    this.trend?.end();
    this.box.replaceChildren();
    const panes = panesOf(this.curves, find, nameOf), high = Math.max(170, 420 / Math.max(panes.length, 1));
    this.trend = panes.length ? new Trend(this.uPlot, this.box, {panes: panes.map((pane) => ({...pane, high})), x: {clock: wall()}, keys: 'trend-keys', onSpan: (span) => this.want(span),
      limits: () => [this.#oldest() ?? 0, this.newest()]}) : null;
    if (!panes.length) this.box.append(el('p', {class: 'nothing'}, t.empty));
    const inks = new Map(panes.flatMap((pane) => pane.curves.map((curve) => [curve.name, curve])));
    this.chosen.replaceChildren(...this.curves.map((one) => {
      const name = nameOf(one.tag, one.quantity), curve = inks.get(name);
      return el('li', {}, curve ? swatch(curve.ink, curve.dash) : icon('bad'), find(one.tag) ? el('a', {href: `#/loop/${encodeURIComponent(one.tag)}`}, name) : fill(t.noLoop, {tag: one.tag}),
        el('button', {type: 'button', class: 'square', 'aria-label': fill(t.remove, {curve: name}), click: () => { this.curves = this.curves.filter((other) => other !== one); this.#rebuild(); }}, '×'));
    }));
    this.load();
  }

  get tags() { return [...new Set(this.curves.map(({tag}) => tag))].filter(find); }
  #oldest() { return Object.values(this.histories).reduce((low, {oldest_ms}) => (oldest_ms === null ? low : Math.min(low ?? oldest_ms, oldest_ms)), null); }
  newest() { return live.overview?.now_ms ?? Date.now(); }
  span() { return this.choice.span(this.newest(), this.#oldest()); }

  want(span) {
    this.choice.want(span);
    this.#draw();
    clearTimeout(this.soon);
    this.soon = setTimeout(() => this.load(), 120);
  }

  async load() {
    clearTimeout(this.timer);
    const mine = ++this.asked, span = this.span().map(Math.round), {tags} = this, points = Math.round(Math.min(4000, Math.max(800, 4 * this.box.clientWidth))), {signal} = this.scope;
    this.#keep();
    try {
      const [histories, lines, notes] = await Promise.all([
        Promise.all(tags.map((tag) => get(loopPath(tag, 'history') + query({from_ms: span[0], to_ms: span[1], points}), signal))),
        this.#alarmLines(tags), fetchNotes(tags, signal)]);
      if (mine !== this.asked) return;
      this.histories = Object.fromEntries(tags.map((tag, i) => [tag, histories[i]]));
      Object.assign(this, {lines, notes});
      this.data = joined(this.curves, this.histories);
      this.#draw();
    } catch (error) {
      if (error.name === 'AbortError') return;
      setText(this.note, fill(texts.failed, {why: error.message}));
    }
    this.#next();
  }

  #next() {
    clearTimeout(this.timer);
    if (this.choice.fixed || this.scope.over) return;
    this.timer = setTimeout(() => { if (live.stale || document.hidden) this.#next(); else this.load(); }, FOLLOWS_MS);
  }

  // Of each loop; what has changed since comes with `live.alarms`.
  async #alarmLines(tags) {
    if (this.linesOf === tags.join() && performance.now() - this.linesAt < LINES_EACH_MS) return this.lines;
    const answers = await Promise.all(tags.map((loop) => get(`/api/journal${query({loop, kind: 'alarm', most: 200})}`, this.scope.signal)));
    Object.assign(this, {linesOf: tags.join(), linesAt: performance.now()});
    return answers.map(({lines}) => lines);
  }

  // In the address, which the browser keeps: no view is opened anew.
  #keep() {
    history.replaceState(null, '', `#/trends${query({curves: curvesText(this.curves), ...this.choice.address})}`);
  }

  #bands(span) {
    const severe = live.describe.alarms?.severe_percent ?? 5;
    const bands = this.tags.flatMap((tag, i) => {
      const standing = live.alarms.filter((alarm) => alarm.loop === tag);
      return bandsOf(this.lines[i] ?? [], standing).map((band) => ({...band, label: `${tag}: ${changeName(band.alarm)}`,
        priority: priority(standing.find((alarm) => alarm.alarm === band.alarm) ?? band, severe)}));
    });
    const seen = bands.filter((band) => (band.to_ms ?? Infinity) >= span[0] && band.from_ms <= span[1]);
    lanes(seen);
    return seen;
  }

  #draw() {
    const span = this.span();
    setAttribute(this.followButton, 'aria-pressed', String(!this.choice.fixed));
    this.spans.forEach((button, k) => setAttribute(button, 'aria-pressed', String(!this.choice.fixed && SPANS_S[k] === this.choice.span_s)));
    if (!this.data || !this.trend) { setText(this.note, ''); return; }
    this.trend.show(this.data, span, this.#bands(span), this.notes);
    Object.assign(this.box.dataset, {from: Math.round(span[0]), to: Math.round(span[1]), rows: this.data.t.length});
    const parts = Object.entries(this.histories).map(([tag, {bucket_s, t: times}]) => (!times.some((at) => at >= span[0] && at <= span[1]) ? `${tag}: ${tt.empty}` : fill(bucket_s === null ? t.every : t.bucket, {tag, step: duration(bucket_s)})));
    setText(this.note, parts.join('; '));
    showNotes(this.noted, this.notes, span, true);
    this.#files(span);
  }

  #files(span) {
    const key = `${this.tags} ${mayNote()}`, now = () => this.trend?.at ?? Math.min(this.span()[1], this.newest());
    if (this.files.shown !== key) {
      this.files.shown = key;
      this.csvs = this.tags.map((tag) => el('a', {class: 'button', download: `${tag}.csv`}, fill(t.csv, {tag})));
      this.files.replaceChildren(...(mayNote() ? this.tags.map((tag) => el('button', {type: 'button', click: () => askNote(tag, now(), () => this.load())}, `${fill(texts.notes.ask, {tag})} …`)) : []), ...this.csvs,
        el('button', {type: 'button', click: () => save(pictureOf(this.box, [this.tags.join(', '), this.span().map((ms) => wall().dateTime(ms)).join(' – ')]), 'trend.png')}, tt.png),
        navigator.clipboard ? el('button', {type: 'button', click: () => navigator.clipboard.writeText(location.href)}, t.copy) : '');
    }
    this.csvs.forEach((link, i) => setAttribute(link, 'href', loopPath(this.tags[i], 'history.csv') + query({from_ms: Math.round(span[0]), to_ms: Math.round(span[1])})));
  }
}

export async function show(main, {options}, scope) {
  const waiting = el('p', {class: 'nothing'}), say = () => setText(waiting, live.stale ? texts.notKnownNow : texts.loading);
  say();
  scope.on(live, 'stale', say);
  main.append(el('h1', {tabindex: -1}, t.title), waiting);
  const uPlot = await loadPlotter();
  if (!live.describe) await new Promise((done) => { scope.on(live, 'describe', done, {once: true}); });
  if (scope.over) return;
  main.replaceChildren();
  new Trends(main, options, scope, uPlot);
}
