// SPDX-License-Identifier: Apache-2.0
// Tables and texts in the view of a loop.
import {CONDITIONS, ofValve} from '../lib/codes.js';
import {el, facts, scroller, table} from '../lib/dom.js';
import {NONE, bytes, count, duration, fixed, percent, quantity, significant} from '../lib/format.js';
import {meter} from '../lib/charts.js';
import {wall} from '../lib/shell.js';
import {changeName, fill, texts} from '../texts.js';
import {reportHref} from './reports.js';

const known = (value) => typeof value === 'number' && Number.isFinite(value);

export function conditionTable(condition) {
  const t = texts.conditions;
  const columns = [{head: t.index, row: true}, {head: t.value, class: 'number'}, {head: '', class: 'gauge'}, {head: t.means, class: 'words'}, {head: t.cannot, class: 'words'}];
  return scroller(texts.loop.condition, table(t.caption, columns, CONDITIONS.map((name) => {
    const value = condition?.[name], [title, means, cannot] = t[name];
    return [title, known(value) ? el('span', {class: value < 50 ? 'value poor' : 'value'}, fixed(value, 0)) : el('span', {class: 'not-known'}, texts.notKnown),
      meter(known(value) ? value / 100 : NaN, value < 50 ? 'poor' : ''), means, cannot];
  }), {class: 'as-cards'}));
}

// State of routine evidence and its next judgement: the shortest windows, and the judged ones.
function routineRows(levels) {
  const t = texts.measures;
  return levels.filter((one, i) => i === 0 || one.windows > 0).map((one) => [fill(t.routine, {window: duration(one.window_s)}),
    fill(one.windows ? t.routineSays : t.routineFirst, {n: count(one.windows), verdict: texts.alarms[one.verdict] ?? one.verdict.replaceAll('_', ' '),
      probability: fixed(one.probability, 2), share: percent(100 * Math.min(one.evidence, 1), 0), next: duration(one.next_in_s)})]);
}

export function measureTable(m) {
  const t = texts.measures, index = significant(m.oscillation_index, 2), of = (text) => (m.windows ? text : NONE); // without a window there are no measured values
  const rows = [
    [t.state, m.window_state], [t.windows, fill(t.suppressed, {n: count(m.windows), m: count(m.windows_suppressed)})],
    [t.oscillation, of(m.oscillation_index > 1 ? fill(t.oscillates, {period: duration(m.oscillation_period_s), index}) : fill(t.steady, {index}))],
    [t.stick, known(m.stick_percent) ? fill(t.stickBy, {value: percent(m.stick_percent, 1), source: m.stick_source}) : NONE],
    [t.variability, of(percent(m.variability_percent, 2))], [t.meanError, of(percent(m.mean_error_percent, 2))], [t.saturated, of(percent(m.saturated_percent, 0))],
    [t.travel, of(fill(t.percentPerHour, {value: count(m.travel_percent_per_hour)}))], [t.reversals, of(fill(t.perHour, {value: count(m.reversals_per_hour)}))],
    [t.bridged, of(count(m.bridged_cycles))],
    [t.hours, [m.hours_automatic, m.hours_manual, m.hours_at_limit].map((h) => duration(3600 * h)).join(', ')],
    ...routineRows(m.routine ?? []),
  ];
  return table(t.caption, [{head: t.measure, row: true}, {head: t.value, class: 'number'}], rows, {captionHidden: true, class: 'pairs'});
}

// The author of the loop's commissioning and its data. Unknown entries are left out.
export function commissioningText(holder) {
  const t = texts.commissioning;
  if (!holder) return t.on;
  return `${fill(t.by, {who: holder.by, time: wall().dateTime(holder.since_ms)})}; ${holder.ends_in_s > 0 ? fill(t.ends, {seconds: fixed(holder.ends_in_s, 0)}) : t.stops}`;
}

const verdictText = (name) => texts.windows.verdicts[name] ?? name;

// A class's probability, and below it the residual of its specialist.
function classCell(window, name) {
  if (!window.specialists.length) return '';
  const specialist = window.specialists.find((one) => one.class === name), p = specialist?.probability;
  return el('span', {class: known(p) && p >= 0.5 ? 'likely' : null}, known(p) ? percent(100 * p) : NONE,
    specialist ? el('small', {}, significant(specialist.mse, 2)) : null);
}

export function windowTable(windows) {
  const t = texts.windows;
  if (!windows.length) return el('p', {class: 'nothing'}, t.none);
  const classes = [...new Set(windows.flatMap((w) => w.specialists.map((one) => one.class)))];
  const columns = [{head: t.time, row: true, class: 'time'}, {head: t.verdict}, {head: t.severity, class: 'number'},
    ...classes.map((name) => ({head: verdictText(name), class: 'number'}))];
  return scroller(texts.loop.windows, table(t.caption, columns, [...windows].reverse().map((w) => [
    wall().dateTime(w.time_ms), w.verdict ? verdictText(w.verdict) : fill(t.suppressed, {why: w.suppressed}),
    percent(w.severity_percent, 1), ...classes.map((name) => classCell(w, name))]), {class: 'windows as-cards'}));
}

export function healthTable(loop) {
  const t = texts.health, {io, recording} = loop, yes = (v) => (v ? texts.yes : texts.no);
  const names = ['transactions', 'timeouts', 'device_exceptions', 'invalid_replies', 'stale_replies_discarded', 'reconnects', 'writes', 'write_errors', 'old_commands_withheld'];
  const lost = recording.dropped + (recording.queue_dropped ?? 0) + recording.rows_lost;
  const age = (ms) => (!known(ms) ? NONE : ms < 10_000 ? `${significant(ms, 3)} ms` : duration(ms / 1000));
  const pvAge = loop.pv_age_ms > 1000 * loop.time_s + 10_000 ? t.never : age(loop.pv_age_ms); // older than the daemon: no value has arrived
  const rows = [[t.connected, yes(io.connected)], [t.pvAge, pvAge], [t.positionAge, age(loop.position_age_ms)],
    ...names.map((name) => [t[name], count(io[name])]), [t.refused, count(loop.orders_refused)],
    [t.rows, count(recording.rows)], [t.lost, count(lost)], [t.bytes, bytes(recording.bytes)],
    recording.disk_errors ? [t.disk, fill(t.diskError, {n: recording.disk_errors, text: recording.last_disk_error})] : null];
  return table(t.caption, [{head: t.what, row: true}, {head: t.value, class: 'number'}], rows.filter(Boolean), {captionHidden: true, class: 'pairs'});
}

// Facts of the twin next to its alarm. Times are in minutes, because content that changes once a minute is then drawn only once a minute.
export function twinFacts(twin) {
  const minutes = (s) => 60 * Math.round(s / 60), {load_outside: load} = twin;
  return {judging: twin.judging, why: twin.controller_not_watched, load: load && {size: significant(load.size), for_s: minutes(load.since_s)},
    untested: twin.untested.map((one) => ({...one, for_s: minutes(one.for_s)}))};
}

export function twinPart(said, loop) {
  const t = texts.twin, age = (s) => (s < 60 ? t.now : duration(s));
  return el('div', {}, facts([
    [t.judging, t.judges[said.judging] ?? said.judging],
    said.load ? [t.load, fill(t.loadOutside, {size: `${said.load.size} ${loop.pv_unit}`.trim(), long: age(said.load.for_s)})] : null,
    said.why ? [t.controller, fill(t.notWatched, {why: said.why})] : null]),
  table(t.untested, [{head: t.change, row: true}, {head: t.lastTested, class: 'number'}],
    said.untested.map((one) => [t.changes[one.change] ?? one.change, fill(one.tested ? t.ago : t.never, {long: age(one.for_s)})]), {class: 'pairs'}));
}

// The detectors that judge the valve, from the loop's description.
export function judgesOf(loop) {
  const t = texts.loop.by, list = loop.specialists.filter(ofValve).map(verdictText).join(', ');
  const judges = [list && fill(t.specialists, {list}), loop.monitor ? t.routine : null, loop.twin ? t.twin : null].filter(Boolean);
  return judges.length ? judges.join('; ') : t.none;
}

// Present state of an alarm. An alarm that isn't a consequence of another one is suppressed while it can't be judged.
export const alarmNow = ({state, consequence}) => (state === 'suppressed' && !consequence ? texts.design.notNow : texts.alarmStates[state] ?? texts.alarmStates.other);

// The design of the loop's alarms; `stateNow(alarm)`: its present state in words. Process alarms are first, because they need action first.
export function alarmTable(designs, loop, stateNow) {
  const t = texts.design, range = [0, loop.pv_range[1] - loop.pv_range[0]], withUnit = (value, unit) => (known(value) ? quantity(value, range, unit) : '');
  const columns = [{head: t.alarm, row: true}, {head: t.priority}, {head: t.limit, class: 'number'}, {head: t.deadBand, class: 'number'}, {head: t.delays, class: 'number'}, {head: t.suppressedBy, class: 'words'}, {head: t.within, class: 'words'}, {head: t.now}];
  const order = [...designs].sort((a, b) => ofValve(a.alarm) - ofValve(b.alarm));
  const node = scroller(texts.loop.processAlarms, table(t.caption, columns, order.map((one) => [el('a', {href: `#/alarms/${encodeURIComponent(loop.tag)}/${encodeURIComponent(one.alarm)}`}, changeName(one.alarm)),
    t.priorities[one.priority] ?? one.priority, withUnit(one.limit, one.unit), withUnit(one.dead_band, one.unit), known(one.on_delay_s) ? `${duration(one.on_delay_s)}, ${duration(one.off_delay_s)}` : '',
    one.suppressed_by.map(changeName).join(', '), one.time_to_act, stateNow(one.alarm)]), {captionHidden: true, class: 'lines as-cards'}));
  return designs.some(({limit}) => known(limit)) ? node : el('div', {}, node, el('p', {class: 'soft small'}, t.noLimits));
}

// State of the function that reduces cycling until the valve is repaired; null: none is active or offered.
export function calmPart(loop, begin) {
  const t = texts.calm, state = loop.monitor.corrective_action, says = loop.compensator?.says;
  if (state === 'off' && !says) {
    return loop.explanation?.effect === 'stiction' ? el('p', {class: 'soft'}, t.couldBe) : null;
  }
  return el('div', {class: 'calm'}, facts([[t.action, t.states[state] ?? state], says ? [t.moves, says] : null]),
    state === 'offered' && begin ? el('div', {class: 'hands'}, el('button', {type: 'button', class: 'main', click: begin}, texts.alarm.calm)) : null);
}

// Returns the explanation if its size and action replace those of the alarm: it agrees with the alarm or has renamed it.
export const replacing = (e) => (e && (e.agrees || e.final_name) ? e : null);

const explainedSize = (e) => fill(texts.explain.sizeWithin, {size: percent(e.size_percent, 1), low: fixed(e.low_percent, 1), high: percent(e.high_percent, 1)});

// The one size of an alarm, with its source if it is that of the explanation.
export function alarmSize(size, worst, explanation) {
  const t = texts.alarm, estimate = typeof size === 'number' ? percent(size, 1) : texts.notKnown, e = replacing(explanation);
  if (e && known(e.size_percent)) return fill(t.sizeExplained, {size: explainedSize(e), estimate});
  return typeof worst === 'number' ? `${estimate}, ${fill(t.worst, {size: percent(worst, 1)})}` : estimate;
}

// `report`: its id among the reports, or null. `shown`: what the alarm next to it shows already.
export function explanationPart(e, report, shown = {size: false, action: false}) {
  const t = texts.explain;
  const name = (kind) => texts.alarms[kind] ?? kind;
  return el('div', {class: 'explanation'}, el('p', {class: 'sentence'}, e.sentence),
    facts([
      e.remedy && !shown.action ? [t.remedy, el('strong', {}, e.remedy)] : null,
      e.next_test ? [t.nextTest, e.next_test] : null,
      e.effect ? [t.effect, e.effect.replaceAll('_', ' ')] : null, known(e.size_percent) && !(shown.size && replacing(e)) ? [t.size, explainedSize(e)] : null,
      [t.agrees, e.agrees ? texts.yes : texts.no], e.final_name ? [t.finalName, name(e.final_name)] : null,
      known(e.confidence) ? [t.confidence, percent(100 * e.confidence)] : null, known(e.gap_closed) ? [t.closed, percent(100 * e.gap_closed)] : null,
      known(e.since_s) ? [t.since, fill(t.before, {long: duration(e.since_s)})] : null,
      e.alternatives?.length ? [t.alternatives, e.alternatives.map((a) => a.replaceAll('_', ' ')).join(', ')] : null]),
    el('p', {class: 'soft'}, fill(t.of, {time: wall().dateTime(e.ended_ms), alarm: name(e.alarm)}),
      report ? [' · ', el('a', {href: reportHref(report), target: '_blank', rel: 'noopener'}, t.report)] : null));
}
