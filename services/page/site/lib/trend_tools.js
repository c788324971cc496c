// SPDX-License-Identifier: Apache-2.0
// Shared part of the trends of one loop and of several: span and its buttons, following the newest time, alarms as bands, notes,
// links to other views.
import {SPANS_S, SpanChoice} from './span.js';
import {Trend, zoomButton} from './trend.js';
import {askNote, fetchNotes, mayNote, showNotes} from './trend_notes.js';
import {bandsIn} from './bands.js';
import {duration} from './format.js';
import {el, setAttribute, setText} from './dom.js';
import {get, loopPath, query} from './api.js';
import {live} from './live.js';
import {pictureOf, save} from './picture.js';
import {wall} from './shell.js';
import {changeName, fill, texts} from '../texts.js';

const tt = texts.trend;
const DRAWN_MS = 120, LINES_EACH_MS = 15_000, MOST_LINES = 200;

// Derived classes have `tags` of the loops on it, rows(), and draw further content in drawn(span).
export class FollowingTrend {
  histories = {}; // by tag, as the server sent them
  lines = new Map(); // the journal's lines on alarms, by tag
  notes = [];
  trend = null;
  #asked = 0;

  // options: from the address; label: of the buttons that move the span.
  constructor(scope, uPlot, options, label) {
    Object.assign(this, {scope, uPlot, choice: SpanChoice.of(options)});
    this.box = el('div', {class: 'panes'});
    this.note = el('p', {class: 'soft small'});
    this.noted = el('div', {});
    this.spans = SPANS_S.map((s) => el('button', {type: 'button', class: 'chip-button', click: () => this.#pick(s)}, tt.spans[s]));
    this.followButton = el('button', {type: 'button', class: 'chip-button', click: () => this.#pick(this.choice.span_s)}, tt.now);
    this.tools = el('div', {class: 'tools'}, el('div', {class: 'chips', role: 'group', 'aria-label': tt.span}, this.spans), el('span', {class: 'stretch'}),
      el('div', {class: 'chips', role: 'group', 'aria-label': label}, zoomButton('back', tt.earlier, () => this.trend?.move(-0.5)), zoomButton('on', tt.later, () => this.trend?.move(0.5)),
        zoomButton('closer', tt.closer, () => this.trend?.zoom(0.5)), zoomButton('wider', tt.wider, () => this.trend?.zoom(2)), this.followButton));
    this.keys = el('p', {class: 'unseen', id: 'trend-keys'}, tt.keys);
    scope.on(live, 'theme', () => this.trend?.redraw());
    scope.atEnd(() => {
      this.trend?.end();
      clearTimeout(this.timer);
      clearTimeout(this.soon);
    });
  }

  // Other curves need other panes. `least`: shortest span to zoom into, ms.
  curves(panes, least) {
    this.trend?.end();
    this.box.replaceChildren();
    this.trend = panes.length ? new Trend(this.uPlot, this.box, {panes, least, x: {clock: wall()}, keys: this.keys.id, onSpan: (span) => this.want(span),
      limits: () => (this.#oldest() === null ? null : [this.#oldest(), this.newest()])}) : null;
  }

  #oldest() { return Object.values(this.histories).reduce((low, {oldest_ms}) => (oldest_ms === null ? low : Math.min(low ?? oldest_ms, oldest_ms)), null); }
  // The newest time that the box reported.
  newest() {
    const told = Math.max(...Object.values(this.histories).map(({newest_ms}) => newest_ms ?? 0), 0) || live.overview?.now_ms || Date.now();
    return live.stale || !live.overview ? told : Math.max(told, live.overview.now_ms);
  }
  span() { return this.choice.span(this.newest(), this.#oldest()); }

  #pick(seconds) {
    this.choice.pick(seconds);
    this.load();
  }
  want(span) {
    this.choice.want(span);
    if (!this.choice.fixed) { this.load(); return; }
    this.draw();
    clearTimeout(this.soon);
    this.soon = setTimeout(() => this.load(), DRAWN_MS);
  }

  history(tag, from_ms, to_ms, points) { return get(loopPath(tag, 'history') + query({from_ms: Math.round(from_ms), to_ms: Math.round(to_ms), points}), this.scope.signal); }

  // Counts the requests: an answer to an outdated request is dropped.
  get asked() { return this.#asked; }

  async load() {
    clearTimeout(this.timer);
    const mine = ++this.#asked, [from, to] = this.span(), {tags} = this, points = Math.round(Math.min(4000, Math.max(800, 4 * this.box.clientWidth)));
    try {
      const [histories, lines, notes] = await Promise.all([Promise.all(tags.map((tag) => this.history(tag, from, to, points))),
        this.#alarmLines(tags), fetchNotes(tags, this.scope.signal).catch(() => this.notes)]);
      if (mine !== this.#asked) return;
      this.histories = Object.fromEntries(tags.map((tag, i) => [tag, histories[i]]));
      Object.assign(this, {lines, notes});
      this.draw();
    } catch (error) {
      if (error.name === 'AbortError') return;
      setText(this.note, fill(texts.failed, {why: error.message}));
    }
    this.follow();
  }

  // While it follows, it loads again when a bucket is full.
  follow(pause = this.#pause(), act = () => this.load()) {
    clearTimeout(this.timer);
    if (this.scope.over || this.choice.fixed) return;
    this.timer = setTimeout(() => { if (live.stale || document.hidden) this.follow(pause, act); else act(); }, pause);
  }
  #pause() { return Math.min(30_000, Math.max(3000, ...Object.values(this.histories).map(({bucket_s}) => 1000 * (bucket_s ?? 0)))); }

  // Reads the alarm lines of each loop; later changes arrive with `live.alarms`.
  async #alarmLines(tags) {
    if (this.linesOf === tags.join() && performance.now() - this.linesAt < LINES_EACH_MS) return this.lines;
    const answers = await Promise.all(tags.map((loop) => get(`/api/journal${query({loop, kind: 'alarm', most: MOST_LINES})}`, this.scope.signal).catch(() => null)));
    if (answers.every(Boolean)) Object.assign(this, {linesOf: tags.join(), linesAt: performance.now()});
    return new Map(tags.map((tag, i) => [tag, answers[i]?.lines ?? this.lines.get(tag) ?? []]));
  }

  nameOf(_tag, alarm) { return changeName(alarm); }

  draw() {
    const span = this.span(), from = Math.round(span[0]), to = Math.round(span[1]);
    setAttribute(this.followButton, 'aria-pressed', String(!this.choice.fixed));
    this.spans.forEach((button, k) => setAttribute(button, 'aria-pressed', String(!this.choice.fixed && SPANS_S[k] === this.choice.span_s)));
    const rows = this.rows();
    if (!rows || !this.trend) { setText(this.note, ''); return; }
    this.trend.show(rows, span, bandsIn(this.tags, this.lines, live.alarms, span, live.severe_percent, (tag, alarm) => this.nameOf(tag, alarm)), this.notes);
    Object.assign(this.box.dataset, {from, to, rows: rows.t.length});
    showNotes(this.noted, this.notes, span, this.tags.length > 1);
    this.drawn(span);
  }

  // Returns how a loop's curve is drawn in the span.
  said({t, bucket_s}, [from, to]) {
    if (!t.some((at) => at >= from && at <= to)) return tt.empty;
    return bucket_s === null ? tt.every : fill(tt.bucket, {step: duration(bucket_s)});
  }

  csvHref(tag, [from, to]) { return loopPath(tag, 'history.csv') + query({from_ms: Math.round(from), to_ms: Math.round(to)}); }

  noteButton(tag, text) {
    const at = () => this.trend?.at ?? Math.min(this.span()[1], this.newest());
    return mayNote() ? el('button', {type: 'button', click: () => askNote(tag, at(), () => this.load())}, text) : null;
  }

  pictureButton(name) {
    const lines = () => [this.tags.join(', '), this.span().map((ms) => wall().dateTime(ms)).join(' – ')];
    return el('button', {type: 'button', click: () => save(pictureOf(this.box, lines()), `${name}.png`)}, tt.png);
  }
}
