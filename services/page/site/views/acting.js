// SPDX-License-Identifier: Apache-2.0
// Actions of an operator on a loop or an alarm. Each action on the process first shows tag, old and new value again.
import {ask, field, toast} from '../lib/dialog.js';
import {decimalsFor, fixed} from '../lib/format.js';
import {el, facts, unit} from '../lib/dom.js';
import {get, loopPath, post, query} from '../lib/api.js';
import {live} from '../lib/live.js';
import {GAINS} from '../lib/tuning.js';
import {MODES} from '../lib/codes.js';
import {wall} from '../lib/shell.js';
import {changeName, fill, ownerName, texts} from '../texts.js';

const t = texts.acting;
const ta = texts.alarm;

export const operator = () => ['operator', 'engineer'].includes(live.session.role) && Boolean(live.session.user);

// Commands that a user can send: key, name, unit, limits, value in force. The stream rounds values; this requests all their digits,
// because a change is refused if the value in force differs from the one that the operator saw.
async function quantityOf(loop, what) {
  const o = live.overview, i = live.places.get(loop.tag);
  if (what === 'mode') return {what, name: t.mode, now: MODES[o.requested_mode[i]] ?? null};
  const setPoint = what === 'set_point', now = await get(loopPath(loop.tag));
  const range = setPoint ? loop.pv_range : loop.co_range;
  return {what, name: setPoint ? t.setPoint : t.output, unit: setPoint ? loop.pv_unit : loop.co_unit, limits: setPoint ? loop.sp_limits : loop.output_limits,
    decimals: decimalsFor(range), now: (setPoint ? now.set_point_wanted ?? now.sp : now.co) ?? null};
}

const shownValue = (q, value) => {
  if (value === null) return texts.notKnown;
  if (q.what === 'mode') return texts.modes[value] ?? texts.notKnown;
  // A typed value is shown as typed, even with more digits than the display.
  const typed = String(Number(value?.toPrecision(7))).split('.')[1]?.length ?? 0;
  return `${fixed(value, Math.min(6, Math.max(q.decimals, typed)))}${q.unit ? ` ${q.unit}` : ''}`;
};

function entry(q) {
  if (q.what === 'mode') {
    const choice = (mode) => el('label', {class: 'choice'}, el('input', {type: 'radio', name: 'value', value: mode, required: true,
      checked: mode === q.now}), `${texts.modes[mode]} (${texts.modesLong[mode]})`);
    return el('fieldset', {}, el('legend', {}, t.new), choice('automatic'), choice('manual'), el('small', {}, t.modeHint));
  }
  const [low, high] = q.limits;
  const input = el('input', {name: 'value', type: 'text', inputmode: 'decimal', autocomplete: 'off', required: true, value: q.now === null ? '' : fixed(q.now, q.decimals)});
  setTimeout(() => input.select());
  return el('div', {class: 'entry'}, field(t.new, input, fill(t.range, {low, high, unit: q.unit ?? ''})), unit(q.unit));
}

function read(q, text) {
  if (q.what === 'mode') return text;
  const value = Number(String(text).trim().replace(',', '.'));
  const [low, high] = q.limits;
  if (text.trim() === '' || !Number.isFinite(value) || value < low || value > high) throw new Error(fill(t.invalid, {low, high}));
  return value;
}

export async function order(loop, what) {
  let q;
  try {
    q = await quantityOf(loop, what);
  } catch (error) {
    toast(fill(t.refused, {why: error.message}));
    return;
  }
  ask({
    title: fill(t.title, {what: q.name, tag: loop.tag}), label: texts.goOn,
    body: [el('p', {}, `${t.now}: `, el('strong', {class: 'value'}, shownValue(q, q.now))), entry(q)],
    accept: async (data) => {
      const value = read(q, String(data.get('value')));
      if (value === q.now) throw new Error(t.same);
      setTimeout(() => confirm(loop, q, value));
    },
  });
}

// Shows in `node`, a fact that was hidden, who set the value in force, from the journal's newest line about it.
async function nameAuthor(node, tag, what) {
  let line = null;
  try {
    const {lines} = await get(`/api/journal${query({loop: tag, most: 50})}`);
    line = lines.find((one) => one.what.replaceAll(' ', '_') === what && one.result === 'done');
  } catch {
    // Then it stays unknown.
  }
  node.textContent = line ? fill(t.setBy, {who: line.peer || texts.journal.daemon, time: wall().dateTime(line.utc_ms)}) : texts.notKnown;
  node.closest('.facts > div').hidden = false;
}

// The value in force, who set it, and the requested one.
function confirm(loop, q, value) {
  const old = el('span', {}, shownValue(q, q.now)), author = el('span', {}), rows = facts([[t.tag, loop.tag], [t.what, q.name], [t.now, old], [t.author, author], [t.yours, el('strong', {}, shownValue(q, value))]]);
  author.closest('.facts > div').hidden = true;
  ask({
    title: t.confirmTitle, grave: true, label: fill(t.apply, {tag: loop.tag, value: shownValue(q, value)}),
    body: [el('p', {}, t.confirm), rows],
    accept: async () => {
      let answer;
      try {
        answer = await post(loopPath(loop.tag, 'order'), {set: {[q.what]: value}, confirm: {tag: loop.tag, old: q.now, new: value}});
      } catch (error) {
        if (error.status !== 409 || error.body.now === undefined) throw error;
        // The operator decides again, with the value that is now in force.
        q.now = error.body.now;
        old.textContent = shownValue(q, q.now);
        await nameAuthor(author, loop.tag, q.what);
        throw new Error(fill(t.conflict, {value: shownValue(q, q.now)}));
      }
      if (answer.state === 'refused') throw new Error(fill(t.refused, {why: answer.why}));
      toast(answer.state === 'done' ? fill(t.done, {tag: loop.tag, what: q.name, value: shownValue(q, value)}) : t.waiting);
    },
  });
}

// Shows old and new gains again, then sets them. `after`: called when they are in force. `ms`: a maximum sensitivity that is too high, which
// the user must confirm; null: it is not.
export function tune(loop, old, wanted, after, ms = null) {
  const tt = texts.tuning, text = (gains) => GAINS.map((name) => `${name} ${gains[name]}`).join(', ');
  const was = el('span', {}, text(old)), author = el('span', {}), rows = facts([[t.tag, loop.tag], [tt.old, was], [t.author, author], [tt.new, el('strong', {}, text(wanted))]]);
  author.closest('.facts > div').hidden = true;
  ask({
    title: t.confirmTitle, grave: true, label: fill(tt.set, {tag: loop.tag}), body: [el('p', {}, tt.confirm), rows, ms === null ? null : el('label', {class: 'choice trouble'}, el('input', {type: 'checkbox', name: 'margin', required: true}), Number.isFinite(ms) ? fill(tt.margin, {ms: fixed(ms, 1)}) : tt.unstable)],
    accept: async () => {
      let answer;
      try {
        answer = await post(loopPath(loop.tag, 'tuning'), {set: wanted, confirm: {tag: loop.tag, old, new: wanted}});
      } catch (error) {
        if (error.status !== 409 || error.body.now === undefined) throw error;
        old = error.body.now;
        was.textContent = text(old);
        await nameAuthor(author, loop.tag, 'gains');
        throw new Error(fill(tt.conflict, {gains: text(old)}));
      }
      if (answer.state === 'refused') throw new Error(fill(t.refused, {why: answer.why}));
      toast(answer.state === 'done' ? fill(tt.done, {tag: loop.tag}) : t.waiting);
      after();
    },
  });
}

const MINUTES = [15, 30, 60, 120, 240, 480];

// Acknowledge, reset, shelve, unshelve.
export function act(loop, alarm, action) {
  const names = {loop: ownerName(loop), alarm: changeName(alarm)}, shelve = action === 'shelve';
  const minutes = el('select', {name: 'minutes'}, MINUTES.filter((m) => m <= (live.describe.alarms?.shelve_limit_min ?? 480)).map((m) => el('option', {value: m, selected: m === 60},
    m < 60 ? fill(ta.minutesUnit, {n: m}) : fill(ta.hoursUnit, {n: m / 60}))));
  const reason = el('input', {name: 'reason', maxlength: 200, required: shelve, autocomplete: 'off'});
  ask({
    title: fill(ta.dialog[action], names), label: ta[action].replace(' …', ''),
    body: [shelve ? field(ta.minutes, minutes) : null, field(shelve ? ta.reason : ta.reasonOptional, reason)],
    accept: async (data) => {
      const body = {action, reason: String(data.get('reason') ?? '')};
      if (shelve) body.minutes = Number(data.get('minutes'));
      const answer = await post(loopPath(loop, 'alarms', alarm), body);
      const state = answer.alarm?.state;
      toast(answer.on_disk === false ? ta.notOnDisk : fill(ta.done, {...names, state: texts.alarmStates[state] ?? ''}));
      live.dispatchEvent(new Event('acted'));
    },
  });
}

const NAMED = 8;
// Acknowledges several lines of the list with one reason.
export function acknowledgeLines(lines) {
  const reason = el('input', {name: 'reason', maxlength: 200, autocomplete: 'off'}), more = lines.length - NAMED;
  const named = lines.slice(0, NAMED).map((line) => el('li', {}, `${ownerName(line.loop)}: ${changeName(line.name)}`));
  ask({
    title: fill(ta.dialog.several, {n: lines.length}), label: ta.acknowledge,
    body: [el('ul', {class: 'chosen-lines'}, named, more > 0 ? el('li', {}, fill(ta.andMore, {n: more})) : null), field(ta.reasonOptional, reason)],
    accept: async (data) => {
      const body = {action: 'acknowledge', reason: String(data.get('reason') ?? '')};
      let onDisk = true;
      for (const {loop, incident, alarm} of lines) {
        const answer = await post(incident ? loopPath(loop, 'incidents', incident.id) : loopPath(loop, 'alarms', alarm.alarm), body);
        onDisk &&= answer.on_disk !== false;
      }
      toast(onDisk ? fill(ta.doneSeveral, {n: lines.length}) : ta.notOnDisk);
      live.dispatchEvent(new Event('acted'));
    },
  });
}

// Acknowledges all waiting alarms of an incident.
export function acknowledgeIncident(incident, name) {
  const names = {loop: incident.loop, alarm: name};
  const reason = el('input', {name: 'reason', maxlength: 200, autocomplete: 'off'});
  ask({
    title: fill(ta.dialog.acknowledge, names), label: ta.acknowledge, body: [field(ta.reasonOptional, reason)],
    accept: async (data) => {
      const answer = await post(loopPath(incident.loop, 'incidents', incident.id), {action: 'acknowledge', reason: String(data.get('reason') ?? '')});
      toast(answer.on_disk === false ? ta.notOnDisk : fill(ta.done, {...names, state: texts.alarmStates.acknowledged}));
      live.dispatchEvent(new Event('acted'));
    },
  });
}
