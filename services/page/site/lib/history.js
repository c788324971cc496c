// SPDX-License-Identifier: Apache-2.0
// Stretches of a loop's history as the server sends them: columns over `t` (UTC, ms). Pure.

// `sample`: 1 if a row's values were measured together, 0 if they are extremes of a stretch.
export const COLUMNS = ['pv', 'sp', 'co', 'stem', 'mode', 'sample'];

function first(times, at) { // index of the first time that is not before `at`
  let a = 0, b = times.length;
  while (a < b) {
    const m = (a + b) >> 1;
    if (times[m] < at) a = m + 1; else b = m;
  }
  return a;
}

// Returns `whole` updated with `tail`, which is valid from its first row on. Neither input is changed.
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

// Removes the rows before `from_ms` except the last of them, so that the line begins at the edge.
export function trimmed(history, from_ms) {
  const cut = Math.max(0, first(history.t, from_ms) - 1);
  if (!cut) return history;
  const result = {...history, t: history.t.slice(cut)};
  for (const name of COLUMNS) if (history[name]) result[name] = history[name].slice(cut);
  return result;
}

// Returns the lowest and highest value of the columns within a stretch; null if there are no values.
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

// Returns the limits of a scale for values between low and high, with some margin. Their distance is at least `share` of the range, so that
// noise is not magnified.
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

// Returns the row nearest to a time; -1 for an empty stretch.
export function nearest(times, at) {
  if (!times.length) return -1;
  const i = first(times, at);
  if (i === 0) return 0;
  if (i === times.length) return i - 1;
  return at - times[i - 1] <= times[i] - at ? i - 1 : i;
}

// Returns a time span of at least `least`, moved between the two limits as far as it fits.
export function kept([from, to], [low, high], least) {
  const width = Math.min(Math.max(to - from, least), Math.max(high - low, least));
  const begin = Math.min(Math.max((from + to - width) / 2, low), Math.max(high - width, low));
  return [begin, begin + width];
}

// Stores the last ten minutes of a value as first, lowest, highest and last of equal steps, like the server's sparklines.
export class Spark {
  constructor(steps, step_s) {
    this.step_s = step_s;
    this.steps = new Array(4 * steps).fill(null);
    this.step = null; // number of the newest step
    this.version = 0;
  }
  // `steps`: first, lowest, highest and last of each; the newest step is last.
  load(steps, step_s) {
    this.step_s = step_s;
    this.steps = steps.slice();
    this.step = null;
    ++this.version;
  }
  // Returns whether steps before the newest one have no value.
  get lacks() { return this.steps.some((value, k) => value === null && k < this.steps.length - 4); }
  // Sets the steps without a value from a history. `now_ms`: end of the newest step; `pace`: of the plant's time.
  fill({t, pv}, now_ms, pace = 1) {
    const n = this.steps.length / 4, empty = new Set();
    for (let k = 0; k < n - 1; ++k) if (this.steps[4 * k] === null) empty.add(k);
    for (let row = 0; row < t.length; ++row) {
      const k = n - 1 - Math.floor(pace * (now_ms - t[row]) / 1000 / this.step_s), value = pv[row];
      if (!empty.has(k) || typeof value !== 'number') continue;
      const [first, low, high] = this.steps.slice(4 * k, 4 * k + 3);
      this.steps.splice(4 * k, 4, first ?? value, Math.min(low ?? value, value), Math.max(high ?? value, value), value);
    }
    ++this.version;
  }
  // `time_s`: time of the plant, which is faster in an accelerated plant. The version changes with a new step or a new extreme: the strip must
  // then be redrawn.
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

// Returns how a strip of steps is drawn, x in steps. `lines` pass through the first and last value of each step, so that a smooth fall and
// a step keep their shapes. `bars` show extremes beyond the lines.
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

// Returns at most about `most` times for the marks of an axis, at round times of a wall clock that is `offset_ms` before UTC.
export function timeMarks(from_ms, to_ms, most, offset_ms) {
  const step = STEPS_MS.find((s) => (to_ms - from_ms) / s <= most) ?? STEPS_MS.at(-1);
  const marks = [];
  for (let at = Math.ceil((from_ms + offset_ms) / step) * step - offset_ms; at <= to_ms; at += step) marks.push(at);
  return {step, marks};
}
