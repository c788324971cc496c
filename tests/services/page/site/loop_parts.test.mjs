// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import './document.mjs';

const {alarmNow, alarmSize, alarmTable, commissioningText, healthTable, judgesOf, measureTable} = await import('../../../../services/page/site/views/loop_parts.js');

const wordsOf = (node) => (typeof node === 'object' ? node.children.map(wordsOf).join('') || node.textContent || '' : String(node)).replaceAll('\u00a0', ' ');
const all = (node, name) => (typeof node === 'object' ? [...(node.name === name ? [node] : []), ...node.children.flatMap((child) => all(child, name))] : []);
const cellsOf = (table) => all(table, 'tr').slice(1).map((row) => row.children.map(wordsOf));

const LOOP = {tag: 'FIC-101', pv_range: [0, 10], pv_unit: 'L/min', specialists: [], monitor: true, twin: false};
const design = (alarm, more = {}) => ({alarm, priority: 'medium', limit: null, dead_band: null, unit: '', on_delay_s: 10, off_delay_s: 10, suppressed_by: [], time_to_act: 'the shift', ...more});

test('an alarm of a loop has its limit with unit, its delays and its present state, process alarms first', () => {
  const node = alarmTable([design('stiction', {priority: 'low', on_delay_s: null, off_delay_s: null, suppressed_by: ['low_air_supply']}), design('pv_high', {limit: 8, dead_band: 0.1, unit: 'L/min', on_delay_s: 60})], LOOP,
    (alarm) => (alarm === 'stiction' ? 'acknowledged' : 'normal'));
  assert.deepEqual(cellsOf(node), [['PV high', 'medium', '8.00 L/min', '0.10 L/min', '1 min, 10 s', '', 'the shift', 'normal'],
    ['Stiction', 'low', '', '', '', 'Low air supply', 'the shift', 'acknowledged']]);
  assert.doesNotMatch(wordsOf(node), /no PV limits/);
  assert.match(wordsOf(alarmTable([design('bad_pv')], LOOP, () => 'normal')), /no PV limits/);
});

test('an alarm is suppressed by another one, or can’t be raised at present', () => {
  assert.equal(alarmNow({state: 'suppressed', consequence: true}), 'suppressed');
  assert.equal(alarmNow({state: 'suppressed', consequence: false}), 'cannot be raised at present');
  assert.equal(alarmNow({state: 'acknowledged', consequence: false}), 'acknowledged');
});

test('the detectors that judge the valve are shown, or that there are none', () => {
  assert.equal(judgesOf({...LOOP, specialists: ['no_fault', 'stiction', 'backlash', 'other'], twin: true}), 'specialists for stiction, backlash; routine evidence; its twin');
  assert.equal(judgesOf(LOOP), 'routine evidence');
  assert.match(judgesOf({...LOOP, monitor: false}), /^no detector/);
});

test('the user who commissions a loop is shown, with begin and automatic end', () => {
  assert.equal(commissioningText(null), 'In maintenance');
  const text = (left) => commissioningText({by: 'uid 0', since_ms: 1800000000000, ends_in_s: left});
  assert.match(text(57.4), /^In maintenance by uid 0 since 2027-01-15.*only select manual\.; ends in 57 s if the session stays silent$/);
  assert.match(text(0), /session silent: stop action$/);
});

const MONITOR = {window_state: 'valid', windows: 3, windows_suppressed: 0, oscillation_index: 0, oscillation_period_s: 0, variability_percent: 0, mean_error_percent: 0, saturated_percent: 0, bridged_cycles: 0, travel_percent_per_hour: 0,
  reversals_per_hour: 0, stick_percent: null, stick_source: 'none', hours_automatic: 0, hours_manual: 0, hours_at_limit: 0};

test('before the first window there are no measured values, and no measure is good', () => {
  const variability = (windows) => cellsOf(measureTable({...MONITOR, windows})).find(([name]) => name.startsWith('Variability'))[1];
  assert.equal(variability(3), '0.00 %');
  assert.equal(variability(0), '–');
  assert.doesNotMatch(wordsOf(measureTable({...MONITOR, windows: 0})), /regularity/);
});

test('the times in automatic, in manual and at a limit have suitable units', () => {
  const [, said] = cellsOf(measureTable({...MONITOR, hours_automatic: 0.00728, hours_manual: 50})).at(-1);
  assert.equal(said.replaceAll('\u2009', ' '), '26 s, 2 d 2 h, 0 s');
});

test('a window without oscillation says so of the window, not of the loop', () => {
  const said = (more) => cellsOf(measureTable({...MONITOR, ...more})).find(([name]) => name === 'Oscillation')[1];
  assert.equal(said({oscillation_index: 0.7}), 'not in this window (regularity 0.7)');
  assert.equal(said({oscillation_index: 2, oscillation_period_s: 40}), 'every 40 s, regularity 2');
});

test('a PV that is older than the daemon was never received', () => {
  const io = {connected: false}, recording = {rows: 0, dropped: 0, rows_lost: 0, bytes: 0}, pvAge = (pv_age_ms) => cellsOf(healthTable({io, recording, pv_age_ms, time_s: 60})).find(([name]) => name === 'PV age')[1];
  assert.equal(pvAge(120), '120 ms');
  assert.equal(pvAge(45_000), '45 s');
  assert.equal(pvAge(1_200_000), 'never received');
  assert.equal(pvAge(null), '–');
});

test('an alarm has one size: an explanation that agrees replaces the estimate of the detector', () => {
  const plain = (text) => text.replaceAll('\u00a0', ' '), e = {agrees: true, final_name: null, size_percent: 9.9, low_percent: 8.1, high_percent: 11.4};
  assert.equal(plain(alarmSize(6.4, 7, null)), '6.4 %, worst 7.0 %');
  assert.equal(plain(alarmSize(6.4, 7, e)), '9.9 % (8.1 to 11.4 %) of the CO span, by the explanation. It replaces the estimate of the detector, 6.4 %.');
  assert.equal(plain(alarmSize(6.4, 7, {...e, agrees: false})), '6.4 %, worst 7.0 %');
});
