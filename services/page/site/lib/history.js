// SPDX-License-Identifier: Apache-2.0
// Stretches of a loop's history as the server gives them: columns over `t` (UTC, ms). Pure.

// `sample`: 1 where a row's values were measured together, 0 where they are extremes of a stretch.
export const COLUMNS = ['pv', 'sp', 'co', 'stem', 'mode', 'sample'];

function first(times, at) { // place of the first time that is not before `at`
  let a = 0, b = times.length;
  while (a < b) {
    const m = (a + b) >> 1;
    if (times[m] < at) a = m + 1; else b = m;
  }
  return a;
}

// `whole` with what `tail` knows better: from its first row on the tail is right. Neither is changed.
export function merged(whole, tail) {
  if (!whole || !whole.t.length) return tail;
  if (!tail.t.length) return {...whole, newest_ms: tail.newest_ms ?? whole.newest_ms};
  const cut = first(whole.t, tail.t[0]);
  const result = {...whole, newest_ms: tail.newest_ms, oldest_ms: tail.oldest_ms, t: whole.t.slice(0, cut).concat(tail.t)};
  for (const name of COLUMNS) {
    if (!whole[name] && !tail[name]) continue;
    const empty = (n) => Array(n).fill(null);
    result[name] = (whole[name] ?? empty(whole.t.length)).slice(0, cut).concat(tail[name] ?? empty(tail.t.length));
  }
  return result;
}

// Without the rows before `from_ms`, but for one, so that the line begins at the edge.
export function trimmed(history, from_ms) {
  const cut = Math.max(0, first(history.t, from_ms) - 1);
  if (!cut) return history;
  const result = {...history, t: history.t.slice(cut)};
  for (const name of COLUMNS) if (history[name]) result[name] = history[name].slice(cut);
  return result;
}

// Lowest and highest of the columns within a stretch; null where there is nothing.
export function extent(history, names, from_ms = -Infinity, to_ms = Infinity) {
  let low = Infinity, high = -Infinity;
  const a = first(history.t, from_ms), b = first(history.t, to_ms);
  for (const name of names) {
    const column = history[name];
    if (!column) continue;
    for (let i = a; i < b; ++i) {
      const v = column[i];
      if (v === null || v === undefined) continue;
      if (v < low) low = v;
      if (v > high) high = v;
    }
  }
  return low <= high ? [low, high] : null;
}

// What a scale shows of values between low and high: some room around, and never less than `share` of the range, so that
// noise does not look like a storm.
export function scaleOf(found, range, share = 0.02) {
  const span = range ? range[1] - range[0] : 1;
  if (!found) return range ? [range[0], range[1]] : [0, 1];
  let [low, high] = found;
  const least = share * span;
  if (high - low < least) {
    const middle = (low + high) / 2;
    low = middle - least / 2;
    high = middle + least / 2;
  }
  const room = 0.08 * (high - low);
  return [low - room, high + room];
}

// Row nearest to a time; -1 in an empty stretch.
export function nearest(times, at) {
  if (!times.length) return -1;
  const i = first(times, at);
  if (i === 0) return 0;
  if (i === times.length) return i - 1;
  return at - times[i - 1] <= times[i] - at ? i - 1 : i;
}

// Span of time between two limits, not shorter than `least` and kept within them as far as it fits.
export function kept([from, to], [low, high], least) {
  const width = Math.min(Math.max(to - from, least), Math.max(high - low, least));
  const begin = Math.min(Math.max((from + to - width) / 2, low), Math.max(high - width, low));
  return [begin, begin + width];
}

// The last ten minutes of a value as first, lowest, highest and last of equal steps, as the server's sparklines have them.
export class Spark {
  constructor(steps, step_s) {
    this.step_s = step_s;
    this.steps = new Array(4 * steps).fill(null);
    this.step = null; // number of the newest step
    this.version = 0;
  }
  // `steps`: first, lowest, highest and last of each, the newest step last.
  load(steps, step_s) {
    this.step_s = step_s;
    this.steps = steps.slice();
    this.step = null;
    ++this.version;
  }
  // `time_s`: of the plant, which an accelerated one runs through faster. The version tells when it must be drawn anew: with a new step
  // or a new extreme.
  add(time_s, value) {
    const step = Math.floor(time_s / this.step_s), n = this.steps.length;
    if (this.step === null) this.step = step;
    if (step < this.step) this.step = step; // the daemon has started again
    const moved = Math.min(step - this.step, n / 4);
    if (moved) {
      this.steps.splice(0, 4 * moved);
      this.steps.push(...new Array(4 * moved).fill(null));
      ++this.version;
    }
    this.step = step;
    if (typeof value !== 'number') return;
    const [first, low, high] = this.steps.slice(n - 4);
    if (first === null) this.steps.splice(n - 4, 4, value, value, value, value);
    else this.steps.splice(n - 3, 3, Math.min(low, value), Math.max(high, value), value);
    if (!moved && (first === null || value < low || value > high)) ++this.version;
  }
}

// How a strip of steps is drawn, x in steps: `lines` go through the first and last value of each, so that a smooth fall is one and a
// step a step; `bars` are where a step went beyond them.
export function strip(steps) {
  const lines = [], bars = [];
  let line = null;
  for (let k = 0; 4 * k < steps.length; ++k) {
    const [first, low, high, last] = steps.slice(4 * k, 4 * k + 4);
    if (first === null || first === undefined) { line = null; continue; }
    if (!line) lines.push(line = []);
    line.push([k + 0.25, first], [k + 0.75, last]);
    if (low < Math.min(first, last) || high > Math.max(first, last)) bars.push([k + 0.5, low, high]);
  }
  return {lines, bars};
}

const SECOND = 1000, MINUTE = 60 * SECOND, HOUR = 60 * MINUTE, DAY = 24 * HOUR;
const STEPS_MS = [1, 2, 5, 10, 20, 50, 100, 200, 500, SECOND, 2 * SECOND, 5 * SECOND, 10 * SECOND, 15 * SECOND, 30 * SECOND,
  MINUTE, 2 * MINUTE, 5 * MINUTE, 10 * MINUTE, 15 * MINUTE, 30 * MINUTE, HOUR, 2 * HOUR, 3 * HOUR, 6 * HOUR, 12 * HOUR,
  DAY, 2 * DAY, 7 * DAY, 14 * DAY, 28 * DAY, 91 * DAY, 182 * DAY, 364 * DAY];

// Times for the marks of an axis, at most about `most`, at round times of a wall clock that is `offset_ms` before UTC.
export function timeMarks(from_ms, to_ms, most, offset_ms) {
  const step = STEPS_MS.find((s) => (to_ms - from_ms) / s <= most) ?? STEPS_MS.at(-1);
  const marks = [];
  for (let at = Math.ceil((from_ms + offset_ms) / step) * step - offset_ms; at <= to_ms; at += step) marks.push(at);
  return {step, marks};
}
