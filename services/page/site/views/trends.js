// SPDX-License-Identifier: Apache-2.0
// Curves of several loops on one axis of time. The selection is in the address, so that it can be saved and sent.
import {FollowingTrend} from '../lib/trend_tools.js';
import {MOST_CURVES, QUANTITIES, curvesIn, curvesText, joined, panesOf} from '../lib/curves.js';
import {loadPlotter, swatch} from '../lib/trend.js';
import {byTag} from '../lib/order.js';
import {el, icon, setAttribute, setText} from '../lib/dom.js';
import {ask, field} from '../lib/dialog.js';
import {live} from '../lib/live.js';
import {recall, remember} from '../lib/memory.js';
import {mayNote} from '../lib/trend_notes.js';
import {query} from '../lib/api.js';
import {fill, texts} from '../texts.js';

const t = texts.trends;
const nameOf = (tag, quantity) => `${tag} ${texts.values[quantity]}`;
const LAST = 'trend-curves', VIEWS = 'trend-views';
// Saved views: the part of the address after the question mark, by name.
const savedViews = () => {
  try {
    return JSON.parse(recall(VIEWS)) ?? {};
  } catch {
    return {};
  }
};
const find = (tag) => live.describe?.loops[live.places.get(tag)];

class Trends extends FollowingTrend {
  #joined = null;
  #joinedOf = null;

  constructor(main, options, scope, uPlot) {
    super(scope, uPlot, options, t.title);
    this.chosenCurves = curvesIn(options.curves ?? recall(LAST) ?? undefined);
    this.chosen = el('ul', {class: 'chosen-curves'});
    this.files = el('span', {class: 'buttons'});
    main.append(el('h1', {tabindex: -1}, t.title), el('section', {class: 'panel trend'}, this.#saved(), this.#adder(), this.#tags(), this.chosen, this.tools, this.box, this.keys,
      el('div', {class: 'under'}, this.note, el('span', {class: 'stretch'}), this.files), this.noted));
    this.#rebuild();
  }

  // Views of this browser, by name.
  #saved() {
    const views = savedViews(), names = Object.keys(views).sort(byTag), open = el('select', {'aria-label': t.views, change: () => { if (open.value) location.hash = `#/trends?${views[open.value]}`; }},
      el('option', {value: ''}, names.length ? t.open : t.noViews), names.map((name) => el('option', {value: name, selected: `#/trends?${views[name]}` === location.hash}, name)));
    const keep = (change) => {
      const all = savedViews();
      change(all);
      remember(VIEWS, JSON.stringify(all));
      this.views.replaceWith(this.#saved());
    };
    const save = () => ask({title: t.save, label: t.save.replace(' …', ''), body: [field(t.viewName, el('input', {name: 'view', required: true, maxlength: 60, value: open.value, autocomplete: 'off'}))],
      accept: async (data) => keep((all) => { all[String(data.get('view')).trim()] = location.hash.split('?')[1] ?? ''; })});
    const drop = el('button', {type: 'button', hidden: !names.length, click: () => { if (open.value) keep((all) => { delete all[open.value]; }); }}, t.drop);
    return this.views = el('div', {class: 'tools'}, open, el('button', {type: 'button', click: save}, t.save), drop);
  }

  // All loops by area; a press adds the quantity that is chosen above.
  #tags() {
    const areas = new Map();
    for (const loop of [...live.describe.loops].sort((a, b) => byTag(a.tag, b.tag))) areas.set(loop.area || '', [...(areas.get(loop.area || '') ?? []), loop]);
    const button = (loop) => el('li', {}, el('button', {type: 'button', class: 'chip-button', title: loop.description || null, click: () => this.#addCurve(loop.tag)}, loop.tag));
    return el('details', {class: 'tag-list', open: !this.chosenCurves.length}, el('summary', {}, t.tags),
      [...areas].sort(([a], [b]) => byTag(a, b)).map(([area, loops]) => [area ? el('h3', {}, area) : null, el('ul', {class: 'chips'}, loops.map(button))]).flat());
  }

  #addCurve(tag) {
    const wish = curvesIn(`${tag.trim()}:${this.quantity.value}`)[0];
    const wrong = this.chosenCurves.length >= MOST_CURVES ? t.full : !wish || !find(wish.tag) ? fill(t.noLoop, {tag}) : '';
    this.trouble.textContent = wrong;
    this.trouble.hidden = !wrong;
    if (wrong) return;
    this.chosenCurves = curvesIn(curvesText([...this.chosenCurves, wish]));
    this.#rebuild();
  }

  #adder() {
    const tags = live.describe.loops.map(({tag}) => tag).sort(byTag);
    const list = el('datalist', {id: 'trend-tags'}, tags.map((tag) => el('option', {value: tag})));
    const tag = el('input', {list: 'trend-tags', required: true, autocomplete: 'off'}), quantity = this.quantity = el('select', {}, QUANTITIES.map((one) => el('option', {value: one}, texts.values[one])));
    this.trouble = el('p', {class: 'trouble', role: 'alert', hidden: true});
    const add = (event) => {
      event.preventDefault();
      this.#addCurve(tag.value);
    };
    return el('form', {class: 'adder', submit: add}, list, field(t.loop, tag), field(t.quantity, quantity), el('button', {type: 'submit'}, t.add), this.trouble);
  }

  // Other curves need other panes.
  #rebuild() {
    const panes = panesOf(this.chosenCurves, find, nameOf), high = Math.max(170, 420 / Math.max(panes.length, 1));
    this.curves(panes.map((pane) => ({...pane, high})));
    if (!panes.length) this.box.append(el('p', {class: 'nothing'}, t.empty));
    const inks = new Map(panes.flatMap((pane) => pane.curves.map((curve) => [curve.name, curve])));
    this.chosen.replaceChildren(...this.chosenCurves.map((one) => {
      const name = nameOf(one.tag, one.quantity), curve = inks.get(name);
      return el('li', {}, curve ? swatch(curve.ink, curve.dash) : icon('bad'), find(one.tag) ? el('a', {href: `#/loop/${encodeURIComponent(one.tag)}`}, name) : fill(t.noLoop, {tag: one.tag}),
        el('button', {type: 'button', class: 'square', 'aria-label': fill(t.remove, {curve: name}), click: () => { this.chosenCurves = this.chosenCurves.filter((other) => other !== one); this.#rebuild(); }}, '×'));
    }));
    this.load();
  }

  get tags() { return [...new Set(this.chosenCurves.map(({tag}) => tag))].filter(find); }
  nameOf(tag, alarm) { return `${tag}: ${super.nameOf(tag, alarm)}`; }
  rows() {
    if (!this.tags.every((tag) => this.histories[tag])) return null;
    if (this.#joinedOf !== this.histories) this.#joined = joined(this.chosenCurves, this.#joinedOf = this.histories);
    return this.#joined;
  }

  // Stored in the address, so that it can be sent, and for the next time that trends are opened.
  async load() {
    remember(LAST, curvesText(this.chosenCurves) || null);
    history.replaceState(null, '', `#/trends${query({curves: curvesText(this.chosenCurves), ...this.choice.address})}`);
    await super.load();
  }

  drawn(span) {
    setText(this.note, this.tags.map((tag) => `${tag}: ${this.said(this.histories[tag], span)}`).join('; '));
    const key = `${this.tags} ${mayNote()}`;
    if (this.files.shown !== key) {
      this.files.shown = key;
      this.csvs = this.tags.map((tag) => el('a', {class: 'button', download: `${tag}.csv`}, fill(t.csv, {tag})));
      this.files.replaceChildren(...this.tags.map((tag) => this.noteButton(tag, `${fill(texts.notes.ask, {tag})} …`)).filter(Boolean), ...this.csvs, this.pictureButton('trend'),
        navigator.clipboard ? el('button', {type: 'button', click: () => navigator.clipboard.writeText(location.href)}, t.copy) : '');
    }
    this.csvs.forEach((link, i) => setAttribute(link, 'href', this.csvHref(this.tags[i], span)));
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
