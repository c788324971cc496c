// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import {test} from 'node:test';
import {linesOf, ofBox, ownerHref, partOf} from '../../../../services/page/site/lib/incidents.js';

const alarm = (loop, name, state, more = {}) => ({loop, alarm: name, state, active: state !== 'returned_unacknowledged', raised_ms: 1000, severity_percent: null, ...more});
const incident = (loop, name, alarms) => ({id: `${loop}-1`, loop, name, alarms, raised_s: 1});

test('an incident is one line with the alarms that it raised', () => {
  const alarms = [alarm('A', 'model_gap', 'acknowledged'), alarm('A', 'stiction', 'unacknowledged', {raised_ms: 2000, severity_percent: 6}),
    alarm('A', 'bad_pv', 'unacknowledged'), alarm('B', 'backlash', 'acknowledged')];
  const lines = linesOf(alarms, [incident('A', 'stiction', ['model_gap', 'stiction'])]);
  assert.equal(lines.length, 3);
  const [first] = lines;
  assert.equal(partOf(first), 'incident');
  assert.equal(first.state, 'unacknowledged');
  assert.equal(first.size, 6);
  assert.equal(first.grave(5), 'high');
  assert.equal(first.grave(7), 'low');
  assert.deepEqual([first.haste(5), first.haste(7)], ['shift', 'plan']);
  assert.deepEqual(first.alarms.map((a) => a.alarm), ['stiction', 'model_gap']);
  assert.deepEqual(lines.slice(1).map((line) => [line.loop, partOf(line)]), [['A', 'bad_pv'], ['B', 'backlash']]);
});

test('an incident has the name of its cause, and a size only if an alarm of that name has one', () => {
  const alarms = [alarm('A', 'model_gap', 'acknowledged'), alarm('A', 'stiction', 'acknowledged', {severity_percent: 6})];
  const [line] = linesOf(alarms, [incident('A', 'gain_change', ['model_gap', 'stiction'])]);
  assert.equal(line.name, 'gain_change');
  assert.equal(line.size, null);
  assert.equal(line.state, 'acknowledged');
  assert.equal(line.active, true);
});

test('an alarm suppressed by a cause of the same incident belongs to its line, and shelved alarms have separate lines', () => {
  const low = [alarm('A', 'low_air_supply', 'unacknowledged'), alarm('A', 'stiction', 'suppressed'), alarm('A', 'backlash', 'suppressed', {active: false})];
  assert.deepEqual(linesOf(low, [incident('A', 'low_air_supply', ['low_air_supply', 'stiction'])]).map((l) => l.alarms.length), [2]);
  const shelved = [alarm('A', 'stiction', 'shelved'), alarm('A', 'model_gap', 'shelved')];
  assert.deepEqual(linesOf(shelved, [incident('A', 'stiction', ['stiction', 'model_gap'])]).map(partOf), ['stiction', 'model_gap']);
});

test('a cleared alarm waits until it is acknowledged', () => {
  const gone = [alarm('A', 'stiction', 'returned_unacknowledged')];
  const [line] = linesOf(gone, [incident('A', 'stiction', ['stiction'])]);
  assert.equal(line.state, 'returned_unacknowledged');
  assert.equal(line.active, false);
  assert.deepEqual(linesOf([alarm('A', 'stiction', 'normal', {active: false})], [incident('A', 'stiction', ['stiction'])]), []);
});

test('an alarm is marked as the first only if another one of its loop followed', () => {
  const first = alarm('A', 'bad_pv', 'unacknowledged', {first_out: true});
  assert.equal(linesOf([first, alarm('B', 'bad_pv', 'acknowledged')], [])[0].firstOut, false);
  assert.deepEqual(linesOf([first, alarm('A', 'output_lost', 'unacknowledged', {first_out: false})], []).map((line) => line.firstOut), [true, false]);
});

test('an alarm of the box is a line of the box, and links to it', () => {
  const [line] = linesOf([alarm('box', 'disk_full', 'unacknowledged', {priority: 'high'})], []);
  assert.equal(ofBox(line), true);
  assert.deepEqual([line.name, partOf(line), line.grave(5), line.haste(5)], ['disk_full', 'disk_full', 'high', 'now']);
  assert.equal(ownerHref('box'), '#/system');
  assert.equal(ownerHref('FIC 1/2'), '#/loop/FIC%201%2F2');
  assert.equal(ofBox({loop: 'FIC-101'}), false);
});

test('an alarm of the box is never marked as the first, because these alarms are independent', () => {
  const lines = linesOf([alarm('box', 'disk_full', 'unacknowledged', {first_out: true}), alarm('box', 'feeder_lost', 'unacknowledged'), alarm('A', 'bad_pv', 'unacknowledged', {first_out: true}), alarm('A', 'deviation', 'unacknowledged')], []);
  assert.deepEqual(lines.filter((line) => line.firstOut).map((line) => line.loop), ['A']);
});
