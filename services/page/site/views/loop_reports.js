// SPDX-License-Identifier: Apache-2.0
// Reports on a loop's record: the requested ones, and the form with which an engineer requests one.
import {KINDS, atWork, receiptOf, sent, shown, told} from '../lib/asked.js';
import {el, scroller, setText, table, timeInput, unseen} from '../lib/dom.js';
import {field} from '../lib/dialog.js';
import {get, loopPath, post} from '../lib/api.js';
import {live} from '../lib/live.js';
import {meter} from '../lib/charts.js';
import {wall} from '../lib/shell.js';
import {reportHref} from './reports.js';
import {fill, texts} from '../texts.js';

const t = texts.asked;

const EACH_MS = 2000;
const CALM_ROUNDS = 5; // while no report is in work, only each fifth round sends a request

export class LoopReports {
  #round = 0;
  #touched = false;
  #placed = false; // the form shows the queue position of the newest request

  constructor(loop, trend, scope) {
    Object.assign(this, {loop, trend, scope});
    this.list = el('div', {}, el('p', {class: 'nothing'}, texts.loading));
    this.receipt = el('div', {class: 'told'}); // for another place on the loop's page
    this.node = el('div', {class: 'asked-reports'}, this.#asking(), this.list);
  }

  start() { this.scope.every(EACH_MS, () => this.#look()); }

  #asking() {
    const {session, describe} = live;
    if (!session.can?.reports) {
      const byLogIn = session.login && session.role !== 'engineer' && describe.page?.reports;
      return el('p', {class: 'soft small'}, byLogIn ? t.needsEngineer : t.off);
    }
    const time = () => timeInput({required: true, input: () => { this.#touched = true; }});
    this.kind = el('select', {change: () => setText(this.means, t.means[this.kind.value])}, KINDS.map((kind) => el('option', {value: kind}, t.kinds[kind])));
    this.means = el('p', {class: 'soft small'}, t.means[KINDS[0]]);
    this.from = time();
    this.to = time();
    this.go = el('button', {type: 'submit', class: 'main'}, t.ask);
    this.said = el('p', {class: 'small', role: 'status'});
    const asShown = el('button', {type: 'button', click: () => { this.#touched = false; this.#follow(); }}, t.asShown);
    return el('form', {submit: (event) => { event.preventDefault(); this.#ask(); }},
      el('div', {class: 'filters'}, field(t.kind, this.kind), field(`${t.from} (${wall().zone})`, this.from), field(t.to, this.to), asShown, this.go), this.means, this.said);
  }

  #kept() { return {oldest_ms: this.trend.rows()?.oldest_ms ?? NaN, newest_ms: this.trend.newest()}; }

  // The form has the times of the trend until the user writes others.
  #follow() {
    if (!this.from || this.#touched || document.activeElement === this.from || document.activeElement === this.to) return;
    const span = shown(this.trend.span(), this.#kept());
    if (span) [this.from.value, this.to.value] = span.map((ms) => wall().toInput(ms));
  }

  async #ask() {
    const [from_ms, to_ms] = sent([this.from, this.to].map((input) => wall().fromInput(input.value)), this.#kept());
    this.go.disabled = true;
    try {
      const {waiting} = await post(loopPath(this.loop.tag, 'reports'), {kind: this.kind.value, from_ms, to_ms});
      setText(this.said, fill(t.taken, {kind: t.kinds[this.kind.value], place: waiting}));
      this.#placed = true;
      this.#round = 0;
      await this.#look();
    } catch (error) {
      if (error.name !== 'AbortError') setText(this.said, fill(t.refused, {why: error.message}));
    } finally {
      this.go.disabled = false;
    }
  }

  async #look() {
    this.#follow();
    if (live.stale || this.#round++ % CALM_ROUNDS) return;
    try {
      const {reports} = await get(loopPath(this.loop.tag, 'reports'), this.scope.signal);
      if (atWork(reports)) this.#round = 0;
      else if (this.#placed) { this.#placed = false; setText(this.said, ''); } // it has its line in the list
      this.#show(reports);
    } catch (error) {
      if (error.name !== 'AbortError') this.list.replaceChildren(el('p', {class: 'trouble'}, fill(texts.failed, {why: error.message})));
    }
  }

  #show(reports) {
    const now_ms = live.overview?.now_ms ?? Date.now(), key = JSON.stringify([reports, reports.map((report) => told(report, now_ms))]);
    if (this.list.shownKey === key) return;
    this.list.shownKey = key;
    this.receipt.replaceChildren(receiptPart(reports));
    const columns = [{head: t.kind, row: true}, {head: t.over}, {head: t.state, class: 'words'}, {head: t.asked}];
    this.list.replaceChildren(reports.length ? scroller(t.title, table(t.caption, columns, reports.map((report) => rowOf(report, now_ms)), {captionHidden: true, class: 'lines as-cards'}))
      : el('p', {class: 'nothing'}, t.none));
  }
}

// The date of the end, if it differs.
function overText(from_ms, to_ms) {
  const clock = wall(), sameDay = clock.date(from_ms) === clock.date(to_ms);
  return `${clock.dateTime(from_ms)} – ${sameDay ? clock.time(to_ms) : clock.dateTime(to_ms)}`;
}

const link = (report, name) => (report.id ? el('a', {href: reportHref(report.id), target: '_blank', rel: 'noopener'}, name, unseen(` (${texts.reports.opens})`)) : name);

function stateText(report, now_ms) {
  const {key, values} = told(report, now_ms);
  return fill(t.states[key], key === 'due' ? {time: wall().dateTime(values.time)} : values);
}

// Returns the newest receipt of the loop: its result and a link, or the time at which it is made. Empty without one.
export function receiptPart(reports) {
  const receipt = receiptOf(reports);
  if (!receipt) return '';
  const said = receipt.sentence || stateText(receipt, live.overview?.now_ms ?? Date.now());
  return el('p', {class: 'receipt'}, link(receipt, t.kinds.receipt), `: ${said}`);
}

// Returns the part for an alarm of the loop.
export async function receiptOfLoop(tag, signal) {
  return receiptPart((await get(loopPath(tag, 'reports'), signal).catch(() => ({reports: []}))).reports);
}

function rowOf(report, now_ms) {
  const {key, values} = told(report, now_ms);
  const title = link(report, t.kinds[report.kind] ?? report.kind);
  const state = [stateText(report, now_ms), key === 'doing' ? meter(values.percent / 100) : null, report.sentence ? el('small', {class: 'said'}, report.sentence) : null];
  return [title, overText(report.from_ms, report.to_ms), state.filter(Boolean), [wall().dateTime(report.asked_ms), el('small', {}, report.by)]];
}
