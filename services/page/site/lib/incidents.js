// SPDX-License-Identifier: Apache-2.0
// Makes the lines that an operator sees: one line for an incident with its alarms, and one for each other alarm. Pure.
import {BOX, HASTES, PRIORITIES, haste, priority, shown, waits} from './codes.js';

// A line: loop, state, its subject (`incident` or `alarm`), and its alarms, newest first.
function incidentLine(incident, alarms) {
  const waiting = alarms.find((alarm) => waits(alarm.state)), on = alarms.find((alarm) => alarm.active);
  const sized = alarms.filter((alarm) => typeof alarm.severity_percent === 'number').sort((a, b) => b.severity_percent - a.severity_percent)[0];
  return {loop: incident.loop, incident, alarms, name: incident.name, raised_ms: 1000 * incident.raised_s,
    state: waiting?.state ?? on?.state ?? alarms[0].state, active: Boolean(on), size: sized?.alarm === incident.name ? sized.severity_percent : null,
    grave: (severe) => (alarms.some((alarm) => priority(alarm, severe) === 'high') ? 'high' : 'low'),
    haste: (severe) => HASTES.find((one) => alarms.some((alarm) => haste(alarm, severe) === one))};
}

const alarmLine = (alarm) => ({loop: alarm.loop, alarm, alarms: [alarm], name: alarm.alarm, raised_ms: alarm.raised_ms, state: alarm.state,
  active: alarm.active, size: alarm.severity_percent, firstOut: alarm.first_out, grave: (severe) => priority(alarm, severe), haste: (severe) => haste(alarm, severe)});

// Identifies a line in the list, also after its alarms have changed.
export const keyOf = (line) => `${line.loop}\n${line.incident?.id ?? line.name}`;
// The highest priority of its alarms; empty: not reported.
export const priorityOf = (line) => PRIORITIES.find((one) => line.alarms.some((alarm) => alarm.priority === one)) ?? '';

export function linesOf(alarms, incidents) {
  const seen = alarms.filter((alarm) => shown(alarm.state) || alarm.active), lines = [], told = new Set();
  for (const incident of incidents) {
    const its = seen.filter((alarm) => alarm.loop === incident.loop && incident.alarms.includes(alarm.alarm));
    // If all alarms of the incident are shelved, each has its own line, because each has its own shelving time.
    if (!its.some((alarm) => shown(alarm.state) && alarm.state !== 'shelved')) continue;
    its.sort((a, b) => b.raised_ms - a.raised_ms).forEach((alarm) => told.add(alarm));
    lines.push(incidentLine(incident, its));
  }
  const all = lines.concat(seen.filter((alarm) => !told.has(alarm) && shown(alarm.state)).map(alarmLine));
  // An alarm is marked as the first only if others followed it. Alarms of the box are independent of each other.
  return all.map((line) => ({...line, firstOut: line.firstOut && line.loop !== BOX && all.some((other) => other !== line && other.loop === line.loop)}));
}

// Returns the address of the view that shows the loop of a line or alarm, or the box that has it.
export const ownerHref = (loop) => (loop === BOX ? '#/system' : `#/loop/${encodeURIComponent(loop)}`);
export const ofBox = ({loop}) => loop === BOX;

// Finds the line that the address names: a loop's incident, or one of its alarms.
export const INCIDENT = 'incident';
export const partOf = (line) => (line.incident ? INCIDENT : line.alarm.alarm);
