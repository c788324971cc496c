// SPDX-License-Identifier: Apache-2.0
// The lines that an operator sees: an incident with the alarms that it raised is one, any other alarm is its own. Pure.
import {BOX, priority, shown, waits} from './codes.js';

// A line: loop, state, what it is about (`incident` or `alarm`), and the alarms that hang on it, the newest first.
function incidentLine(incident, alarms) {
  const waiting = alarms.find((alarm) => waits(alarm.state)), on = alarms.find((alarm) => alarm.active);
  const sized = alarms.filter((alarm) => typeof alarm.severity_percent === 'number').sort((a, b) => b.severity_percent - a.severity_percent)[0];
  return {loop: incident.loop, incident, alarms, name: incident.name, raised_ms: 1000 * incident.raised_s,
    state: waiting?.state ?? on?.state ?? alarms[0].state, active: Boolean(on), size: sized?.alarm === incident.name ? sized.severity_percent : null,
    grave: (severe) => (alarms.some((alarm) => priority(alarm, severe) === 'high') ? 'high' : 'low')};
}

const alarmLine = (alarm) => ({loop: alarm.loop, alarm, alarms: [alarm], name: alarm.alarm, raised_ms: alarm.raised_ms, state: alarm.state,
  active: alarm.active, size: alarm.severity_percent, firstOut: alarm.first_out, grave: (severe) => priority(alarm, severe)});

export function linesOf(alarms, incidents) {
  const seen = alarms.filter((alarm) => shown(alarm.state) || alarm.active), lines = [], told = new Set();
  for (const incident of incidents) {
    const its = seen.filter((alarm) => alarm.loop === incident.loop && incident.alarms.includes(alarm.alarm));
    // On the shelf all of them: each has its own time there.
    if (!its.some((alarm) => shown(alarm.state) && alarm.state !== 'shelved')) continue;
    its.sort((a, b) => b.raised_ms - a.raised_ms).forEach((alarm) => told.add(alarm));
    lines.push(incidentLine(incident, its));
  }
  const all = lines.concat(seen.filter((alarm) => !told.has(alarm) && shown(alarm.state)).map(alarmLine));
  // First is only what something else has followed; what the box has does not follow from each other.
  return all.map((line) => ({...line, firstOut: line.firstOut && line.loop !== BOX && all.some((other) => other !== line && other.loop === line.loop)}));
}

// Where the loop of a line or alarm is shown, or the box that has it.
export const ownerHref = (loop) => (loop === BOX ? '#/system' : `#/loop/${encodeURIComponent(loop)}`);
export const ofBox = ({loop}) => loop === BOX;

// Of the line in the address: a loop's incident, or one of its alarms.
export const INCIDENT = 'incident';
export const partOf = (line) => (line.incident ? INCIDENT : line.alarm.alarm);
