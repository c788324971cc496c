// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import {verdictOf, warningsOf} from '../../../../services/page/site/lib/box_health.js';

const time = (ms) => `at ${ms}`;
const well = {daemon: {configuration: {}, feeders: []}, loops: [], disk: {bytes: 1e9, free_bytes: 9e8}};
const alarm = (name, state, more = {}) => ({loop: 'box', alarm: name, state, active: ['unacknowledged', 'acknowledged'].includes(state), raised_ms: 2000, priority: 'medium', ...more});
const warned = (alarms, out = [], answer = well) => warningsOf(answer, alarms, out, 5, time);

test('a box without warnings is healthy only after it has sent its alarms and loops', () => {
  assert.deepEqual(warned([]), []);
  assert.deepEqual(verdictOf([], true, 1000, time), ['OK. No warnings. Running since at 1000.', 'ok']);
  const [words, sign] = verdictOf([], false, 1000, time);
  assert.doesNotMatch(words, /is well/);
  assert.equal(sign, 'bad');
});

test('an active alarm of the box is a warning, with its time and link', () => {
  const warnings = warned([alarm('feeder_lost', 'acknowledged'), alarm('disk_full', 'unacknowledged', {priority: 'high', raised_ms: 1500}), {...alarm('bad_pv', 'unacknowledged'), loop: 'FIC-101'}]);
  assert.deepEqual(warnings.map(({text, href, sign}) => [text, href, sign]), [['Disk full, unacknowledged, since at 1500', '#/alarms/box/disk_full', 'high'], ['Feeder lost, acknowledged, since at 2000', '#/alarms/box/feeder_lost', 'low']]);
  assert.deepEqual(verdictOf(warnings, true, 0, time), ['2 warnings, the oldest since at 1500.', 'high']);
});

test('a cleared alarm that waits is shown, and a shelved one is not', () => {
  const warnings = warned([alarm('clock_stepped', 'returned_unacknowledged'), alarm('disk_full', 'shelved')]);
  assert.deepEqual(warnings.map(({text, sign}) => [text, sign]), [['Clock of the box changed, cleared, unacknowledged, since at 2000', 'gone']]);
  assert.deepEqual(verdictOf(warnings, true, 0, time), ['1 warning.', 'low']);
});

test('an alarm that this page doesn’t know is also a warning', () => {
  assert.deepEqual(warned([alarm('cellar_flooded', 'unacknowledged')]).map(({text}) => text), ['Cellar flooded, unacknowledged, since at 2000']);
});

test('loops that don’t work are named, only some of them if there are many', () => {
  const [one, many] = warned([], [['PV bad', ['A', 'B']], ['stands still', ['1', '2', '3', '4', '5', '6', '7']]]);
  assert.match(one.text, /PV bad: A, B$/);
  assert.match(many.text, /stands still: 1, 2, 3, 4, 5 and 2 more$/);
});

test('a full disk is reported once', () => {
  const full = {...well, disk: {bytes: 1e9, free_bytes: 1e7}};
  assert.equal(warned([], [], full).length, 1);
  assert.equal(warned([alarm('disk_full', 'unacknowledged')], [], full).length, 1);
});

test('a loop that doesn’t work is reported once, not again for its device', () => {
  const loops = [{loop: 'A', io: {connected: false}, recording: {dropped: 0, rows_lost: 0}}];
  assert.match(warned([], [], {...well, loops})[0].text, /^A: no connection/);
  assert.equal(warned([], [['PV bad', ['A']]], {...well, loops}).length, 1);
});

test('a missing feeder is reported once, with its name', () => {
  const away = {...well, daemon: {...well.daemon, feeders: [{name: 'plant', connected: false}, {name: 'lab', connected: true}]}};
  assert.match(warned([], [], away)[0].text, /plant is not connected/);
  assert.deepEqual(warned([alarm('feeder_lost', 'unacknowledged')], [], away).map(({text}) => text), ['Feeder lost (plant), unacknowledged, since at 2000']);
});
