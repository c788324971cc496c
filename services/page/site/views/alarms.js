// SPDX-License-Identifier: Apache-2.0
// The list of alarms. For the selected one: its meaning, the required action, its cause, and the operator's buttons.
import {PRIORITIES, actionsOf, cleared, ofValve, priority, waits} from '../lib/codes.js';
import {Trend, loadPlotter} from '../lib/trend.js';
import {arrangedAlarms, byTag} from '../lib/order.js';
import {el, facts, icon, scroller, table} from '../lib/dom.js';
import {count, duration, percent} from '../lib/format.js';
import {get, loopPath} from '../lib/api.js';
import {INCIDENT, keyOf, linesOf, ofBox, ownerHref, partOf, priorityOf} from '../lib/incidents.js';
import {live} from '../lib/live.js';
import {meter} from '../lib/charts.js';
import {wall} from '../lib/shell.js';
import {acknowledgeIncident, acknowledgeLines, act, operator} from './acting.js';
import {changeOf, whatOf} from './journal.js';
import {alarmFigures} from './alarm_figures.js';
import {alarmSize, explanationPart, replacing} from './loop_parts.js';
import {receiptOfLoop} from './loop_reports.js';
import {reportOf} from './reports.js';
import {askNote, fetchNotes, mayNote, showNotes} from '../lib/trend_notes.js';
import {signOf} from '../lib/state.js';
import {changeName as nameOf, fill, ownerName, texts} from '../texts.js';

const t = texts.alarm;
const HISTORY = [{head: texts.journal.time, row: true, class: 'time'}, {head: texts.journal.change, class: 'change'}, {head: texts.journal.who}, {head: texts.journal.reason, class: 'words'}];
const hrefOf = (loop, part) => `#/alarms/${encodeURIComponent(loop)}/${encodeURIComponent(part)}`;
const sizeText = (size) => (typeof size === 'number' ? percent(size, 1) : '–');

// An alarm that was raised once does not flap: null.
export const flapsText = ({flaps}) => (flaps > 1 ? fill(t.flapsTimes, {n: count(flaps)}) : null);

// Without a twin no explanation will follow; an unknown loop may have one.
export const notExplained = (loop) => (loop && !loop.twin ? texts.explain.noTwin : t.noExplanation);
const describedLoop = (tag) => live.describe?.loops[live.places.get(tag)];

function stateCell(state, grave) {
  const look = waits(state) ? `${grave} waits` : state === 'acknowledged' ? `${grave} seen` : 'soft';
  return el('span', {class: `state ${look}`}, el('span', {class: 'sign'}, icon(signOf(state, grave))), el('span', {}, texts.alarmStates[state] ?? texts.alarmStates.other));
}

// For incidents, even if the alarms have the same name, because an operator may want to see each.
const raisedBy = (line) => el('small', {class: 'raised-by'}, fill(t.raisedBy, {alarms: line.alarms.map((alarm) => nameOf(alarm.alarm)).join(', ')}));

// A button for a waiting line, for users with the permission, so that they need not open another view.
function acknowledgeButton(line) {
  if (!mayAct() || !waits(line.state)) return '';
  const name = nameOf(line.name), press = () => (line.incident ? acknowledgeIncident(line.incident, name) : act(line.loop, line.alarm.alarm, 'acknowledge'));
  return el('button', {type: 'button', 'aria-label': `${t.acknowledge}: ${ownerName(line.loop)}, ${name}`, click: press}, t.acknowledge);
}

// Whether the condition is on has a shape of its own, so that it is seen in grey print too.
function stateOfLine(line) {
  const grave = line.grave(live.severe_percent), words = texts.alarmStates[line.state] ?? texts.alarmStates.other;
  return el('span', {class: `state ${cleared(line.state) ? 'gone' : grave}${waits(line.state) ? ' waits' : ' seen'}`}, el('span', {class: 'sign'}, icon(signOf(line.state, grave))),
    el('span', {class: line.active ? 'condition on' : 'condition off'}, line.active ? t.isActive : t.isCleared), el('span', {}, words.replace(/^cleared, /, '')));
}

const areaOf = (line) => describedLoop(line.loop)?.area ?? '';
const sourceOf = (line) => (ofBox(line) ? texts.box : describedLoop(line.loop)?.source ?? '');
const RANKS = {
  need: null, // as arrangedAlarms() has them
  loop: (a, b) => byTag(ownerName(a.loop), ownerName(b.loop)), alarm: (a, b) => byTag(nameOf(a.name), nameOf(b.name)),
  state: (a, b) => Number(b.active) - Number(a.active) || Number(waits(b.state)) - Number(waits(a.state)),
  priority: (a, b) => PRIORITIES.indexOf(priorityOf(a)) - PRIORITIES.indexOf(priorityOf(b)), size: (a, b) => (b.size ?? -1) - (a.size ?? -1), raised: (a, b) => b.raised_ms - a.raised_ms,
};

class AlarmList {
  #selected = new Set(); // keys of waiting lines
  #wish = {search: '', area: '', priority: '', source: '', sort: 'need', turned: false};
  #choices = '';

  constructor(scope) {
    this.scope = scope;
    this.rows = el('div', {class: 'told'});
    this.search = el('input', {type: 'search', placeholder: t.searchHint, 'aria-label': t.search, input: () => this.#want({search: this.search.value})});
    this.selects = Object.fromEntries(['area', 'priority', 'source'].map((name) => [name, el('select', {'aria-label': t.filter[name], change: (event) => this.#want({[name]: event.target.value})})]));
    // For a phone, which has no heads of columns.
    this.order = el('select', {class: 'order', 'aria-label': t.order, change: () => this.#want({sort: this.order.value, turned: false})}, Object.keys(RANKS).map((name) => el('option', {value: name}, t.orders[name])));
    this.chosenCount = el('button', {type: 'button', class: 'main', hidden: true, click: () => acknowledgeLines(this.lines.filter((line) => this.#selected.has(keyOf(line))))});
    this.node = el('section', {class: 'panel list'}, el('form', {class: 'tools', role: 'search', submit: (event) => event.preventDefault()}, this.search, Object.values(this.selects), this.order, el('span', {class: 'stretch'}), this.chosenCount),
      this.rows, alarmFigures(scope));
  }

  #want(change) {
    Object.assign(this.#wish, change);
    this.show(this.chosen);
  }

  #fillSelects(lines) {
    const values = {area: lines.map(areaOf), priority: PRIORITIES, source: lines.map(sourceOf)};
    const key = JSON.stringify(values);
    if (key === this.#choices) return;
    this.#choices = key;
    for (const [name, all] of Object.entries(values)) {
      const wish = this.#wish[name], options = name === 'priority' ? all : [...new Set([...all, wish])].filter(Boolean).sort(byTag);
      this.selects[name].replaceChildren(el('option', {value: ''}, t.filterAll[name]), ...options.map((value) => el('option', {value, selected: value === wish}, texts.design.priorities[value] ?? value)));
      this.selects[name].hidden = !options.length;
    }
  }

  // Returns the lines that the filters keep, in the chosen order.
  #arranged(lines) {
    const w = this.#wish, words = w.search.toLowerCase().split(/\s+/).filter(Boolean);
    const text = (line) => [ownerName(line.loop), nameOf(line.name), describedLoop(line.loop)?.description, ...line.alarms.map(({about}) => about)].join(' ').toLowerCase();
    const kept = arrangedAlarms(lines, live.severe_percent).filter((line) => (!w.area || areaOf(line) === w.area) && (!w.priority || priorityOf(line) === w.priority) &&
      (!w.source || sourceOf(line) === w.source) && words.every((word) => text(line).includes(word)));
    const rank = RANKS[w.sort];
    return rank ? kept.sort((a, b) => (w.turned ? -1 : 1) * rank(a, b)) : kept;
  }

  #head(name, text) {
    const {sort, turned} = this.#wish, on = sort === name, falling = ['state', 'size', 'raised'].includes(name);
    const head = el('th', {scope: 'col', role: 'columnheader', class: {size: 'number', priority: 'haste', raised: 'time'}[name] ?? null, 'aria-sort': on ? (falling !== turned ? 'descending' : 'ascending') : null},
      el('button', {type: 'button', class: 'sort', 'data-key': `sort ${name}`, click: () => this.#want(on && turned ? {sort: 'need', turned: false} : {sort: name, turned: on})}, text, el('span', {class: 'arrow', 'aria-hidden': 'true'})));
    return head;
  }

  #select(keys, on) {
    for (const key of keys) if (on) this.#selected.add(key); else this.#selected.delete(key);
    this.show(this.chosen);
  }

  #box(keys, label) {
    const on = keys.length > 0 && keys.every((key) => this.#selected.has(key));
    return el('input', {type: 'checkbox', 'aria-label': label, 'data-key': `box ${keys.length === 1 ? keys[0] : 'all'}`, checked: on, change: (event) => this.#select(keys, event.target.checked)});
  }

  #row(line) {
    const is = line.loop === this.chosen?.loop && (partOf(line) === this.chosen?.alarm || line.alarms.some(({alarm}) => alarm === this.chosen?.alarm));
    const cell = (attributes, ...what) => el('td', {role: 'cell', ...attributes}, ...what), about = line.alarms[0].about, priority = priorityOf(line);
    return el('tr', {role: 'row', class: `${is ? 'chosen' : ''}${line.active ? '' : ' off'}`},
      mayAct() ? cell({class: 'pick'}, waits(line.state) ? this.#box([keyOf(line)], fill(t.select, {loop: ownerName(line.loop), alarm: nameOf(line.name)})) : '') : null,
      cell({class: 'owner'}, el('a', {href: ownerHref(line.loop)}, ownerName(line.loop))),
      el('th', {scope: 'row', role: 'rowheader', class: 'what'}, el('a', {href: hrefOf(line.loop, partOf(line)), class: 'choose', 'aria-current': is ? 'true' : null}, nameOf(line.name)), line.firstOut ? el('span', {class: 'first-out'}, icon('first'), t.firstOut) : null,
        about ? el('small', {title: about}, about) : null, line.alarms.length > 1 || line.alarms[0].alarm !== line.name ? raisedBy(line) : null),
      cell({}, stateOfLine(line)), cell({class: 'haste'}, el('span', {}, texts.design.priorities[priority] ?? priority), el('small', {}, texts.haste[line.haste(live.severe_percent)])),
      cell({class: 'number', 'data-head': typeof line.size === 'number' ? t.size : null}, typeof line.size === 'number' ? sizeText(line.size) : ''), cell({class: 'time'}, wall().dateTime(line.raised_ms)),
      mayAct() ? cell({class: 'press'}, acknowledgeButton(line)) : null);
  }

  #table(lines) {
    const waiting = lines.filter((line) => waits(line.state)).map(keyOf);
    const heads = [mayAct() ? el('th', {scope: 'col', role: 'columnheader', class: 'pick'}, this.#box(waiting, t.selectAll)) : null, this.#head('loop', t.loop), this.#head('alarm', t.alarm), this.#head('state', t.state),
      this.#head('priority', texts.design.priority), this.#head('size', t.size), this.#head('raised', t.raised), mayAct() ? el('td', {role: 'cell'}) : null].filter(Boolean);
    return scroller(t.caption, el('table', {role: 'table', class: 'lines as-cards alarms'}, el('caption', {class: 'unseen'}, t.caption),
      el('thead', {role: 'rowgroup'}, el('tr', {role: 'row'}, heads)), el('tbody', {role: 'rowgroup'}, lines.map((line) => this.#row(line)))));
  }

  show(chosen) {
    this.chosen = chosen;
    const fresh = JSON.stringify([live.alarms, live.incidents, live.alarmsKnown, live.stale, live.session.can, chosen, live.describe?.alarms, live.describe?.loops, this.#wish, [...this.#selected]]);
    if (fresh === this.key) return;
    this.key = fresh;
    const all = linesOf(live.alarms, live.incidents), active = document.activeElement, held = active?.dataset.key ?? active?.getAttribute('href');
    this.#fillSelects(all);
    this.order.value = this.#wish.sort;
    this.lines = this.#arranged(all);
    const open = new Set(this.lines.filter((line) => waits(line.state)).map(keyOf));
    for (const key of this.#selected) if (!open.has(key)) this.#selected.delete(key);
    this.chosenCount.hidden = !this.#selected.size;
    this.chosenCount.textContent = fill(t.acknowledgeSeveral, {n: this.#selected.size});
    const inside = this.rows.contains(active), nothing = !all.length ? (live.stale ? texts.notKnownNow : live.alarmsKnown ? t.nothing : texts.loading) : t.noMatch;
    this.rows.replaceChildren(this.lines.length ? this.#table(this.lines) : el('p', {class: 'nothing'}, nothing));
    if (inside && held) [...this.rows.querySelectorAll('a, button, input')].find((one) => (one.dataset.key ?? one.getAttribute('href')) === held)?.focus({preventScroll: true});
  }
}

// Meaning and action of an alarm, as the daemon reports them, with the action of the explanation if that replaces it.
function guideOf(guide, explanation) {
  const e = {...guide, action: replacing(explanation)?.remedy || guide.action};
  return el('dl', {class: 'guide'}, [['action', t.action], ['time_to_act', texts.design.within], ['cause', t.cause], ['consequence', t.consequence]].filter(([key]) => e[key])
    .map(([key, head]) => el('div', {class: key}, el('dt', {}, head), el('dd', {}, e[key]))));
}

const mayAct = () => live.session.can?.alarms;
const whyNot = () => el('p', {class: 'soft small'}, live.session.login && !operator() ? t.needsOperator : t.noActing);

function hands(alarm) {
  const actions = actionsOf(alarm.state);
  if (!mayAct()) return whyNot();
  return el('div', {class: 'hands'}, actions.map((action, i) => el('button', {type: 'button', class: i === 0 && waits(alarm.state) ? 'main' : null,
    click: () => act(alarm.loop, alarm.alarm, action)}, t[action])));
}

async function evidencePart(id, loop, scope) {
  const [evidence, uPlot] = await Promise.all([get(`/api/evidence/${encodeURIComponent(id)}`, scope.signal), loadPlotter()]);
  if (scope.over) return el('div', {});
  const times = evidence.t_s, step = times.length > 1 ? times[1] - times[0] : 0, about = evidence.evidence, v = texts.values;
  const box = el('div', {class: 'panes'}), ranges = about.window ?? {}, stem = evidence.stem?.some((x) => x !== null);
  const node = el('div', {class: 'evidence'}, el('h3', {}, t.evidence), el('p', {class: 'soft'}, fill(t.evidenceFor, {n: times.length, step: duration(step)})), box);
  const verdict = about.verdict ?? {}, chances = Object.entries(verdict.probability ?? {});
  if (chances.length) {
    node.append(el('h4', {}, t.chance), el('ul', {class: 'chances'}, chances.sort((a, b) => b[1] - a[1]).map(([name, p]) =>
      el('li', {}, el('span', {}, nameOf(name)), meter(p), el('span', {class: 'value'}, percent(100 * p))))));
  }
  const command = el('code', {tabindex: 0}, evidence.replay), copied = el('span', {class: 'soft', role: 'status'});
  node.append(el('h4', {}, t.replay), el('p', {class: 'command'}, command, navigator.clipboard ? el('button', {type: 'button', click: async () => {
    await navigator.clipboard.writeText(evidence.replay);
    copied.textContent = texts.copied;
  }}, texts.copy) : null, copied));
  // Drawn when it is part of the page and has a width.
  const draw = () => {
    const trend = new Trend(uPlot, box, {x: {unit: 's'}, least: 10 * step, panes: [
      {label: t.evidenceUpper, unit: loop?.pv_unit, range: ranges.pv_range, high: 190, curves: [{key: 'sp', name: v.sp, ink: 'sp', dash: [6, 4]}, {key: 'pv', name: v.pv, ink: 'measured'}]},
      {label: t.evidenceLower, unit: loop?.co_unit, range: ranges.co_range, high: 150, curves: [{key: 'co', name: v.co, ink: 'co'}, ...(stem ? [{key: 'stem', name: v.stem, ink: 'stem', dash: [3, 3]}] : [])]}]});
    trend.show({...evidence, t: times}, [times[0], times.at(-1)]);
    scope.on(live, 'theme', () => trend.redraw());
    scope.atEnd(() => trend.end());
  };
  return {node, draw};
}

// One change of a loop: what it is, its cause, and the alarms that it raised.
class IncidentDetail {
  constructor(chosen, scope) {
    Object.assign(this, {chosen, scope});
    this.head = el('h2', {tabindex: -1}, chosen.loop);
    this.about = el('div', {}, el('p', {class: 'nothing'}, texts.loading));
    this.guide = el('div', {});
    this.why = el('div', {});
    this.receipt = el('div', {});
    this.alarms = el('div', {});
    this.noted = el('div', {});
    const note = el('button', {type: 'button', click: () => askNote(chosen.loop, live.overview?.now_ms ?? Date.now(), () => this.load())}, `${texts.notes.title} …`);
    this.node = el('section', {class: 'panel detail'}, el('p', {class: 'back-line'}, el('a', {href: '#/alarms'}, icon('back'), t.back)), this.head, this.about, this.guide, this.why, this.receipt, this.alarms,
      el('h3', {}, texts.notes.plural), this.noted, mayNote() ? note : null);
  }

  async load() {
    const {loop} = this.chosen;
    try {
      const now = await get(loopPath(loop), this.scope.signal), {incident} = now;
      const ours = now.explanation && incident?.alarms.includes(now.explanation.alarm) && now.explanation.raised_ms >= 1000 * incident.raised_s ? now.explanation : null;
      const report = ours ? await reportOf(ours.folder.split('/').at(-1), this.scope.signal) : null;
      if (this.scope.over) return;
      const line = linesOf(live.alarms, live.incidents).find((one) => one.incident && one.loop === loop);
      // If the explanation has found another cause than the alarms name, it also has the remedy.
      const telling = incident?.alarms.find((alarm) => alarm === incident.name) ?? (typeof incident?.confidence === 'number' ? null : incident?.alarms.at(-1));
      const [guide, notes, receipt] = await Promise.all([telling && get(loopPath(loop, 'alarms', telling), this.scope.signal), fetchNotes([loop], this.scope.signal).catch(() => []), receiptOfLoop(loop, this.scope.signal)]);
      if (this.scope.over) return;
      this.receipt.replaceChildren(receipt);
      if (incident) showNotes(this.noted, notes, [1000 * incident.from_s, Infinity]);
      const key = JSON.stringify([incident, line?.alarms, ours, report?.id, live.session.can]);
      if (key === this.key) return;
      this.key = key;
      this.#fill(incident, line, ours, report, Boolean(guide));
      this.guide.replaceChildren(guide && line ? guideOf(guide, ours) : '');
    } catch (error) {
      if (error.name !== 'AbortError') this.about.replaceChildren(el('p', {class: 'trouble', role: 'alert'}, fill(texts.failed, {why: error.message})));
    }
  }

  #fill(incident, line, explanation, report, guided) {
    if (!incident || !line) { this.about.replaceChildren(el('p', {class: 'nothing'}, live.alarmsKnown ? t.gone : texts.loading)); this.why.replaceChildren(); this.alarms.replaceChildren(); return; }
    const name = nameOf(incident.name), time = (s) => wall().dateTime(1000 * s);
    this.head.textContent = `${name} – ${incident.loop}`;
    const button = el('button', {type: 'button', class: 'main', click: () => acknowledgeIncident(incident, name)}, t.acknowledge);
    this.about.replaceChildren(el('div', {class: 'about-alarm'}, stateCell(line.state, line.grave(live.severe_percent)), !mayAct() ? whyNot() : incident.unacknowledged ? el('div', {class: 'hands'}, button) : ''), facts([
      [t.where, texts.causes[incident.cause]], typeof incident.confidence === 'number' ? [texts.explain.confidence, percent(100 * incident.confidence)] : null,
      line.size !== null ? [t.size, alarmSize(line.size, null, explanation)] : null, [texts.explain.since, time(incident.from_s)], [t.raised, time(incident.raised_s)], [t.incident, incident.id],
      incident.renamed.length ? [t.named, el('ul', {}, incident.renamed.map((one) => el('li', {}, fill(t.renamed, {from: nameOf(one.from), to: nameOf(one.to), time: time(one.time_s)}))))] : null]),
    el('p', {}, el('a', {href: `#/loop/${encodeURIComponent(incident.loop)}`}, t.open)));
    this.why.replaceChildren(el('h3', {}, t.explanation), explanation ? explanationPart(explanation, report?.id ?? null, {size: line.size !== null, action: guided}) : el('p', {class: 'soft'}, notExplained(describedLoop(incident.loop))));
    this.alarms.replaceChildren(el('h3', {}, t.incidentAlarms), el('ul', {class: 'its-alarms'}, line.alarms.map((alarm) => el('li', {},
      el('a', {href: hrefOf(alarm.loop, alarm.alarm)}, nameOf(alarm.alarm)), `, ${texts.alarmStates[alarm.state]}, ${wall().dateTime(alarm.raised_ms)}`))));
  }
}

class Detail {
  constructor(chosen, scope) {
    Object.assign(this, {chosen, scope});
    this.head = el('h2', {tabindex: -1}, `${nameOf(chosen.alarm)} – ${ownerName(chosen.loop)}`);
    this.about = el('div', {}, el('p', {class: 'nothing'}, texts.loading));
    this.guide = el('div', {});
    this.why = el('div', {});
    this.receipt = el('div', {});
    this.evidence = el('div', {});
    this.history = el('div', {});
    this.node = el('section', {class: 'panel detail'}, el('p', {class: 'back-line'}, el('a', {href: '#/alarms'}, icon('back'), t.back)), this.head, this.about, this.guide, this.why, this.receipt, this.evidence, this.history);
  }

  async load() {
    const {loop, alarm} = this.chosen;
    try {
      const e = await get(loopPath(loop, 'alarms', alarm), this.scope.signal);
      const report = e.evidence?.id ? await reportOf(e.evidence.id, this.scope.signal) : null;
      const receipt = ofValve(alarm) ? await receiptOfLoop(loop, this.scope.signal) : '';
      if (this.scope.over) return;
      this.receipt.replaceChildren(receipt);
      // Content stays unless it has changed, and with it the focus and the selection.
      const key = JSON.stringify([{...e, monitor: null}, report?.id, live.session.can]);
      if (key === this.key) return;
      this.key = key;
      this.#fill(e, report);
    } catch (error) {
      if (error.name !== 'AbortError') this.about.replaceChildren(el('p', {class: 'trouble', role: 'alert'}, fill(texts.failed, {why: error.message})));
    }
  }

  #fill(e, report) {
    const {alarm} = e, loop = describedLoop(alarm.loop);
    this.about.replaceChildren(el('div', {class: 'about-alarm'}, stateCell(alarm.state, priority(alarm, live.severe_percent)), hands(alarm)), facts([
      ofValve(alarm.alarm) ? [t.size, alarmSize(alarm.severity_percent, alarm.worst_severity_percent, e.explanation)] : null,
      alarm.priority ? [texts.design.priority, texts.design.priorities[alarm.priority] ?? alarm.priority] : null, [t.raised, wall().dateTime(alarm.raised_ms)], [t.changed, wall().dateTime(alarm.changed_ms)], [t.times, count(alarm.times_raised)], flapsText(alarm) ? [t.flaps, flapsText(alarm)] : null,
      alarm.shelved_until_ms ? [texts.alarmStates.shelved, fill(t.until, {time: wall().dateTime(alarm.shelved_until_ms)})] : null]),
    alarm.consequence ? el('p', {}, fill(t.consequenceOf, {alarm: nameOf(alarm.consequence_of)})) : '', loop || ofBox(alarm) ? el('p', {}, el('a', {href: ownerHref(alarm.loop)}, loop ? t.open : t.openBox)) : '');
    this.guide.replaceChildren(alarm.about ? el('p', {class: 'sentence'}, alarm.about) : '', guideOf(e, e.explanation));
    const id = e.evidence?.id ?? null;
    if (ofValve(alarm.alarm)) this.why.replaceChildren(el('h3', {}, t.explanation), e.explanation ? explanationPart(e.explanation, report?.id ?? null, {size: true, action: true}) : el('p', {class: 'soft'}, notExplained(loop)));
    const lines = e.history ?? [];
    this.history.replaceChildren(...(lines.length ? [el('h3', {}, t.history), scroller(t.history, table(t.historyCaption, HISTORY, lines.map((line) => [wall().dateTime(line.utc_ms),
      whatOf(line) || changeOf(line), line.peer || texts.journal.daemon, line.reason]), {captionHidden: true, class: 'lines as-cards history'}))] : []));
    if (ofValve(alarm.alarm)) this.#evidence(id, loop);
  }

  async #evidence(id, loop) {
    if (this.id === id && this.evidence.firstChild) return;
    this.id = id;
    if (!id) { this.evidence.replaceChildren(el('h3', {}, t.evidence), el('p', {class: 'soft'}, t.noEvidence)); return; }
    try {
      const part = await evidencePart(id, loop, this.scope);
      if (this.scope.over || this.id !== id) return;
      this.evidence.replaceChildren(part.node);
      part.draw();
    } catch (error) {
      if (error.name !== 'AbortError') this.evidence.replaceChildren(el('h3', {}, t.evidence), el('p', {class: 'trouble'}, fill(texts.failed, {why: error.message})));
    }
  }
}

export function show(main, {parts}, scope) {
  const list = new AlarmList(scope), side = el('div', {class: 'side'});
  let chosen = null, detail = null, inner = null;
  const choose = ([loop, alarm]) => {
    inner?.end();
    inner = null;
    chosen = loop && alarm ? {loop, alarm} : null;
    main.classList.toggle('chosen', Boolean(chosen));
    list.show(chosen);
    if (!chosen) { side.replaceChildren(); return; }
    inner = new (scope.constructor)();
    detail = new (chosen.alarm === INCIDENT ? IncidentDetail : Detail)(chosen, inner);
    side.replaceChildren(detail.node);
    // Evidence and explanation follow after the alarm without an event.
    inner.every(5000, () => detail.load());
  };
  main.append(el('h1', {tabindex: -1}, t.title), el('div', {class: 'alarm-view'}, list.node, side));
  choose(parts);
  scope.atEnd(() => { inner?.end(); main.classList.remove('chosen'); });
  const showList = () => list.show(chosen);
  scope.on(live, 'alarms', () => { showList(); if (chosen) detail.load(); });
  scope.on(live, 'acted', () => { if (chosen) detail.load(); });
  scope.on(live, 'describe', showList);
  scope.on(live, 'stale', showList);
  scope.follow = (wanted) => {
    choose(wanted.parts);
    (chosen ? detail.head : main.querySelector('h1')).focus({preventScroll: !matchMedia('(max-width: 1100px)').matches});
    return true;
  };
}
