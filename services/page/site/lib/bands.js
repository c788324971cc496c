// SPDX-License-Identifier: Apache-2.0
// Finds from the journal's lines when an alarm's condition was on. Pure.
import {priority} from './codes.js';

const ON = new Set(['unacknowledged', 'acknowledged']);
// A line doesn't report the condition of a shelved or suppressed alarm: the condition is taken as unchanged.
const UNTOLD = new Set(['shelved', 'suppressed']);

// `lines`: newest first. `standing`: the loop's present alarms. Returns {alarm, from_ms, to_ms (null: still on)}, oldest first.
export function bandsOf(lines, standing) {
  const bands = [], open = new Map();
  for (const line of [...lines].reverse()) {
    if (line.kind !== 'alarm' || !line.alarm || UNTOLD.has(line.to)) continue;
    if (ON.has(line.to)) {
      if (open.has(line.alarm)) continue;
      const band = {alarm: line.alarm, from_ms: line.utc_ms, to_ms: null};
      open.set(line.alarm, band);
      bands.push(band);
    } else if (open.has(line.alarm)) {
      open.get(line.alarm).to_ms = line.utc_ms;
      open.delete(line.alarm);
    } else if (ON.has(line.from)) { // raised before the first line
      bands.push({alarm: line.alarm, from_ms: -Infinity, to_ms: line.utc_ms});
    }
  }
  for (const alarm of standing) {
    if (alarm.active && !open.has(alarm.alarm)) {
      bands.push({alarm: alarm.alarm, from_ms: alarm.raised_ms, to_ms: null});
    }
  }
  return bands.sort((a, b) => a.from_ms - b.from_ms);
}

// Assigns a lane to each band, so that bands of the same time are below each other. Adds `lane` and returns the number of lanes.
export function lanes(bands) {
  const ends = [];
  for (const band of bands) {
    let lane = ends.findIndex((end) => end <= band.from_ms);
    if (lane < 0) lane = ends.length;
    ends[lane] = band.to_ms ?? Infinity;
    band.lane = lane;
  }
  return ends.length;
}

// Returns the bands of some loops in a span, each with `lane`, `label` and `priority`. lines: by tag; standing: all present alarms.
export function bandsIn(tags, lines, standing, [from, to], severe_percent, nameOf) {
  const bands = tags.flatMap((tag) => {
    const its = standing.filter((alarm) => alarm.loop === tag);
    return bandsOf(lines.get(tag) ?? [], its).map((band) => ({...band, label: nameOf(tag, band.alarm),
      priority: priority(its.find((alarm) => alarm.alarm === band.alarm) ?? band, severe_percent)}));
  });
  const seen = bands.filter((band) => (band.to_ms ?? Infinity) >= from && band.from_ms <= to).sort((a, b) => a.from_ms - b.from_ms);
  lanes(seen);
  return seen;
}
