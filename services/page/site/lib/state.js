// SPDX-License-Identifier: Apache-2.0
// Describes in words the state of a loop and whether it acts on its valve. Pure: works on the daemon's columns, and on `stands`: per loop,
// whether its cycle has stopped. An unknown state is never shown as normal.
import {ALARM_KINDS, ALARM_STATES, FAULTS, FLAGS, MODES, NE107, cleared, named, priority, quality, shown, waits} from './codes.js';
import {fixed} from './format.js';
import {changeName, fill, texts} from '../texts.js';

export function signOf(state, grave) {
  if (state === 'shelved') return 'shelved';
  return cleared(state) ? 'gone' : grave;
}

// No cycle of the loop has been reported yet; its cycle has stopped, so the last report is its former state.
const unknown = (o, i) => typeof o.fault[i] !== 'number';
const stands = (o, i) => Boolean(o.stands?.[i]);
const CALM = new Set(['none', 'starting']);

// Returns the displayed alarm of a loop: the one in the daemon's columns, with its size if `listed` has it.
function alarmOf(o, i, listed, severe, incidentOf) {
  const state = named(ALARM_STATES, o.alarm[i]);
  if (!shown(state)) return null;
  const kind = named(ALARM_KINDS, o.alarm_kind[i]), one = listed?.(kind), name = incidentOf?.(kind)?.name ?? kind;
  return {state, name: changeName(name), grave: priority(one ?? {alarm: kind}, severe), size: name === kind ? one?.severity_percent : null};
}

function alarmLine({state, name, grave, size}) {
  const look = cleared(state) ? `gone${waits(state) ? ' waits' : ''}` : waits(state) ? `${grave} waits` : state === 'acknowledged' ? `${grave} seen` : 'gone';
  return [`${name}${typeof size === 'number' ? ` ${fixed(size, 1)} %` : ''}, ${texts.alarmStates[state]}`, signOf(state, grave), look];
}

function freshState(o, i, {loop, listed, severe, outage, incidentOf}) {
  const fault = named(FAULTS, o.fault[i]), alarm = alarmOf(o, i, listed, severe, incidentOf);
  if (outage && !unknown(o, i) && quality(o.quality[i]) === 'bad') return [fill(texts.overview.behind, {alarm: changeName(outage)}), 'bad', 'soft'];
  if (!unknown(o, i) && !CALM.has(fault)) return [texts.faults[fault], 'bad', 'high'];
  if (alarm && alarm.state !== 'shelved') return alarmLine(alarm);
  if (unknown(o, i)) return [texts.notKnown, null, 'soft'];
  if (o.flags[i] & FLAGS.output_lost) return [texts.flags.output_lost, 'bad', 'high'];
  if (o.quality[i] !== null && quality(o.quality[i]) !== 'good') return [`${texts.values.pv} ${texts.quality[quality(o.quality[i])]}`, 'bad', 'low'];
  if (fault !== 'none') return [texts.faults[fault], null, ''];
  if (o.flags[i] & FLAGS.at_low) return [texts.flags.at_low, null, 'soft'];
  if (o.flags[i] & FLAGS.at_high) return [texts.flags.at_high, null, 'soft'];
  if (alarm) return [`${alarm.name}, ${texts.alarmStates.shelved}`, 'shelved', 'soft'];
  return loop?.control === 'elsewhere' ? [texts.acts.watched[0], null, 'soft'] : [texts.overview.calm, null, ''];
}

// Returns the state of a loop in one line: [words, sign, look]. `about`: loop; listed(kind), its alarm in the list; incidentOf(kind), the incident that has it in the list; outage: the box's alarm
// that stands for its lost connection; severe, %; stale: all
// values are old, including the information that a cycle has stopped.
export function stateOf(o, i, about = {}) {
  const [words, sign, look] = freshState(o, i, about);
  if (about.stale) return [fill(texts.stale.state, {state: words}), null, 'soft'];
  if (!stands(o, i)) return [words, sign, look];
  return [fill(texts.stale.stands, {state: words}), 'bad', look.startsWith('high') ? look : 'low'];
}

// The mode of another controller is unknown while no data arrive from it. It has no fallback: then its mode is neither automatic nor manual.
export function modeOf(o, i, loop) {
  const watched = loop?.control === 'elsewhere', mode = MODES[o.mode[i]] ?? null;
  if (stands(o, i) || (watched && quality(o.quality[i]) === 'bad')) return null;
  return watched && mode === 'fallback' ? 'other' : mode;
}

// NE 107: [letter, meaning].
export const ne107Of = (o, i, stale) => (stale || stands(o, i) ? null : texts.ne107[NE107[o.ne107[i]]]) ?? ['–', texts.notKnown];

// Returns in words why a loop doesn't work; null: no reason is known. Valve alarms and manual mode are no such reasons.
export function outageOf(o, i) {
  if (unknown(o, i)) return texts.notKnown;
  if (stands(o, i)) return texts.stale.loop;
  const fault = named(FAULTS, o.fault[i]);
  if (!CALM.has(fault)) return texts.faults[fault];
  if (o.flags[i] & FLAGS.output_lost) return texts.flags.output_lost;
  return quality(o.quality[i]) === 'good' ? null : `${texts.values.pv} ${texts.quality[quality(o.quality[i])]}`;
}

// Groups the loops that don't work by reason: [reason, tags], most frequent first.
export function outages(o, loops) {
  const groups = new Map();
  loops.forEach(({tag}, i) => {
    const why = outageOf(o, i);
    if (why !== null) groups.set(why, [...(groups.get(why) ?? []), tag]);
  });
  return [...groups].sort(([, a], [, b]) => b.length - a.length);
}

const NOT_WRITTEN = new Set(['output_lost', 'output_unknown']);
const OUT_OF_SERVICE = new Set(['enable_open', 'stop']);

// Returns whether the loop acts on its valve: a key of texts.acts, and whether that is unusual.
function actsKey(o, i, loop) {
  if (loop.control === 'elsewhere') return ['watched', false];
  const fault = named(FAULTS, o.fault[i]), mode = MODES[o.mode[i]];
  if (NOT_WRITTEN.has(fault) || o.flags[i] & FLAGS.output_lost) return ['not_written', true];
  if (OUT_OF_SERVICE.has(fault)) return ['out_of_service', true];
  if (fault === 'starting') return ['starting', false];
  if (!mode || fault === 'other') return ['not_known', true];
  return mode === 'automatic' ? ['acts', false] : [mode, true];
}

export function actsOf(o, i, loop, stale = false) {
  const [key, odd] = stale || ((unknown(o, i) || stands(o, i)) && loop.control !== 'elsewhere') ? ['not_known', true] : actsKey(o, i, loop);
  const [word, detail] = texts.acts[key], fault = named(FAULTS, o?.fault[i]);
  // An output can be lost with or without another reported fault.
  const reason = key === 'not_written' && !NOT_WRITTEN.has(fault) ? texts.faults.output_lost : texts.faults[fault] ?? '';
  const simulated = Boolean(loop.simulated);
  return {key, odd, simulated, word: simulated ? `${word}, ${texts.simulated}` : word, detail: key === 'acts' && simulated ? texts.actsOnModel : fill(detail, {why: reason})};
}
