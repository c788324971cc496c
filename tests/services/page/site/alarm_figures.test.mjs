// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import {figuresOf, reachesLess} from '../../../../services/page/site/lib/alarm_figures.js';
import {texts} from '../../../../services/page/site/texts.js';

const calm = {came: 0, per_hour: 0, most_in_10_min: 0, floods: 0, flood_percent: 0, top: [], chattering: [], stale: []};
const judged = (change) => Object.fromEntries(figuresOf({...calm, ...change}).map(([key, , right]) => [key, right]));
const of = (n) => Array(n).fill({});

test('each figure is judged against its target, and at the limit as in the standard', () => {
  for (const [change, key, right] of [[{per_hour: 6}, 'per_hour', true], [{per_hour: 6.1}, 'per_hour', false], [{most_in_10_min: 10}, 'most_in_10_min', true], [{most_in_10_min: 11}, 'most_in_10_min', false],
    [{flood_percent: 0.9}, 'flood_percent', true], [{flood_percent: 1}, 'flood_percent', false], [{chattering: of(1)}, 'chattering', false], [{stale: of(4)}, 'stale', true], [{stale: of(5)}, 'stale', false]]) {
    assert.equal(judged(change)[key], right, JSON.stringify(change));
  }
});

test('a share is judged only with enough alarms', () => {
  const top = [{percent: 3}, {percent: 50}];
  assert.equal(judged({top, came: 2}).top_percent, null);
  assert.equal(judged({top, came: 200}).top_percent, false);
  assert.equal(judged({top: [{percent: 4}], came: 200}).top_percent, true);
  assert.deepEqual(figuresOf(calm).at(-1), ['top_percent', null, null]);
});

test('every figure has a name', () => {
  for (const [key] of figuresOf(calm)) assert.ok(texts.alarmFigures.names[key], key);
});

test('a journal shorter than the requested time is reported', () => {
  assert.equal(reachesLess({from_ms: 0, to_ms: 24 * 3_600_000}, 24), false);
  assert.equal(reachesLess({from_ms: 3_600_000, to_ms: 24 * 3_600_000}, 24), true);
});
