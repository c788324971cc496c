// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import {bandsIn, bandsOf, lanes} from '../../../../services/page/site/lib/bands.js';

const line = (utc_ms, from, to, alarm = 'stiction') => ({kind: 'alarm', utc_ms, from, to, alarm});

test('a band lasts from the condition to its end, independent of the operator', () => {
  const lines = [line(400, 'acknowledged', 'normal'), line(200, 'unacknowledged', 'acknowledged'), line(100, 'normal', 'unacknowledged')];
  assert.deepEqual(bandsOf(lines, []), [{alarm: 'stiction', from_ms: 100, to_ms: 400}]);
});

test('a band of an active alarm has no end, and one from before the lines has no beginning', () => {
  assert.deepEqual(bandsOf([line(100, 'normal', 'unacknowledged')], []), [{alarm: 'stiction', from_ms: 100, to_ms: null}]);
  assert.deepEqual(bandsOf([line(100, 'unacknowledged', 'returned_unacknowledged')], []), [{alarm: 'stiction', from_ms: -Infinity, to_ms: 100}]);
});

test('a present alarm without a line is drawn from the time it was raised', () => {
  const standing = [{alarm: 'backlash', active: true, raised_ms: 50}, {alarm: 'unknown', active: false, raised_ms: 1}];
  assert.deepEqual(bandsOf([], standing), [{alarm: 'backlash', from_ms: 50, to_ms: null}]);
  assert.equal(bandsOf([line(50, 'normal', 'unacknowledged', 'backlash')], standing).length, 1);
});

test('shelving and suppression don’t change the condition', () => {
  const lines = [line(300, 'shelved', 'normal'), line(200, 'unacknowledged', 'shelved'), line(100, 'normal', 'unacknowledged')];
  assert.deepEqual(bandsOf(lines, []), [{alarm: 'stiction', from_ms: 100, to_ms: 300}]);
});

test('operator lines make no bands, and bands of the same time have separate lanes', () => {
  const lines = [{kind: 'operator', utc_ms: 150, alarm: 'stiction', to: 'acknowledged'}, line(120, 'normal', 'unacknowledged', 'backlash'), line(100, 'normal', 'unacknowledged')];
  const bands = bandsOf(lines, []);
  assert.equal(lanes(bands), 2);
  assert.deepEqual(bands.map((band) => band.lane), [0, 1]);
  const after = [{from_ms: 0, to_ms: 10}, {from_ms: 10, to_ms: 20}];
  assert.equal(lanes(after), 1);
});

test('bands of several loops in a span have lanes, names and priorities', () => {
  const lines = new Map([['A', [line(400, 'unacknowledged', 'normal'), line(100, 'normal', 'unacknowledged')]], ['B', [line(900, 'normal', 'unacknowledged', 'backlash')]]]);
  const standing = [{loop: 'A', alarm: 'bad_pv', active: true, raised_ms: 200, priority: 'critical'}, {loop: 'C', alarm: 'bad_pv', active: true, raised_ms: 200}];
  const seen = bandsIn(['A', 'B'], lines, standing, [150, 800], 5, (tag, alarm) => `${tag} ${alarm}`);
  assert.deepEqual(seen.map(({label, lane, priority}) => [label, lane, priority]), [['A stiction', 0, 'low'], ['A bad_pv', 1, 'high']]);
  assert.deepEqual(bandsIn(['A', 'B'], lines, [], [500, 950], 5, (tag) => tag).map(({label}) => label), ['B']);
});
