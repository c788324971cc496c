// SPDX-License-Identifier: Apache-2.0
// When an alarm's condition was on, from the journal's lines. Pure.
import {priority} from './codes.js';

const ON = new Set(['unacknowledged', 'acknowledged']);
// What lies under shelf and suppression is not in the line: the condition stays as it was.
const UNTOLD = new Set(['shelved', 'suppressed']);

// `lines`: newest first. `standing`: the loop's alarms now. Gives {alarm, from_ms, to_ms (null: still on)}, the oldest first.
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
    } else if (ON.has(line.from)) { // it came before the lines begin
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

// A lane for each, so that bands of the same time lie below each other. Adds `lane` and gives how many there are.
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

// What is seen of some loops in a span, each with `lane`, `label` and `priority`. lines: by tag; standing: all alarms that are there.
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
