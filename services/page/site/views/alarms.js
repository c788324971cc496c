// SPDX-License-Identifier: Apache-2.0
// The list of alarms. For the selected one: its meaning, the required action, its cause, and the operator's buttons.
import {actionsOf, ofValve, priority, waits} from '../lib/codes.js';
import {Trend, loadPlotter} from '../lib/trend.js';
import {arrangedAlarms} from '../lib/order.js';
import {el, facts, icon, scroller, setAttribute, table} from '../lib/dom.js';
import {count, duration, percent} from '../lib/format.js';
import {get, loopPath} from '../lib/api.js';
import {INCIDENT, linesOf, ofBox, ownerHref, partOf} from '../lib/incidents.js';
import {live} from '../lib/live.js';
import {meter} from '../lib/charts.js';
import {wall} from '../lib/shell.js';
import {acknowledgeIncident, act, operator} from './acting.js';
import {changeOf, whatOf} from './journal.js';
import {alarmFigures} from './alarm_figures.js';
import {explanationPart} from './loop_parts.js';
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

// For alarms of the box the owner is shown once, and they have no size.
function tableOf(caption, lines, chosen, ofLoops = true) {
  const columns = [{head: t.state}, ofLoops && {head: t.loop}, {head: t.alarm, row: true}, ofLoops && {head: t.size, class: 'number'}, {head: t.raised, class: 'time'}].filter(Boolean);
  const rowOf = (line) => {
    const grave = line.grave(live.severe_percent);
    return [[stateCell(line.state, grave), el('small', {}, texts.haste[line.haste(live.severe_percent)]), acknowledgeButton(line)], ofLoops && el('a', {href: ownerHref(line.loop)}, ownerName(line.loop)),
      el('span', {}, el('a', {href: hrefOf(line.loop, partOf(line)), class: 'choose'}, nameOf(line.name)), line.firstOut ? el('span', {class: 'first-out'}, icon('first'), t.firstOut) : null,
        line.alarms.length > 1 || line.alarms[0].alarm !== line.name ? raisedBy(line) : null),
      ofLoops && (typeof line.size === 'number' ? sizeText(line.size) : ''), wall().dateTime(line.raised_ms)].filter((cell) => cell !== false);
  };
  const node = table(caption, columns, lines.map(rowOf), {captionHidden: true, class: 'lines as-cards alarms'});
  node.querySelectorAll('tbody tr').forEach((row, i) => {
    const line = lines[i], is = line.loop === chosen?.loop && (partOf(line) === chosen?.alarm || line.alarms.some((alarm) => alarm.alarm === chosen?.alarm));
    row.classList.toggle('chosen', is);
    setAttribute(row.querySelector('a.choose'), 'aria-current', is ? 'true' : null);
  });
  return scroller(caption, node);
}

// Alarms of the box are a separate group, which is open while one of them waits.
const fold = {waiting: '', open: false}; // as the user left it, for the alarms that waited then
function boxGroup(lines, chosen) {
  if (!lines.length) return null;
  const waiting = lines.filter((line) => waits(line.state)).map((line) => `${line.name} ${line.raised_ms}`).join();
  if (fold.waiting !== waiting) Object.assign(fold, {waiting, open: waiting !== ''});
  const words = lines.map((line) => `${nameOf(line.name)}, ${texts.alarmStates[line.state]}`).join('; ');
  return el('details', {class: 'box-alarms', open: fold.open || chosen?.loop === lines[0].loop, toggle: (event) => { fold.open = event.target.open; }}, el('summary', {}, fill(t.ofBox, {alarms: words})),
    tableOf(t.boxCaption, lines, chosen, false));
}

function listOf(chosen) {
  const lines = arrangedAlarms(linesOf(live.alarms, live.incidents), live.severe_percent), box = lines.filter(ofBox), loops = lines.filter((line) => !ofBox(line));
  if (!lines.length) return [el('p', {class: 'nothing'}, live.stale ? texts.notKnownNow : live.alarmsKnown ? t.nothing : texts.loading)];
  return [boxGroup(box, chosen), loops.length ? tableOf(t.caption, loops, chosen) : null].filter(Boolean);
}

// Meaning and action of an alarm, as the daemon reports them.
const guideOf = (e) => el('dl', {class: 'guide'}, [['action', t.action], ['time_to_act', texts.design.within], ['cause', t.cause], ['consequence', t.consequence]].filter(([key]) => e[key])
  .map(([key, head]) => el('div', {class: key}, el('dt', {}, head), el('dd', {}, e[key]))));

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
    this.alarms = el('div', {});
    this.noted = el('div', {});
    const note = el('button', {type: 'button', click: () => askNote(chosen.loop, live.overview?.now_ms ?? Date.now(), () => this.load())}, `${texts.notes.title} …`);
    this.node = el('section', {class: 'panel detail'}, el('p', {class: 'back-line'}, el('a', {href: '#/alarms'}, icon('back'), t.back)), this.head, this.about, this.guide, this.why, this.alarms,
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
      const [guide, notes] = await Promise.all([telling && get(loopPath(loop, 'alarms', telling), this.scope.signal), fetchNotes([loop], this.scope.signal).catch(() => [])]);
      if (this.scope.over) return;
      if (incident) showNotes(this.noted, notes, [1000 * incident.from_s, Infinity]);
      const key = JSON.stringify([incident, line?.alarms, ours, report?.id, live.session.can]);
      if (key === this.key) return;
      this.key = key;
      this.#fill(incident, line, ours, report);
      this.guide.replaceChildren(guide && line ? guideOf(guide) : '');
    } catch (error) {
      if (error.name !== 'AbortError') this.about.replaceChildren(el('p', {class: 'trouble', role: 'alert'}, fill(texts.failed, {why: error.message})));
    }
  }

  #fill(incident, line, explanation, report) {
    if (!incident || !line) { this.about.replaceChildren(el('p', {class: 'nothing'}, live.alarmsKnown ? t.gone : texts.loading)); this.why.replaceChildren(); this.alarms.replaceChildren(); return; }
    const name = nameOf(incident.name), time = (s) => wall().dateTime(1000 * s);
    this.head.textContent = `${name} – ${incident.loop}`;
    const button = el('button', {type: 'button', class: 'main', click: () => acknowledgeIncident(incident, name)}, t.acknowledge);
    this.about.replaceChildren(el('div', {class: 'about-alarm'}, stateCell(line.state, line.grave(live.severe_percent)), !mayAct() ? whyNot() : incident.unacknowledged ? el('div', {class: 'hands'}, button) : ''), facts([
      [t.where, texts.causes[incident.cause]], typeof incident.confidence === 'number' ? [texts.explain.confidence, percent(100 * incident.confidence)] : null,
      line.size !== null ? [t.size, sizeText(line.size)] : null, [texts.explain.since, time(incident.from_s)], [t.raised, time(incident.raised_s)], [t.incident, incident.id],
      incident.renamed.length ? [t.named, el('ul', {}, incident.renamed.map((one) => el('li', {}, fill(t.renamed, {from: nameOf(one.from), to: nameOf(one.to), time: time(one.time_s)}))))] : null]),
    el('p', {}, el('a', {href: `#/loop/${encodeURIComponent(incident.loop)}`}, t.open)));
    this.why.replaceChildren(el('h3', {}, t.explanation), explanation ? explanationPart(explanation, report?.id ?? null) : el('p', {class: 'soft'}, notExplained(describedLoop(incident.loop))));
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
    this.evidence = el('div', {});
    this.history = el('div', {});
    this.node = el('section', {class: 'panel detail'}, el('p', {class: 'back-line'}, el('a', {href: '#/alarms'}, icon('back'), t.back)), this.head, this.about, this.guide, this.why, this.evidence, this.history);
  }

  async load() {
    const {loop, alarm} = this.chosen;
    try {
      const e = await get(loopPath(loop, 'alarms', alarm), this.scope.signal);
      const report = e.evidence?.id ? await reportOf(e.evidence.id, this.scope.signal) : null;
      if (this.scope.over) return;
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
      ofValve(alarm.alarm) ? [t.size, `${sizeText(alarm.severity_percent)}${typeof alarm.worst_severity_percent === 'number' ? `, ${fill(t.worst, {size: percent(alarm.worst_severity_percent, 1)})}` : ''}`] : null,
      alarm.priority ? [texts.design.priority, texts.design.priorities[alarm.priority] ?? alarm.priority] : null, [t.raised, wall().dateTime(alarm.raised_ms)], [t.changed, wall().dateTime(alarm.changed_ms)], [t.times, count(alarm.times_raised)], flapsText(alarm) ? [t.flaps, flapsText(alarm)] : null,
      alarm.shelved_until_ms ? [texts.alarmStates.shelved, fill(t.until, {time: wall().dateTime(alarm.shelved_until_ms)})] : null]),
    alarm.consequence ? el('p', {}, fill(t.consequenceOf, {alarm: nameOf(alarm.consequence_of)})) : '', loop || ofBox(alarm) ? el('p', {}, el('a', {href: ownerHref(alarm.loop)}, loop ? t.open : t.openBox)) : '');
    this.guide.replaceChildren(guideOf(e));
    const id = e.evidence?.id ?? null;
    if (ofValve(alarm.alarm)) this.why.replaceChildren(el('h3', {}, t.explanation), e.explanation ? explanationPart(e.explanation, report?.id ?? null) : el('p', {class: 'soft'}, notExplained(loop)));
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
  const rows = el('div', {class: 'told'}), list = el('section', {class: 'panel list'}, rows, alarmFigures(scope)), side = el('div', {class: 'side'});
  let chosen = null, detail = null, inner = null, key = '';
  const showList = () => {
    const fresh = JSON.stringify([live.alarms, live.incidents, live.alarmsKnown, live.stale, live.session.can, chosen, live.describe?.alarms]);
    if (fresh === key) return;
    key = fresh;
    const held = document.activeElement?.getAttribute?.('href'), inside = list.contains(document.activeElement);
    rows.replaceChildren(...listOf(chosen));
    if (inside && held) list.querySelector(`a[href="${CSS.escape(held)}"]`)?.focus({preventScroll: true});
  };
  const choose = ([loop, alarm]) => {
    inner?.end();
    inner = null;
    chosen = loop && alarm ? {loop, alarm} : null;
    main.classList.toggle('chosen', Boolean(chosen));
    showList();
    if (!chosen) { side.replaceChildren(el('section', {class: 'panel detail'}, el('p', {class: 'nothing'}, t.pick))); return; }
    inner = new (scope.constructor)();
    detail = new (chosen.alarm === INCIDENT ? IncidentDetail : Detail)(chosen, inner);
    side.replaceChildren(detail.node);
    // Evidence and explanation follow after the alarm without an event.
    inner.every(5000, () => detail.load());
  };
  main.append(el('h1', {tabindex: -1}, t.title), el('div', {class: 'alarm-view'}, list, side));
  choose(parts);
  scope.atEnd(() => { inner?.end(); main.classList.remove('chosen'); });
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
