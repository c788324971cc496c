// SPDX-License-Identifier: Apache-2.0
// One valve of the fleet, from the host's data: alarms and their sizes over weeks, conditions, explanation, last values.
import {NONE, percent, significant} from '../lib/format.js';
import {CONDITIONS, priority} from '../lib/codes.js';
import {Trend, loadPlotter} from '../lib/trend.js';
import {bandsOf, lanes} from '../lib/bands.js';
import {el, facts, icon, scroller, table} from '../lib/dom.js';
import {get} from '../lib/api.js';
import {live} from '../lib/live.js';
import {wall} from '../lib/shell.js';
import {alarmSign} from './fleet.js';
import {conditionTable, explanationPart} from './loop_parts.js';
import {changeName as nameOf, fill, texts} from '../texts.js';

const t = texts.valve;
const SEVERE_PERCENT = 5;
const LINES = [['measured', null], ['co', [6, 4]], ['stem', [3, 3]], ['sp', [8, 3, 2, 3]]]; // can be distinguished without colour
const stateText = (state) => texts.alarmStates[state] ?? state;
const panel = (title, ...what) => el('section', {class: 'panel'}, el('h2', {}, title), what);
const byName = (values) => new Map(values.map((one) => [one.name, one]));

// The host stores an explanation under the names of the edge's metrics.
const explanationOf = ({time_ms, parts: p}) => ({...p, size_percent: p.size, low_percent: p.low, high_percent: p.high, ended_ms: time_ms});

function alarmTable(valve) {
  if (!valve.alarms.length) return el('p', {class: 'calm'}, icon(valve.online ? 'ok' : 'low'), t.noAlarm);
  const columns = [{head: texts.alarm.alarm, row: true}, {head: texts.alarm.state}, {head: texts.alarm.size, class: 'number'}, {head: texts.alarm.changed, class: 'time'}];
  return scroller(t.alarms, table(t.alarms, columns, valve.alarms.map((alarm) => [alarm.active ? alarmSign(alarm) : nameOf(alarm.alarm), stateText(alarm.state),
    percent(alarm.severity, 1), wall().dateTime(alarm.changed_ms)]), {captionHidden: true, class: 'lines as-cards'}));
}

// The cause of the alarms, as one line.
function incidentLine({incident: one}) {
  if (!one?.active) return null;
  const sure = one.confidence === null ? '' : fill(t.sure, {confidence: percent(100 * one.confidence)});
  return el('p', {}, alarmSign({alarm: one.name, state: one.unacknowledged ? 'unacknowledged' : 'acknowledged', severity: null}), ' ',
    fill(t.incident, {where: texts.causes[one.cause] ?? one.cause, sure, time: wall().dateTime(one.raised_ms)}));
}

function historyTable(changes) {
  const columns = [{head: texts.journal.time, row: true, class: 'time'}, {head: texts.alarm.alarm}, {head: texts.alarm.state}, {head: texts.alarm.size, class: 'number'}];
  return scroller(t.changes, table(t.changes, columns, changes.slice(0, 100).map((one) => [wall().dateTime(one.time_ms), nameOf(one.alarm), stateText(one.state), percent(one.severity, 1)]),
    {captionHidden: true, class: 'lines as-cards'}));
}

function valueTable(valve) {
  const rows = valve.values.filter(({name}) => !name.includes('/')).map((one) => [texts.valueNames[one.name] ?? one.name, [
    one.number === null ? one.text ?? NONE : [el('span', {class: 'value'}, significant(one.number, 4)), one.unit ? el('span', {class: 'unit'}, one.unit) : null],
    el('small', {}, wall().dateTime(one.time_ms))].flat()]);
  if (!rows.length) return el('p', {class: 'nothing'}, t.noValues);
  return table(t.values, [{head: texts.measures.measure, row: true}, {head: texts.measures.value, class: 'number'}], rows, {captionHidden: true, class: 'pairs last-values'});
}

function evidenceList(evidence) {
  if (!evidence.length) return null;
  return panel(texts.alarm.evidence, el('p', {class: 'soft small'}, t.evidence),
    scroller(texts.alarm.evidence, table(texts.alarm.evidence, [{head: t.file, row: true}, {head: t.asked, class: 'time'}, {head: t.there}],
      evidence.map((one) => [one.name, wall().dateTime(one.begun_ms), one.complete ? texts.yes : texts.no]), {captionHidden: true, class: 'lines as-cards'})));
}

function boxFacts(valve) {
  return facts([[texts.fleet.group, valve.group], [texts.fleet.box, valve.edge],
    [texts.fleet.state, valve.online ? t.online : valve.box_online ? t.loopAway : texts.fleet.away],
    [texts.fleet.heard, wall().dateTime(valve.heard_ms)]]);
}

// Columns over time for the trend; values that were never known are left out.
function curvesOf({from_ms, step_s, severity}) {
  const known = Object.entries(severity).filter(([, values]) => values.some((value) => value > 0)).slice(0, LINES.length);
  if (!known.length) return null;
  const steps = known[0][1].length, end = (i) => from_ms + (i + 1) * step_s * 1000;
  return {names: known.map(([name]) => name), data: {...Object.fromEntries(known), t: Array.from({length: steps}, (_, i) => end(i))}};
}

function bandsOfValve(valve) {
  const lines = valve.changes.map((one) => ({kind: 'alarm', alarm: one.alarm, to: one.state, utc_ms: one.time_ms}));
  const standing = valve.alarms.filter((alarm) => alarm.active).map((alarm) => ({...alarm, raised_ms: alarm.changed_ms}));
  const sizes = new Map(valve.alarms.map((alarm) => [alarm.alarm, alarm.severity]));
  const bands = bandsOf(lines, standing).map((band) => ({...band, label: nameOf(band.alarm),
    priority: priority({alarm: band.alarm, severity_percent: sizes.get(band.alarm)}, SEVERE_PERCENT)}));
  lanes(bands);
  return bands;
}

async function drawWeeks(valve, box, scope) {
  const curves = curvesOf(valve.weeks);
  if (!curves) { box.append(el('p', {class: 'nothing'}, texts.fleet.noCurve)); return; }
  const uPlot = await loadPlotter();
  if (scope.over) return;
  const whole = [valve.weeks.from_ms, curves.data.t.at(-1)], before = [], bands = bandsOfValve(valve);
  let span = whole;
  const want = (wish) => {
    if (wish && wish !== 'all') { before.push(span); span = wish; } else span = wish === 'all' ? whole : before.pop() ?? whole;
    trend.show(curves.data, span, bands);
  };
  const trend = new Trend(uPlot, box, {x: {clock: wall()}, keys: 'valve-keys', least: 4 * valve.weeks.step_s * 1000, limits: () => whole, onSpan: want,
    panes: [{label: t.weeks, unit: t.ofSpan, range: [0, 10], high: 240, curves: curves.names.map((name, i) => ({key: name, name: nameOf(name), ink: LINES[i][0], dash: LINES[i][1]}))}]});
  trend.show(curves.data, span, bands);
  scope.on(live, 'theme', () => trend.redraw());
  scope.atEnd(() => trend.end());
}

// The present state of a valve is unknown while its box is away.
const awayNote = (valve) => (valve.online ? null : el('div', {class: 'old-note'}, icon('bad'), el('span', {}, fill(valve.box_online ? t.loopAwayLong : t.away, {time: wall().dateTime(valve.heard_ms)}))));

export async function show(main, {parts}, scope) {
  main.append(el('h1', {tabindex: -1}, parts.at(-1) ?? ''), el('p', {class: 'nothing'}, texts.loading));
  const valve = await get(`/api/fleet/valves/${parts.map(encodeURIComponent).join('/')}`, scope.signal);
  const values = byName(valve.values), conditions = Object.fromEntries(CONDITIONS.map((name) => [name, values.get(`condition/${name}`)?.number]));
  const detectable = valve.values.filter(({name, number}) => name.startsWith('detectable/') && number !== null);
  const weeks = el('div', {class: 'panes'});
  main.replaceChildren(el('p', {class: 'back-to'}, el('a', {href: '#/fleet'}, icon('back'), texts.fleet.title)),
    el('div', {class: 'title'}, el('h1', {tabindex: -1}, valve.tag), el('span', {class: 'about'}, `${valve.group} · ${valve.edge}`),
      el('span', {class: 'stretch'}), el('span', {class: 'soft small'}, fill(texts.fleet.asOf, {time: wall().dateTime(valve.now_ms)}))),
    awayNote(valve) ?? '',
    el('div', {class: 'cards', 'data-old': !valve.online},
      el('div', {class: 'wider'}, panel(t.alarms, incidentLine(valve), alarmTable(valve))), panel(t.where, boxFacts(valve)),
      el('div', {class: 'across'}, el('section', {class: 'panel trend'}, el('h2', {}, t.weeks), el('p', {class: 'unseen', id: 'valve-keys'}, texts.trend.keys), weeks)),
      el('div', {class: 'across'}, panel(texts.loop.condition, conditionTable(conditions))),
      el('div', {class: 'wider'}, panel(texts.loop.explanation, valve.explanation ? explanationPart(explanationOf(valve.explanation), null) : el('p', {class: 'nothing'}, texts.explain.none))),
      panel(t.values, valueTable(valve)),
      valve.changes.length ? el('div', {class: 'wider'}, panel(t.changes, historyTable(valve.changes))) : null,
      detectable.length ? panel(t.detectable, facts(detectable.map(({name, number}) => [nameOf(name.slice('detectable/'.length)), percent(number, 1)]))) : null,
      evidenceList(valve.evidence)));
  await drawWeeks(valve, weeks, scope);
}
