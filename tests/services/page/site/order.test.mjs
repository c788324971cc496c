// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import {actionsOf, haste, priority, quality} from '../../../../services/page/site/lib/codes.js';
import {arranged, arrangedAlarms, counts, urgency} from '../../../../services/page/site/lib/order.js';

// Returns columns of healthy loops, with changes as {place: {column: value}}.
function overview(n, changes = {}) {
  const calm = {pv: 5, sp: 5, co: 50, mode: 1, fault: 0, quality: 192, flags: 0, ne107: 0, alarm: 0, alarm_kind: null, alarms_unacknowledged: 0, condition: 95};
  const o = {};
  for (const [name, value] of Object.entries(calm)) o[name] = Array(n).fill(value);
  for (const [i, change] of Object.entries(changes)) for (const [name, value] of Object.entries(change)) o[name][i] = value;
  return o;
}
const loops = (...tags) => tags.map((tag) => ({tag, description: `of ${tag}`}));

test('the worst loop is first, and equal loops are in the order of tags with their numbers', () => {
  const all = loops('FIC-10', 'FIC-9', 'FIC-1', 'FIC-2', 'FIC-3', 'FIC-4', 'FIC-5');
  const o = overview(7, {2: {alarm: 2}, 3: {alarm: 1, alarms_unacknowledged: 1}, 4: {fault: 2, ne107: 4}, 5: {condition: 20}, 6: {alarm: 6}});
  assert.deepEqual(arranged(all, o).map((i) => all[i].tag),
    ['FIC-2', 'FIC-3', 'FIC-1', 'FIC-5', 'FIC-4', 'FIC-9', 'FIC-10']);
});

test('a code that only a newer daemon has is never shown as normal', () => {
  const all = loops('A', 'B', 'C', 'D');
  const o = overview(4, {1: {fault: 99}, 2: {alarm: 99}, 3: {ne107: 99}});
  assert.deepEqual(arranged(all, o, {filter: 'abnormal'}).map((i) => all[i].tag), ['B', 'C']);
  for (const i of [1, 2, 3]) assert.ok(urgency(o, i) > urgency(o, 0), all[i].tag);
});

test('a small change of the condition doesn’t change the order', () => {
  assert.equal(urgency(overview(1, {0: {condition: 91}}), 0), urgency(overview(1, {0: {condition: 97}}), 0));
  assert.ok(urgency(overview(1, {0: {condition: 12}}), 0) > urgency(overview(1), 0));
});

test('filters count their loops', () => {
  const all = loops('A', 'B', 'C', 'D', 'E');
  const o = overview(5, {1: {alarm: 1}, 2: {mode: 0}, 3: {quality: 0}, 4: {condition: 30}});
  const tags = (filter) => arranged(all, o, {filter}).map((i) => all[i].tag);
  assert.deepEqual(tags('alarm'), ['B']);
  assert.deepEqual(tags('manual'), ['C']);
  assert.deepEqual(tags('fault'), ['D']);
  assert.deepEqual(tags('condition'), ['E']);
  assert.deepEqual(new Set(tags('abnormal')), new Set(['B', 'C', 'D', 'E']));
  assert.deepEqual(counts(all, o), {all: 5, abnormal: 4, alarm: 1, fault: 1, manual: 1, condition: 1});
});

test('a watched loop without values is a fault, and not in another mode', () => {
  const all = loops('A', 'B').map((loop) => ({...loop, control: 'elsewhere'}));
  const o = overview(2, {1: {fault: 2, quality: 0, mode: 2}});
  assert.deepEqual(counts(all, o), {all: 2, abnormal: 1, alarm: 0, fault: 1, manual: 0, condition: 0});
});

test('a suppressed alarm and a start are normal, and a shelved alarm waits on the shelf', () => {
  const all = loops('A', 'B', 'C');
  const o = overview(3, {0: {alarm: 7}, 1: {fault: 1}, 2: {alarm: 6}});
  assert.deepEqual(arranged(all, o, {filter: 'abnormal'}), []);
  assert.equal(arranged(all, o)[0], 2);
});

test('a loop that is out of service, stopped or unknown is abnormal', () => {
  const all = loops('A', 'B', 'C', 'D');
  const o = {...overview(4, {1: {fault: 7}, 3: {fault: null, mode: null, quality: null, ne107: null}}), stands: [false, false, true, false]};
  assert.deepEqual(arranged(all, o, {filter: 'abnormal'}).map((i) => all[i].tag), ['B', 'C', 'D']);
  assert.deepEqual(arranged(all, o, {filter: 'fault'}).map((i) => all[i].tag), ['B', 'C']);
  assert.ok(urgency(o, 2) > urgency(o, 0) && urgency(o, 3) > urgency(o, 0));
});

test('an unknown output is a fault, also during a start', () => {
  const all = loops('A', 'B'), o = overview(2, {1: {fault: 8, mode: 2, co: null}});
  assert.deepEqual(arranged(all, o, {filter: 'fault'}), [1]);
  assert.equal(arranged(all, o)[0], 1);
});

test('search finds all words, in tag and description', () => {
  const all = loops('FIC-101', 'FIC-102', 'TIC-101');
  const found = (search) => arranged(all, overview(3), {search}).map((i) => all[i].tag);
  assert.deepEqual(found('fic'), ['FIC-101', 'FIC-102']);
  assert.deepEqual(found('101 TIC'), ['TIC-101']);
  assert.deepEqual(found('of 102'), ['FIC-102']);
  assert.deepEqual(found('(['), []);
});

test('columns sort in both directions, with missing values last', () => {
  const all = loops('A', 'B', 'C');
  const o = overview(3, {0: {pv: 3}, 1: {pv: null}, 2: {pv: 7}});
  assert.deepEqual(arranged(all, o, {sort: 'pv', descending: true}), [2, 0, 1]);
  assert.deepEqual(arranged(all, o, {sort: 'pv', descending: false}), [0, 2, 1]);
  assert.deepEqual(arranged(all, o, {sort: 'tag', descending: false}), [0, 1, 2]);
});

test('a loop with an alarm that needs action now is worse than one with others, in manual or not', () => {
  const all = loops('A', 'B', 'C'), o = overview(3, {0: {alarm: 1, alarms_unacknowledged: 6, mode: 0, condition: 1}, 2: {alarm: 1, alarms_unacknowledged: 1}});
  assert.deepEqual(arranged(all, o, {grave: new Set(['C'])}), [2, 0, 1]);
  assert.deepEqual(arranged(all, o), [0, 2, 1]);
});

test('waiting alarms are first, then those that need action now, then the newest', () => {
  const line = (loop, state, raised_ms, grave = 'low') => ({loop, state, raised_ms, grave: (severe) => (severe === 10 ? grave : 'wrong')});
  const lines = [line('A', 'acknowledged', 9, 'high'), line('B', 'unacknowledged', 1), line('C', 'unacknowledged', 5), line('D', 'shelved', 8), line('E', 'unacknowledged', 0, 'high')];
  assert.deepEqual(arrangedAlarms(lines, 10).map((a) => a.loop), ['E', 'C', 'B', 'A', 'D']);
});

test('codes have their names', () => {
  assert.deepEqual([0, 64, 192, 196].map(quality), ['bad', 'uncertain', 'good', 'good']);
  assert.deepEqual(actionsOf('latched_acknowledged'), ['reset', 'shelve']);
  assert.deepEqual(actionsOf('nonsense'), []);
  assert.equal(priority({alarm: 'stiction', severity_percent: 6}, 5), 'high');
  assert.equal(priority({alarm: 'stiction', severity_percent: 4}, 5), 'low');
  assert.equal(priority({alarm: 'unknown', severity_percent: null}, 5), 'low');
  assert.equal(priority({alarm: 'low_air_supply', severity_percent: 1}, 5), 'high');
  for (const alarm of ['bad_pv', 'output_lost', 'output_unknown']) assert.equal(priority({alarm, severity_percent: null}, 5), 'high');
  assert.equal(priority({alarm: 'not_normal_mode', severity_percent: null}, 5), 'low');
  assert.equal(priority({alarm: 'pv_high', priority: 'critical', severity_percent: null}, 5), 'high');
  assert.equal(priority({alarm: 'bad_pv', priority: 'medium', severity_percent: null}, 5), 'low');
  const hasteOf = (priority, severity_percent) => haste({alarm: 'stiction', priority, severity_percent}, 5);
  assert.deepEqual(['critical', 'high', 'medium', 'low'].map((one) => hasteOf(one, null)), ['now', 'now', 'soon', 'plan']);
  assert.deepEqual([hasteOf('low', 6), hasteOf('low', 4), hasteOf('high', 6)], ['shift', 'plan', 'now']);
});
