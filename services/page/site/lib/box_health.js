// SPDX-License-Identifier: Apache-2.0
// Describes the health of the box in words. Pure.
import {BOX} from './codes.js';
import {arrangedAlarms} from './order.js';
import {bytes, count, duration} from './format.js';
import {linesOf, ofBox} from './incidents.js';
import {signOf} from './state.js';
import {changeName, fill, texts} from '../texts.js';

const t = texts.system;
const LOW_SHARE = 0.05; // of the disk
const NAMED = 5; // loops of one warning

// Returns warnings, each {text, sign}, for an alarm also href and since_ms. daemon, loops, disk: as in the system's answer; alarms: all present
// alarms; out: result of outages(); severe: %; time(ms): on the wall's clock.
export function warningsOf({daemon: d, loops, disk}, alarms, out, severe, time) {
  const c = d.configuration ?? {}, list = [], its = arrangedAlarms(linesOf(alarms.filter(ofBox), []), severe).filter((line) => line.state !== 'shelved'), stands = (name) => its.some((line) => line.name === name);
  const add = (when, text, values = {}) => { if (when) list.push({text: fill(text, values), sign: 'low'}); };
  const lost = (d.feeders ?? []).filter((feeder) => !feeder.connected).map(({name}) => name);
  for (const line of its) {
    const named = line.alarms[0].about || (line.name === 'feeder_lost' ? lost.join(', ') : ''), which = named ? fill(t.which, {names: named}) : '';
    list.push({text: fill(t.alarm, {alarm: changeName(line.name), which, state: texts.alarmStates[line.state] ?? texts.alarmStates.other, time: time(line.raised_ms)}), sign: signOf(line.state, line.grave(severe)),
      href: `#/alarms/${BOX}/${encodeURIComponent(line.name)}`, since_ms: line.active ? line.raised_ms : null});
  }
  const told = new Set(out.flatMap(([, tags]) => tags));
  for (const [why, tags] of out) {
    const more = tags.length - NAMED;
    add(true, more > 0 ? t.loopsMore : t.loops, {why, tags: tags.slice(0, NAMED).join(', '), more});
  }
  add(d.real_time_missing, t.noRealTime, {text: d.real_time_missing});
  add(d.overruns > 0, t.overrunsWarn, {n: count(d.overruns), all: count(d.ticks)});
  add(d.events_dropped > 0, t.eventsLost, {n: count(d.events_dropped)});
  add(d.journal?.error, t.journalError, {text: d.journal?.error});
  add(d.journal?.damaged > 0, t.journalDamaged, {n: d.journal?.damaged});
  add(d.evidence?.error, t.evidenceError, {text: d.evidence?.error});
  add(d.recorder?.disk_wait_s > 1, t.diskWait, {long: duration(d.recorder?.disk_wait_s)});
  add(!stands('disk_full') && disk && disk.free_bytes < LOW_SHARE * disk.bytes, t.diskFull, {free: bytes(disk?.free_bytes), all: bytes(disk?.bytes)});
  if (!stands('feeder_lost')) for (const name of lost) add(true, t.feederAway, {name});
  for (const waiting of c.waiting_for_restart ?? []) add(true, t.waitingRestart, waiting);
  for (const waiting of c.waiting_for_output ?? []) add(true, t.waitingOutput, waiting);
  add(c.refused?.length, t.refusedFile, {text: [c.refused].flat().join('; ')});
  for (const {loop, io, recording} of loops) {
    const missing = recording.dropped + (recording.queue_dropped ?? 0) + recording.rows_lost;
    add(!io.connected && !told.has(loop), t.linkDown, {loop});
    add(missing > 0, t.rowsLost, {loop, n: count(missing)});
  }
  return list;
}

// Returns [words, sign]. told: whether the box has sent its alarms and loops. Otherwise the health is never shown as good.
export function verdictOf(warnings, told, started_ms, time) {
  if (!warnings.length) return told ? [fill(t.well, {time: time(started_ms)}), 'ok'] : [t.untold, 'bad'];
  const since = warnings.map(({since_ms}) => since_ms).filter(Boolean).sort((a, b) => a - b)[0], one = warnings.length === 1;
  const words = since ? (one ? t.oneSince : t.someSince) : one ? t.oneWarning : t.someWarnings;
  return [fill(words, {n: warnings.length, time: since ? time(since) : ''}), warnings.some(({sign}) => sign === 'high') ? 'high' : 'low'];
}
