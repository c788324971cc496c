// SPDX-License-Identifier: Apache-2.0
// All boxes of the plant: their worst valves and how long these have been faulty, silent boxes, different versions,
// alarm rates against ISA-18.2.
import {NONE, count, duration, fixed, percent} from '../lib/format.js';
import {SortedTable} from '../lib/sorted_table.js';
import {barPath, curvePath, greatest, judged, matching, worstOf} from '../lib/fleet.js';
import {el, icon, setText, svg, unseen} from '../lib/dom.js';
import {get, query} from '../lib/api.js';
import {live} from '../lib/live.js';
import {priority, waits} from '../lib/codes.js';
import {signOf} from '../lib/state.js';
import {wall} from '../lib/shell.js';
import {changeName, fill, texts} from '../texts.js';

const t = texts.fleet;
const SEVERE_PERCENT = 5; // the daemon's default; a box does not report its own
const ROUND_MS = 10_000;
const LEAST_TOP_PERCENT = 5; // so that small sizes look small
const RATE_TOP = 16; // alarms in 10 minutes at the top of the bars

export const valveHref = (row) => `#/valve/${[row.group, row.edge, row.device].map(encodeURIComponent).join('/')}`;
const panel = (title, ...what) => el('section', {class: 'panel'}, el('h2', {}, title), what);
const value = (...what) => el('span', {class: 'value'}, what);
const dateTime = (ms) => wall().dateTime(ms);
const at = (ms) => (ms === null ? NONE : value(dateTime(ms)));
// A hash is a number, but an edge of another make may send anything.
export const hash = (text) => (text === null ? NONE : /^\d+$/.test(text) ? Number(text).toString(16).padStart(8, '0') : text);
const boxCell = (row) => [el('span', {class: 'box-name'}, row.edge), el('small', {}, row.group)];
const placeOf = (row) => [row.area, row.group, row.edge, row.online ? '' : t.away].filter(Boolean).join(' · ');
const boxKey = (row) => `${row.group}\n${row.edge}`;

export function alarmSign(row) {
  const grave = priority({alarm: row.alarm, severity_percent: row.severity}, SEVERE_PERCENT);
  return el('span', {class: `state ${grave} ${waits(row.state) ? 'waits' : 'seen'}`}, el('span', {class: 'sign'}, icon(signOf(row.state, grave))), el('span', {}, changeName(row.alarm)));
}

function curve({weeks: values, severity}, top) {
  const most = greatest(values);
  if (most === null) return el('span', {class: 'soft'}, t.noCurve);
  return [svg('svg', {class: 'weeks', viewBox: '0 0 112 24', preserveAspectRatio: 'none', 'aria-hidden': 'true'},
    svg('path', {class: 'weeks-ground', d: 'M0 24H112'}), svg('path', {class: 'weeks-curve', d: curvePath(values, 112, 24, top), 'vector-effect': 'non-scaling-stroke'})),
  unseen(fill(t.curve, {now: percent(severity, 1), most: percent(most, 1)}))];
}

function rateBars(bins, figures) {
  const y = (n) => 24 * (1 - n / RATE_TOP);
  return svg('svg', {class: 'rate', viewBox: `0 0 ${bins.length} 24`, preserveAspectRatio: 'none', 'aria-hidden': 'true'},
    svg('path', {class: 'rate-figure', d: `M0 ${y(figures.most)}H${bins.length}M0 ${y(figures.flood)}H${bins.length}`, 'vector-effect': 'non-scaling-stroke'}),
    svg('path', {class: 'rate-bar', d: barPath(bins, 24, RATE_TOP, (n) => n <= figures.flood)}),
    svg('path', {class: 'rate-flood', d: barPath(bins, 24, RATE_TOP, (n) => n > figures.flood)}));
}

// The targets are for one operator, and all groups together have more than one.
function verdict(rate, figures) {
  const [word, grave] = judged(rate, figures);
  return el('span', {class: `state ${grave ?? ''}`}, el('span', {class: 'sign'}, icon(grave ?? 'ok')), el('span', {}, t.judged[word]));
}

const sum = (groups, key) => groups.reduce((total, one) => total + one[key], 0);

// One figure of the strip at the top: its name, its value, and whether it meets its target.
function figure(name, text, odd, note) {
  return el('div', {class: 'figure'}, el('dt', {}, name), el('dd', {}, odd ? icon('low') : null, value(text), note ? el('small', {}, note) : null));
}

class FleetView {
  constructor(main, scope, options) {
    Object.assign(this, {main, scope, answer: null, trouble: null, wish: options.group ?? ''});
    this.search = el('input', {type: 'search', placeholder: t.searchHint, 'aria-label': t.search, value: options.text, input: () => this.#show()});
    this.group = el('select', {'aria-label': t.group, change: () => this.#choose(this.group.value)});
    this.asOf = el('p', {class: 'soft small as-of'});
    this.old = el('div', {class: 'old-note', role: 'alert', hidden: true});
    this.figures = el('dl', {class: 'figures panel'});
    this.body = el('div', {class: 'fleet-body'}, el('p', {class: 'nothing'}, texts.loading));
    main.append(el('div', {class: 'title'}, el('h1', {tabindex: -1}, t.title), el('span', {class: 'stretch'}), this.asOf),
      el('form', {class: 'tools', role: 'search', submit: (event) => event.preventDefault()}, this.group, this.search), this.old, this.body);
    this.#tables();
    this.#groups([]);
    scope.every(1000, () => this.#age());
  }

  #choose(group) {
    this.wish = group;
    this.load();
  }

  async load() {
    const wish = this.wish;
    try {
      this.#take(wish, await get(`/api/fleet${query({group: wish})}`, this.scope.signal));
    } catch (error) {
      if (error.name === 'AbortError' || wish !== this.wish) return;
      if (error.status === 401) { await live.renewSession(); return; }
      // Rows of another group are not shown for this one, however old.
      const mine = this.answer?.group === wish ? this.answer : null;
      this.answer = mine ?? error.body?.last ?? null;
      this.trouble = error.message;
      this.#show();
    }
  }

  #take(wish, answer) {
    if (wish !== this.wish) return;
    this.answer = answer;
    this.trouble = null;
    this.#show();
  }

  #groups(names) {
    const all = this.wish && !names.includes(this.wish) ? [...names, this.wish] : names;
    const key = all.join('\n');
    if (this.group.names === key) return;
    this.group.names = key;
    this.group.replaceChildren(el('option', {value: ''}, t.allGroups), ...all.map((name) => el('option', {value: name, selected: name === this.wish}, name)));
  }

  #tables() {
    const number = {class: 'number'};
    this.valves = new SortedTable(t.worstCaption, [
      {key: 'tag', head: t.valve, row: true, value: (row) => row.tag, cell: (row) => [el('a', {href: valveHref(row)}, row.tag), el('small', {}, placeOf(row))]},
      {key: 'alarm', head: t.alarm, value: (row) => changeName(row.alarm), cell: (row) => [alarmSign(row), el('small', {}, texts.alarmStates[row.state] ?? row.state)]},
      {key: 'severity', head: t.size, ...number, falls: true, value: (row) => row.severity, cell: (row) => value(percent(row.severity, 1))},
      {key: 'since', head: t.since, class: 'time', value: (row) => row.since_ms, cell: (row) => [at(row.since_ms), el('small', {}, fill(t.for, {long: duration((this.answer.now_ms - row.since_ms) / 1000)}))]},
      {key: 'weeks', head: t.weeks, class: 'curve-cell', cell: (row) => curve(row, this.top)},
    ], (row) => `${boxKey(row)}\n${row.device}\n${row.alarm}`, 'severity', {class: 'lines worst'});
    this.faults = new SortedTable(t.faultsCaption, [
      {key: 'tag', head: t.loop, row: true, value: (row) => row.tag, cell: (row) => [el('a', {href: valveHref(row)}, row.tag), el('small', {}, placeOf(row))]},
      {key: 'alarm', head: t.alarm, value: (row) => changeName(row.alarm), cell: (row) => [alarmSign(row), el('small', {}, texts.alarmStates[row.state] ?? row.state)]},
      {key: 'since', head: t.since, class: 'time', falls: true, value: (row) => row.since_ms, cell: (row) => [at(row.since_ms), el('small', {}, fill(t.for, {long: duration((this.answer.now_ms - row.since_ms) / 1000)}))]},
    ], (row) => `${boxKey(row)}\n${row.device}\n${row.alarm}`, 'since');
    this.silent = new SortedTable(t.silentCaption, [
      {key: 'edge', head: t.box, row: true, value: (row) => row.edge, cell: boxCell},
      {key: 'state', head: t.state, value: (row) => (row.online ? 1 : 0), cell: (row) => el('span', {class: 'state low'}, el('span', {class: 'sign'}, icon(row.online ? 'low' : 'bad')), el('span', {}, row.online ? t.saysNothing : t.away))},
      {key: 'heard', head: t.heard, class: 'time', value: (row) => row.heard_ms, cell: (row) => [at(row.heard_ms), row.silence_s === null ? null : el('small', {}, fill(t.ago, {long: duration(row.silence_s)}))]},
      {key: 'note', head: t.note, class: 'words', cell: (row) => [row.conflict_ms === null ? null : fill(t.conflict, {time: dateTime(row.conflict_ms)}),
        Math.abs(row.clock_offset_s ?? 0) > 5 ? fill(row.clock_offset_s > 0 ? t.clockAhead : t.clockBehind, {long: duration(row.clock_offset_s)}) : null].filter(Boolean).join('; ')},
    ], boxKey, 'heard');
    const differs = (text, is) => (is ? el('span', {class: 'state low'}, el('span', {class: 'sign'}, icon('low')), el('span', {}, text, unseen(` ${t.differs}`))) : value(text));
    this.versions = new SortedTable(t.versionsCaption, [
      {key: 'edge', head: t.box, row: true, value: (row) => row.edge, cell: boxCell},
      {key: 'version', head: t.version, value: (row) => row.version, cell: (row) => differs(row.version ?? NONE, row.version_differs)},
      {key: 'config', head: t.config, value: (row) => row.config_hash, cell: (row) => el('code', {}, differs(hash(row.config_hash), row.config_differs))},
      {key: 'model', head: t.model, value: (row) => row.model_hash, cell: (row) => el('code', {}, differs(hash(row.model_hash), row.model_differs))},
      {key: 'changed', head: t.changed, class: 'time', falls: true, value: (row) => row.changed_ms, cell: (row) => (row.changes ? [at(row.changed_ms), row.changes > 1 ? el('small', {}, fill(t.times, {n: row.changes})) : null] : '')},
    ], boxKey, 'edge');
    const rate = (name) => (row) => row.day[name];
    this.rates = new SortedTable(t.rateCaption, [
      {key: 'group', head: t.group, row: true, value: (row) => row.group, cell: (row) => row.group || t.allGroups},
      {key: 'verdict', head: t.week, falls: true, value: (row) => row.week.per_10_min, cell: (row) => [row.group || this.oneGroup ? verdict(row.week, this.answer.alarm_rate.figures) : null, el('small', {}, fill(t.weekFigures, {mean: fixed(row.week.per_10_min, 2), flood: percent(row.week.flood_percent, 1)}))]},
      {key: 'raised', head: t.aDay, ...number, falls: true, value: rate('raised'), cell: (row) => value(count(row.day.raised))},
      {key: 'mean', head: t.inTen, ...number, falls: true, value: rate('per_10_min'), cell: (row) => value(fixed(row.day.per_10_min, 2))},
      {key: 'most', head: t.most, ...number, falls: true, value: rate('most'), cell: (row) => value(count(row.day.most))},
      {key: 'flood', head: t.flood, ...number, falls: true, value: rate('flood_percent'), cell: (row) => value(percent(row.day.flood_percent, 1))},
      {key: 'bins', head: t.lastDay, class: 'curve-cell', cell: (row) => rateBars(row.bins, this.answer.alarm_rate.figures)},
    ], (row) => row.group, 'group');
  }

  // Shown when the first answer arrives; after that only the contents change.
  #build() {
    if (this.shownWorst) return;
    this.shownWorst = el('p', {class: 'soft small'});
    this.usual = el('p', {class: 'soft small'});
    this.none = {faults: el('p', {class: 'calm'}), valves: el('p', {class: 'calm'}), silent: el('p', {class: 'calm'}), versions: el('p', {class: 'calm'})};
    this.body.replaceChildren(this.figures,
      panel(t.faults, this.none.faults, this.faults.node),
      panel(t.worst, this.none.valves, this.valves.node, this.shownWorst),
      panel(t.rate, el('p', {class: 'soft small'}, t.rateFigures), this.rates.node),
      el('div', {class: 'pair-of-panels'}, panel(t.silent, this.none.silent, this.silent.node), panel(t.versions, this.none.versions, this.versions.node, this.usual)));
  }

  #show() {
    this.#age();
    if (!this.answer) {
      if (this.trouble) this.body.replaceChildren();
      this.shownWorst = null;
      return;
    }
    this.#build();
    const {answer} = this, groups = answer.groups.map((one) => one.group);
    this.#groups(groups);
    this.#figures(answer.groups.filter((one) => !answer.group || one.group === answer.group));
    this.top = Math.max(LEAST_TOP_PERCENT, ...answer.valves.list.flatMap((row) => row.weeks.filter((v) => v !== null)));
    // The state of a silent box is unknown, so it is never shown as good.
    const unheard = answer.silent.all, heard = (text) => (unheard ? fill(t.ofHeard, {text, n: count(unheard)}) : text);
    this.#list('faults', this.faults, answer.faults, heard(t.noFault), !unheard);
    this.#list('valves', this.valves, answer.valves, heard(t.noSick), !unheard);
    this.#list('silent', this.silent, answer.silent, t.noSilent, true);
    this.#list('versions', this.versions, answer.versions, heard(t.noDifference), !unheard);
    this.oneGroup = groups.length === 1;
    this.rates.show(answer.alarm_rate.list.filter((row) => !row.group || !answer.group || row.group === answer.group));
    setText(this.usual, answer.versions.usual.filter((one) => !answer.group || one.group === answer.group)
      .map((one) => fill(t.usual, {group: one.group, version: one.version ?? texts.notKnown, model: hash(one.model_hash)})).join('; '));
  }

  #list(name, table, {all, list}, nothing, known) {
    const rows = matching(list, this.search.value, (row) => [row.group, row.edge, row.tag ?? '', row.area ?? '', row.alarm ? changeName(row.alarm) : '', row.version ?? '']);
    table.node.hidden = !rows.length;
    this.none[name].hidden = rows.length > 0;
    this.none[name].replaceChildren(...(all ? [t.nothing] : [icon(known ? 'ok' : 'low'), nothing]));
    if (rows.length) table.show(rows);
    if (name === 'valves') setText(this.shownWorst, fill(t.shown, {n: count(rows.length), all: count(all)}));
  }

  #figures(groups) {
    const of = (name) => sum(groups, name), boxes = of('boxes'), loops = of('loops'), {figures} = this.answer.alarm_rate;
    const {list} = this.answer.alarm_rate, rate = list.find((row) => row.group === this.answer.group);
    const worst = worstOf(list.filter((row) => row.group && groups.some((one) => one.group === row.group)), figures);
    this.figures.replaceChildren(
      figure(t.boxesOnline, fill(t.nOf, {n: count(of('online')), all: count(boxes)}), of('online') < boxes),
      figure(t.silent, count(of('silent')), of('silent') > 0),
      figure(t.loopsOnline, fill(t.nOf, {n: count(of('loops_online')), all: count(loops)}), of('loops_online') < loops),
      figure(t.faulty, count(of('faulty')), of('faulty') > 0),
      figure(t.sick, count(of('sick')), of('sick') > 0, loops ? percent(100 * of('sick') / loops, 1) : null),
      figure(t.waiting, count(of('waiting')), of('waiting') > 0),
      figure(t.rateToday, fixed(rate?.day.per_10_min ?? 0, 2), worst !== null, worst ? `${worst.group}: ${t.judged[judged(worst.day, figures)[0]]}` : null));
  }

  // Old data are marked as old, with their age.
  #age() {
    const {answer, trouble} = this;
    this.body.toggleAttribute('data-old', Boolean(trouble));
    setText(this.asOf, answer ? fill(t.asOf, {time: dateTime(answer.now_ms)}) : '');
    this.old.hidden = !trouble;
    if (!trouble) return;
    const long = answer ? duration(Math.max(0, Math.round((Date.now() - answer.now_ms) / 1000))) : '';
    const text = fill(answer ? t.old : t.down, {why: trouble, time: answer ? dateTime(answer.now_ms) : '', long});
    if (this.old.text === text) return;
    this.old.text = text;
    // Screen readers get one announcement, not one per second.
    if (!this.old.firstChild) this.old.append(icon('bad'), el('span', {}));
    this.old.lastChild.textContent = text;
  }
}

export async function show(main, {options}, scope) {
  const view = new FleetView(main, scope, options);
  await scope.every(ROUND_MS, () => view.load());
}
