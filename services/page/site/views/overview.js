// SPDX-License-Identifier: Apache-2.0
// All loops, worst first, as tiles or as a table. Every loop keeps its node. Each set of values writes only the
// changes, only of visible loops, and draws pictures in the same frame.
import {el, icon, setAttribute, setText, unit, unseen} from '../lib/dom.js';
import {NONE, decimalsFor, fixed} from '../lib/format.js';
import {live} from '../lib/live.js';
import {recall, remember} from '../lib/memory.js';
import {FLAGS, behindOutage, priority, waits} from '../lib/codes.js';
import {FILTERS, arranged, counts} from '../lib/order.js';
import {draw} from '../lib/spark.js';
import {modeOf, ne107Of, stateOf} from '../lib/state.js';
import {fill, texts} from '../texts.js';

const t = texts.overview;
const COLUMNS = [['tag', t.tag], ['alarm', t.state], ['mode', t.mode], ['pv', texts.values.pv], ['sp', texts.values.sp], ['co', texts.values.co],
  ['condition', t.condition], [null, t.trend]];
const loopHref = (tag) => `#/loop/${encodeURIComponent(tag)}`;

// The changing nodes of one loop, in a tile or in a row.
class Item {
  constructor(loop, i, asTable) {
    this.i = i;
    this.loop = loop;
    this.decimals = {pv: decimalsFor(loop.pv_range), sp: decimalsFor(loop.pv_range), co: decimalsFor(loop.co_range)};
    this.drawn = '';
    this.values = Object.fromEntries(['pv', 'sp', 'co'].map((name) => [name, el('span', {class: 'value'}, NONE)]));
    this.mode = el('span', {class: 'mode'});
    this.words = el('span', {});
    this.sign = el('span', {class: 'sign'});
    this.state = el('span', {class: 'state'}, this.sign, this.words);
    this.inFile = el('span', {class: 'soft small', hidden: true}, texts.tuning.notInFile);
    this.acts = el('span', {class: 'small acting', hidden: true});
    this.commissioned = el('span', {class: 'small', hidden: true}, texts.commissioning.on);
    this.ne107 = el('span', {class: 'ne107'});
    this.condition = el('span', {class: 'value'}, NONE);
    this.canvas = el('canvas', {'aria-hidden': 'true', class: 'spark'});
    this.node = asTable ? this.#row() : this.#tile();
  }

  #tile() {
    const {loop} = this, pair = (name, label, u) => el('span', {class: `pair ${name}`}, el('span', {class: 'name'}, label), this.values[name], unit(u));
    return el('li', {class: 'tile'}, el('a', {href: loopHref(loop.tag)},
      el('span', {class: 'top'}, el('span', {class: 'tag'}, loop.tag), this.ne107, this.mode),
      el('span', {class: 'second'}, el('span', {class: 'about'}, loop.description ?? ''), el('span', {class: 'cond'}, el('span', {class: 'name'}, t.conditionShort), this.condition)),
      el('span', {class: 'numbers'}, pair('pv', texts.values.pv, loop.pv_unit), pair('sp', texts.values.sp, null), pair('co', texts.values.co, loop.co_unit)),
      this.canvas,
      el('span', {class: 'foot'}, this.state, this.acts, this.commissioned, this.inFile)));
  }

  #row() {
    const {loop} = this, cell = (...what) => el('td', {role: 'cell'}, what);
    const number = (name, u) => el('td', {role: 'cell', class: 'number', 'data-head': texts.values[name]}, this.values[name], unit(u));
    return el('tr', {role: 'row', class: 'line'},
      el('th', {scope: 'row', role: 'rowheader'}, el('a', {href: loopHref(loop.tag)}, loop.tag), el('span', {class: 'about'}, loop.description ?? '')),
      el('td', {role: 'cell', class: 'how'}, this.ne107, this.state, this.acts, this.commissioned, this.inFile), cell(this.mode), number('pv', loop.pv_unit), number('sp', loop.pv_unit), number('co', loop.co_unit),
      el('td', {role: 'cell', class: 'number condition', 'data-head': t.condition}, this.condition), el('td', {role: 'cell', class: 'trend'}, this.canvas, unseen(t.spark)));
  }

  update(o) {
    const {i, loop} = this;
    for (const name of ['pv', 'sp', 'co']) setText(this.values[name], fixed(o[name][i], this.decimals[name]));
    const mode = modeOf(o, i, loop);
    setText(this.mode, mode ? texts.modes[mode] : NONE);
    setAttribute(this.mode, 'class', mode && mode !== 'automatic' ? 'mode odd' : 'mode');
    const [words, sign, look] = stateOf(o, i, {loop, listed: (kind) => live.alarms.find((alarm) => alarm.loop === loop.tag && alarm.alarm === kind),
      incidentOf: (kind) => live.incidents.find((incident) => incident.loop === loop.tag && incident.alarms.includes(kind)),
      outage: live.alarms.find((alarm) => alarm.loop === loop.tag && behindOutage(alarm))?.consequence_of, severe: live.severe_percent, stale: Boolean(live.stale)});
    setText(this.words, words);
    if (this.signShown !== sign) {
      this.signShown = sign;
      this.sign.replaceChildren(...(sign ? [icon(sign)] : []));
    }
    setAttribute(this.state, 'class', `state ${look}`.trim());
    setAttribute(this.node, 'data-look', look || null);
    const acts = ['jacket_acts', 'compensator_acts'].filter((name) => o.flags[i] & FLAGS[name]).map((name) => texts.flags[name]).join(', ');
    this.acts.hidden = !acts;
    setText(this.acts, acts);
    this.commissioned.hidden = !o.commissioned?.[i];
    this.inFile.hidden = !o.not_in_file?.[i];
    const [letter, meaning] = ne107Of(o, i, Boolean(live.stale));
    if (this.letter !== letter) {
      this.letter = letter;
      this.ne107.replaceChildren(el('abbr', {title: `${texts.loop.ne107}: ${meaning}`}, letter));
      setAttribute(this.ne107, 'class', `ne107 ne-${letter}${loop.simulated ? ' sim' : ''}`);
    }
    setText(this.condition, fixed(o.condition[i], 0));
    setAttribute(this.condition, 'class', o.condition[i] !== null && o.condition[i] < 50 ? 'value poor' : 'value');
    setAttribute(this.node, 'data-old', o.stands[i] ? '' : null);
    // The picture changes with a new extreme, or after PV has moved by a dot of its gauge.
    const [low, high] = loop.pv_range, dot = o.pv[i] === null ? '' : Math.round(this.canvas.tall * (o.pv[i] - low) / (high - low));
    const sketch = `${live.sparks[i].version} ${dot} ${this.values.sp.shown} ${this.canvas.room}`;
    if (sketch === this.drawn) return;
    this.drawn = sketch;
    draw(this.canvas, live.sparks[i], o.pv[i], o.sp[i], loop.pv_range);
  }
}

class Overview {
  constructor(main, scope, options) {
    this.scope = scope;
    this.main = main;
    this.wish = {filter: FILTERS[options.show] ? options.show : 'all', search: '', sort: 'urgency', descending: true};
    this.asTable = recall('overview') === 'table';
    this.items = [];
    this.visible = new Set();
    this.list = el('div', {class: 'loops'});
    this.shown = el('p', {class: 'unseen', role: 'status'});
    main.append(el('h1', {tabindex: -1, class: 'unseen'}, t.title), this.#tools(), this.shown, this.list);
    this.watcher = new IntersectionObserver((entries) => this.#sees(entries), {rootMargin: '120px'});
    this.sizes = new ResizeObserver(() => this.#measure());
    this.sizes.observe(this.list);
    scope.atEnd(() => { this.watcher.disconnect(); this.sizes.disconnect(); });
    scope.on(live, 'describe', () => this.#build());
    scope.on(live, 'overview', () => this.update());
    scope.on(live, 'alarms', () => this.update());
    scope.on(live, 'sparks', () => { for (const node of this.visible) live.fillSpark(this.nodes.get(node)?.i); });
    scope.on(live, 'stale', () => this.update());
    scope.on(live, 'theme', () => { for (const item of this.items) item.drawn = ''; this.update(); });
    scope.on(window, 'beforeprint', () => { if (live.overview) for (const item of this.items) item.update(live.overview); });
    scope.on(this.list, 'keydown', (event) => this.#keys(event));
    this.#build();
  }

  #tools() {
    this.chips = Object.keys(FILTERS).map((name) => {
      const n = el('span', {class: 'n'});
      const input = el('input', {type: 'radio', name: 'show', value: name, checked: name === this.wish.filter,
        change: () => this.#want({filter: name})});
      return {name, n, node: el('label', {class: 'chip'}, input, el('span', {}, t.filters[name], ' ', n))};
    });
    const search = el('input', {type: 'search', placeholder: t.searchHint, 'aria-label': t.search, input: () => this.#want({search: search.value})});
    this.sort = el('select', {'aria-label': t.sort, change: () => this.#want({sort: this.sort.value, descending: this.sort.value === 'urgency'})},
      Object.entries(t.sorts).map(([value, text]) => el('option', {value}, text)));
    const as = (name, text) => el('label', {class: 'chip'}, el('input', {type: 'radio', name: 'as', value: name,
      checked: (name === 'table') === this.asTable, change: () => this.#as(name)}), el('span', {}, text));
    return el('form', {class: 'tools', role: 'search', submit: (event) => event.preventDefault()}, search,
      el('fieldset', {class: 'chips'}, el('legend', {class: 'unseen'}, t.show), this.chips.map((chip) => chip.node)),
      el('span', {class: 'stretch'}), this.sort,
      el('fieldset', {class: 'chips'}, el('legend', {class: 'unseen'}, t.as), as('tiles', t.tiles), as('table', t.table)));
  }

  #as(name) {
    this.asTable = name === 'table';
    remember('overview', name);
    this.#build();
  }

  #want(change) {
    Object.assign(this.wish, change);
    this.arrangedAt = 0;
    this.update();
  }

  #build() {
    this.watcher.disconnect();
    this.visible.clear();
    this.order = '';
    this.room = 0;
    this.arrangedAt = 0;
    this.items = live.describe ? live.describe.loops.map((loop, i) => new Item(loop, i, this.asTable)) : [];
    this.nothing = el('p', {class: 'nothing', hidden: true});
    if (this.asTable) {
      this.heads = COLUMNS.map(([key, text]) => this.#head(key, text));
      this.body = el('tbody', {role: 'rowgroup'});
      this.list.replaceChildren(el('table', {class: 'grid', role: 'table'}, el('caption', {class: 'unseen'}, t.caption),
        el('thead', {role: 'rowgroup'}, el('tr', {role: 'row'}, this.heads)), this.body), this.nothing);
    } else {
      this.body = el('ul', {class: 'tiles', 'aria-label': t.caption});
      this.list.replaceChildren(this.body, this.nothing);
    }
    this.nodes = new Map(this.items.map((item) => [item.node, item]));
    this.#measure();
    this.update();
  }

  #head(key, text) {
    const head = el('th', {scope: 'col', role: 'columnheader', class: ['pv', 'sp', 'co', 'condition'].includes(key) ? 'number' : null});
    head.key = key;
    if (!key) { head.append(text); return head; }
    head.append(el('button', {type: 'button', class: 'sort', click: () => {
      const same = this.wish.sort === key;
      this.#want({sort: key, descending: same ? !this.wish.descending : key === 'alarm'});
    }}, text, el('span', {class: 'arrow', 'aria-hidden': 'true'})));
    return head;
  }

  #measure() {
    const canvas = (this.items.find((item) => this.visible.has(item.node)) ?? this.items[0])?.canvas;
    const {clientWidth: room, clientHeight: tall} = canvas?.isConnected ? canvas : {};
    if (!room || (room === this.room && tall === this.tall)) return;
    [this.room, this.tall] = [room, tall];
    for (const item of this.items) Object.assign(item.canvas, {room, tall});
  }

  #sees(entries) {
    for (const {target, isIntersecting} of entries) {
      if (isIntersecting) this.visible.add(target); else this.visible.delete(target);
    }
    this.#measure();
    for (const {target, isIntersecting} of entries) {
      const item = isIntersecting ? this.nodes.get(target) : null;
      if (!item) continue;
      live.fillSpark(item.i);
      if (live.overview) item.update(live.overview);
    }
  }

  // The order is updated once a second, because a list that changes constantly can't be read.
  #arrange(o) {
    const now = performance.now();
    if (this.arrangedAt && now - this.arrangedAt < 1000) return;
    this.arrangedAt = now;
    const grave = new Set(live.alarms.filter((alarm) => alarm.active && waits(alarm.state) && priority(alarm, live.severe_percent) === 'high').map(({loop}) => loop));
    const {loops} = live.describe, places = arranged(loops, o, {...this.wish, grave}), n = counts(loops, o);
    for (const chip of this.chips) setText(chip.n, String(n[chip.name]));
    setText(this.shown, fill(t.shown, {n: places.length, all: loops.length}));
    this.nothing.hidden = places.length > 0;
    setText(this.nothing, loops.length ? t.nothing : t.empty);
    if (this.asTable) {
      const key = this.wish.sort === 'urgency' ? 'alarm' : this.wish.sort;
      for (const head of this.heads) setAttribute(head, 'aria-sort', head.key === key ? (this.wish.descending ? 'descending' : 'ascending') : null);
    }
    this.sort.value = t.sorts[this.wish.sort] ? this.wish.sort : this.sort.value;
    const order = places.join();
    if (order === this.order) return;
    this.order = order;
    this.#place(places.map((i) => this.items[i]));
  }

  // Moves only nodes with another place, so that focus and scroll position stay.
  #place(items) {
    const keep = new Set(items.map((item) => item.node)), focus = document.activeElement;
    for (const node of [...this.body.children]) {
      if (keep.has(node)) continue;
      this.watcher.unobserve(node);
      this.visible.delete(node);
      node.remove();
    }
    let next = this.body.firstChild;
    for (const {node} of items) {
      if (node === next) { next = next.nextSibling; continue; }
      const fresh = !node.isConnected;
      this.body.insertBefore(node, next);
      if (fresh) this.watcher.observe(node);
    }
    if (focus && focus !== document.activeElement && this.body.contains(focus)) focus.focus({preventScroll: true});
  }

  update() {
    const o = live.overview;
    if (!o || !live.describe) {
      this.nothing.hidden = false;
      setText(this.nothing, live.stale ? texts.notKnownNow : live.describe && !live.describe.loops.length ? t.empty : texts.loading);
      return;
    }
    this.#arrange(o);
    for (const node of this.visible) this.nodes.get(node)?.update(o);
  }

  // Arrow keys move from tile to tile in the visible direction.
  #keys(event) {
    const links = [...this.body.querySelectorAll('a')], at = links.indexOf(document.activeElement);
    if (at < 0 || event.ctrlKey || event.metaKey || event.altKey) return;
    const top = links[0].getBoundingClientRect().top;
    const across = this.asTable ? 1 : Math.max(1, links.findIndex((link) => link.getBoundingClientRect().top > top));
    const to = {ArrowRight: at + 1, ArrowLeft: at - 1, ArrowDown: at + across, ArrowUp: at - across, Home: 0, End: links.length - 1}[event.key];
    if (to === undefined || !links[to]) return;
    event.preventDefault();
    links[to].focus();
  }
}

export function show(main, {options}, scope) {
  return void new Overview(main, scope, options);
}
