// SPDX-License-Identifier: Apache-2.0
// How a loop is and whether it acts on its valve, in words. Pure: works on the daemon's columns, and on `stands`: of each loop whether
// its cycle does not move on. What is not known is never said to be normal.
import {ALARM_KINDS, ALARM_STATES, FAULTS, FLAGS, MODES, NE107, named, priority, quality, shown, waits} from './codes.js';
import {fixed} from './format.js';
import {changeName, fill, texts} from '../texts.js';

export function signOf(state, grave) {
  if (state === 'shelved') return 'shelved';
  return state === 'returned_unacknowledged' || state === 'latched_acknowledged' ? 'gone' : grave;
}

// No cycle of the loop has been told of yet; its cycle does not move on, so that what was told last is how it was.
const unknown = (o, i) => typeof o.fault[i] !== 'number';
const stands = (o, i) => Boolean(o.stands?.[i]);
const CALM = new Set(['none', 'starting']);

// The alarm of a loop that is shown: what the daemon's columns name, with its size where `listed` has it.
function alarmOf(o, i, listed, severe) {
  const state = named(ALARM_STATES, o.alarm[i]);
  if (!shown(state)) return null;
  const kind = named(ALARM_KINDS, o.alarm_kind[i]), one = listed?.(kind);
  return {state, name: changeName(kind), grave: priority(one ?? {alarm: kind}, severe), size: one?.severity_percent};
}

function alarmLine({state, name, grave, size}) {
  const look = waits(state) ? `${grave} waits` : state === 'acknowledged' ? `${grave} seen` : 'gone';
  return [`${name}${typeof size === 'number' ? ` ${fixed(size, 1)} %` : ''}, ${texts.alarmStates[state]}`, signOf(state, grave), look];
}

function freshState(o, i, {loop, listed, severe}) {
  const fault = named(FAULTS, o.fault[i]), alarm = alarmOf(o, i, listed, severe);
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

// One line on how a loop is: [words, sign, look]. `about`: loop; listed(kind), its alarm in the list; severe, %; stale: all values are
// old, and with them that a cycle stands.
export function stateOf(o, i, about = {}) {
  const [words, sign, look] = freshState(o, i, about);
  if (about.stale) return [fill(texts.stale.state, {state: words}), null, 'soft'];
  if (!stands(o, i)) return [words, sign, look];
  return [fill(texts.stale.stands, {state: words}), 'bad', look.startsWith('high') ? look : 'low'];
}

// What another controller's mode is nobody knows while nothing comes from it.
export const modeOf = (o, i, loop) => ((loop.control === 'elsewhere' && quality(o.quality[i]) === 'bad') || stands(o, i) ? null : MODES[o.mode[i]] ?? null);

// NE 107: [letter, meaning].
export const ne107Of = (o, i, stale) => (stale || stands(o, i) ? null : texts.ne107[NE107[o.ne107[i]]]) ?? ['–', texts.notKnown];

// Why a loop does not do its work, in words; null: nothing says that it does not. An alarm of its valve and manual are none of that.
export function outageOf(o, i) {
  if (unknown(o, i)) return texts.notKnown;
  if (stands(o, i)) return texts.stale.loop;
  const fault = named(FAULTS, o.fault[i]);
  if (!CALM.has(fault)) return texts.faults[fault];
  if (o.flags[i] & FLAGS.output_lost) return texts.flags.output_lost;
  return quality(o.quality[i]) === 'good' ? null : `${texts.values.pv} ${texts.quality[quality(o.quality[i])]}`;
}

// Which loops don't do their work, by why: [why, tags], the most first.
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

// Whether the loop acts on its valve: a key of texts.acts, and whether that is odd.
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
  // An output can be lost while another fault is told, or none.
  const reason = key === 'not_written' && !NOT_WRITTEN.has(fault) ? texts.faults.output_lost : texts.faults[fault] ?? '';
  const simulated = Boolean(loop.simulated);
  return {key, odd, simulated, word: simulated ? `${word}, ${texts.simulated}` : word, detail: key === 'acts' && simulated ? texts.actsOnModel : fill(detail, {why: reason})};
}
