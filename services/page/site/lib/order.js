// SPDX-License-Identifier: Apache-2.0
// Sorts and filters the loops. Pure: works on the daemon's columns.
import {ALARM_STATES, FAULTS, NE107, named, quality, shown, waits} from './codes.js';
import {modeOf} from './state.js';

const STATE_RANK = {unacknowledged: 90, latched_unacknowledged: 80, acknowledged: 60, returned_unacknowledged: 50,
  latched_acknowledged: 30, other: 60, shelved: 8};
const NE107_RANK = {failure: 70, other: 20, not_known: 4, out_of_specification: 20, maintenance_required: 10, function_check: 2, normal: 0};
// A starting loop counts as normal; an unknown one gets no judgement.
const CALM_FAULTS = new Set(['none', 'starting', 'not_known']);

export const faulty = (o, i) => !CALM_FAULTS.has(named(FAULTS, o.fault[i])) || Boolean(o.stands?.[i]);
const unknown = (o, i) => typeof o.fault[i] !== 'number';
export const alarmed = (o, i) => shown(named(ALARM_STATES, o.alarm[i])) && ALARM_STATES[o.alarm[i]] !== 'shelved';
export const notAutomatic = (o, i, loop) => !['automatic', null].includes(modeOf(o, i, loop));
export const badQuality = (o, i) => o.quality[i] !== null && quality(o.quality[i]) !== 'good';
export const poor = (o, i) => o.condition[i] !== null && o.condition[i] < 50;
export const abnormal = (o, i, loop) =>
  unknown(o, i) || faulty(o, i) || alarmed(o, i) || notAutomatic(o, i, loop) || badQuality(o, i) || poor(o, i);

// A greater rank is shown earlier. `grave`: an active alarm waits and needs action now. Condition counts in steps of ten, so that loops
// don't swap places with every window.
export function urgency(o, i, grave = false, loop = undefined) {
  const state = named(ALARM_STATES, o.alarm[i]);
  let rank = Math.max(STATE_RANK[state] ?? 0, NE107_RANK[named(NE107, o.ne107[i])], faulty(o, i) ? 70 : 0);
  if (waits(state)) rank += (grave ? 20 : 0) + Math.min(o.alarms_unacknowledged?.[i] ?? 0, 6);
  if (badQuality(o, i)) rank += 5;
  if (notAutomatic(o, i, loop)) rank += 3;
  const condition = o.condition[i];
  const steps = typeof condition === 'number' ? 10 - Math.floor(Math.min(Math.max(condition, 0), 99.9) / 10) : 0;
  return rank * 100 + steps;
}

export const FILTERS = {
  all: () => true,
  abnormal,
  alarm: alarmed,
  fault: (o, i) => faulty(o, i) || badQuality(o, i),
  manual: notAutomatic,
  condition: poor,
};

const collator = new Intl.Collator('en', {numeric: true, sensitivity: 'base'});
export const byTag = (a, b) => collator.compare(a, b);

const KEYS = {
  pv: (o, i) => o.pv[i], sp: (o, i) => o.sp[i], co: (o, i) => o.co[i], mode: (o, i) => o.mode[i],
  condition: (o, i) => o.condition[i], alarm: urgency, urgency,
};

// Each loop's position in the order of tags. It is computed once per list, because comparing texts takes most of the time.
const ranks = new WeakMap();
function tagRanks(loops) {
  if (!ranks.has(loops)) {
    const rank = [];
    loops.map((_, i) => i).sort((a, b) => byTag(loops[a].tag, loops[b].tag)).forEach((i, k) => { rank[i] = k; });
    ranks.set(loops, rank);
  }
  return ranks.get(loops);
}

function matches(loop, words) {
  const text = `${loop.tag} ${loop.description ?? ''} ${loop.area ?? ''}`.toLowerCase();
  return words.every((word) => text.includes(word));
}

// Returns the indexes of the loops in `o`, in display order. Loops without a value are last in both directions. Equal loops are in the order
// of tags. `grave`: tags of loops with such an alarm.
export function arranged(loops, o, {filter = 'all', search = '', sort = 'urgency', descending = true, grave = new Set()} = {}) {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  const keep = FILTERS[filter] ?? FILTERS.all;
  const places = [];
  for (let i = 0; i < loops.length; ++i) {
    if (matches(loops[i], words) && keep(o, i, loops[i])) places.push(i);
  }
  const turn = descending ? -1 : 1, rank = tagRanks(loops);
  if (sort === 'tag') return places.sort((a, b) => turn * (rank[a] - rank[b]));
  const keys = new Map(places.map((i) => [i, KEYS[sort]?.(o, i, grave.has(loops[i].tag), loops[i]) ?? null]));
  return places.sort((a, b) => {
    const x = keys.get(a), y = keys.get(b);
    if (x === null || y === null) return (x === null) - (y === null) || rank[a] - rank[b];
    return turn * (x - y) || rank[a] - rank[b];
  });
}

export function counts(loops, o) {
  const result = {};
  for (const [name, keep] of Object.entries(FILTERS)) {
    result[name] = 0;
    for (let i = 0; i < loops.length; ++i) result[name] += keep(o, i, loops[i]) ? 1 : 0;
  }
  return result;
}

// Sorts lines of alarms: waiting ones first, then those that need action now, then the newest.
export function arrangedAlarms(lines, severe_percent) {
  const now = (line) => Number(line.grave(severe_percent) === 'high');
  return [...lines].sort((a, b) => (STATE_RANK[b.state] ?? 0) - (STATE_RANK[a.state] ?? 0) || now(b) - now(a) ||
    b.raised_ms - a.raised_ms || byTag(a.loop, b.loop));
}
