// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import {Spark, extent, kept, merged, nearest, scaleOf, strip, timeMarks, trimmed} from '../../../../services/page/site/lib/history.js';

const stretch = (t, pv, more = {}) => ({t, pv, sp: t.map(() => 1), co: t.map(() => 2), mode: t.map(() => 1), oldest_ms: 0, newest_ms: t.at(-1), ...more});

test('a tail is valid from its first row on', () => {
  const whole = stretch([0, 100, 200, 300], [1, 2, 3, 4]), tail = stretch([200, 300, 400], [30, null, 50]);
  const both = merged(whole, tail);
  assert.deepEqual(both.t, [0, 100, 200, 300, 400]);
  assert.deepEqual(both.pv, [1, 2, 30, null, 50]);
  assert.equal(both.newest_ms, 400);
  assert.deepEqual(whole.pv, [1, 2, 3, 4], 'what was given is not changed');
});

test('an empty tail changes no rows, and without a history the tail is the history', () => {
  const whole = stretch([0, 100], [1, 2]), empty = stretch([], [], {newest_ms: 900});
  assert.deepEqual(merged(whole, empty).t, [0, 100]);
  assert.equal(merged(whole, empty).newest_ms, 900);
  assert.equal(merged(null, whole), whole);
  assert.equal(merged(empty, whole), whole);
});

test('a column that only one of them has is filled up', () => {
  const both = merged(stretch([0], [1]), stretch([100], [2], {stem: [7]}));
  assert.deepEqual(both.stem, [null, 7]);
});

test('one row before the edge is kept, so that the line begins there', () => {
  const cut = trimmed(stretch([0, 100, 200, 300], [1, 2, 3, 4]), 150);
  assert.deepEqual(cut.t, [100, 200, 300]);
  assert.deepEqual(cut.pv, [2, 3, 4]);
  const all = stretch([0, 100], [1, 2]);
  assert.equal(trimmed(all, -5), all);
});

test('extents leave out gaps and what is outside', () => {
  const h = stretch([0, 100, 200, 300], [1, null, 9, -4]);
  assert.deepEqual(extent(h, ['pv']), [-4, 9]);
  assert.deepEqual(extent(h, ['pv'], 0, 250), [1, 9]);
  assert.equal(extent(h, ['pv'], 100, 150), null);
  assert.deepEqual(extent(h, ['pv', 'stem'], 0, 50), [1, 1]);
});

test('a scale doesn’t magnify noise', () => {
  const [low, high] = scaleOf([5, 5.001], [0, 10], 0.1);
  assert.ok(high - low >= 1);
  assert.ok(low < 5 && high > 5.001);
  assert.deepEqual(scaleOf(null, [0, 10]), [0, 10]);
  const wide = scaleOf([0, 8], [0, 10]);
  assert.ok(wide[0] < 0 && wide[1] > 8);
});

test('the nearest row to a time is found', () => {
  assert.equal(nearest([], 5), -1);
  assert.equal(nearest([0, 10, 20], -7), 0);
  assert.equal(nearest([0, 10, 20], 14), 1);
  assert.equal(nearest([0, 10, 20], 16), 2);
  assert.equal(nearest([0, 10, 20], 99), 2);
});

test('a span stays within the record, and never gets too short', () => {
  assert.deepEqual(kept([-50, 50], [0, 1000], 10), [0, 100]);
  assert.deepEqual(kept([950, 1050], [0, 1000], 10), [900, 1000]);
  assert.deepEqual(kept([500, 500], [0, 1000], 10), [495, 505]);
  assert.deepEqual(kept([-9000, 9000], [0, 1000], 10), [0, 1000]);
});

test('marks of time are round on the wall clock', () => {
  const hour = 3_600_000, from = Date.UTC(2026, 0, 1, 0, 20), offset = 5.5 * hour;
  const {step, marks} = timeMarks(from, from + 8 * hour, 8, offset);
  assert.equal(step, hour);
  for (const at of marks) assert.equal((at + offset) % hour, 0);
  assert.ok(marks.length <= 9 && marks.length >= 7);
  assert.ok(timeMarks(0, 50, 10, 0).step === 5);
  assert.ok(timeMarks(0, 1e14, 10, 0).marks.length > 0);
});

test('a sparkline keeps first, lowest, highest and last of each step', () => {
  const spark = new Spark(3, 10);
  for (const [time, value] of [[0, 5], [3, 7], [6, 4], [8, 6], [11, 6], [25, 1]]) spark.add(time, value);
  assert.deepEqual(spark.steps, [5, 4, 7, 6, 6, 6, 6, 6, 1, 1, 1, 1]);
  spark.add(48, 2); // step 4: one step is empty
  assert.deepEqual(spark.steps, [1, 1, 1, 1, null, null, null, null, 2, 2, 2, 2]);
  spark.add(1e9, 3); // long after
  assert.deepEqual(spark.steps, [null, null, null, null, null, null, null, null, 3, 3, 3, 3]);
});

test('a sparkline reports its changes, and accepts a restarted daemon', () => {
  const spark = new Spark(2, 10);
  spark.load([1, 1, 2, 2, 3, 3, 4, 4], 10);
  const {version} = spark;
  spark.add(500, 3.5);
  assert.equal(spark.version, version, 'within what is drawn already');
  spark.add(501, null);
  assert.equal(spark.version, version);
  spark.add(502, 9);
  assert.equal(spark.version, version + 1);
  spark.add(0, 9);
  assert.deepEqual(spark.steps, [1, 1, 2, 2, 3, 3, 9, 9]);
  spark.add(10, 8);
  assert.deepEqual(spark.steps, [3, 3, 9, 9, 8, 8, 8, 8]);
  assert.equal(spark.version, version + 2);
});

const drawnOf = (valueAt, seconds = 100) => {
  const spark = new Spark(seconds / 10, 10);
  for (let t = 0; t < seconds; ++t) spark.add(t, valueAt(t));
  return strip(spark.steps);
};

test('a smooth fall and a smooth rise are drawn smoothly', () => {
  for (const sign of [-1, 1]) {
    const {lines, bars} = drawnOf((t) => sign * t);
    assert.equal(lines.length, 1);
    assert.deepEqual(bars, []);
    const [line] = lines;
    for (let i = 1; i < line.length; ++i) {
      assert.ok(line[i][0] > line[i - 1][0]);
      assert.ok(sign * (line[i][1] - line[i - 1][1]) > 0, 'no saw teeth');
    }
  }
});

test('a step is drawn as a step: flat before and after, and finished within its own width', () => {
  const {lines: [line], bars} = drawnOf((t) => (t < 45 ? 10 : 0));
  assert.deepEqual(bars, []);
  const falls = line.slice(1).map(([x, v], i) => [line[i][0], x, v - line[i][1]]).filter(([, , change]) => change !== 0);
  assert.deepEqual(falls, [[4.25, 4.75, -10]]);
});

test('extremes within a step are kept', () => {
  const {lines: [line], bars} = drawnOf((t) => (t === 33 ? 8 : t % 10 === 5 ? -1 : 0), 50);
  assert.ok(line.every(([, v]) => v === 0));
  assert.deepEqual(bars.map(([x, low, high]) => [x, low, high]), [[0.5, -1, 0], [1.5, -1, 0], [2.5, -1, 0], [3.5, -1, 8], [4.5, -1, 0]]);
});

test('without values no line is drawn', () => {
  const spark = new Spark(5, 10);
  spark.add(0, 1);
  spark.add(40, 2);
  assert.deepEqual(strip(spark.steps), {lines: [[[0.25, 1], [0.75, 1]], [[4.25, 2], [4.75, 2]]], bars: []});
});
