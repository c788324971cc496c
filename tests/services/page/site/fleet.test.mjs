// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import {barPath, curvePath, greatest, judged, matching, sorted, worstOf} from '../../../../services/page/site/lib/fleet.js';

const FIGURES = {acceptable: 1, most: 2, flood: 10, flood_percent: 1};

test('rows are found by all words, regardless of case', () => {
  const rows = [{tag: 'FIC-1', box: 'box7'}, {tag: 'TIC-1', box: 'box7'}, {tag: 'FIC-2', box: 'box8'}];
  const found = (search) => matching(rows, search, (row) => [row.tag, row.box]).map((row) => row.tag);
  assert.deepEqual(found('  '), ['FIC-1', 'TIC-1', 'FIC-2']);
  assert.deepEqual(found('box7 fic'), ['FIC-1']);
  assert.deepEqual(found('FIC'), ['FIC-1', 'FIC-2']);
  assert.deepEqual(found('1box'), [], 'a word does not reach over two texts');
  assert.deepEqual(found('.*'), []);
});

test('rows without a value are last in both directions, and tags are in the order of their numbers', () => {
  const rows = [{n: 3, tag: 'F-10'}, {n: null, tag: 'F-9'}, {n: 7, tag: 'F-1'}, {tag: 'F-2'}];
  const tags = (value, falls) => sorted(rows, value, falls).map((row) => row.tag);
  assert.deepEqual(tags((row) => row.n, true), ['F-1', 'F-10', 'F-9', 'F-2']);
  assert.deepEqual(tags((row) => row.n, false), ['F-10', 'F-1', 'F-9', 'F-2']);
  assert.deepEqual(tags((row) => row.tag, false), ['F-1', 'F-2', 'F-9', 'F-10']);
  assert.deepEqual(rows.map((row) => row.tag), ['F-10', 'F-9', 'F-1', 'F-2'], 'what was given stays as it was');
});

test('alarm rates against ISA-18.2', () => {
  const of = (per_10_min, flood_percent = 0) => judged({per_10_min, flood_percent}, FIGURES);
  assert.deepEqual(of(1), ['acceptable', null]);
  assert.deepEqual(of(1.01), ['manageable', 'low']);
  assert.deepEqual(of(2), ['manageable', 'low']);
  assert.deepEqual(of(2.01), ['over', 'high']);
  assert.deepEqual(of(0.5, 1), ['acceptable', null]);
  assert.deepEqual(of(0.5, 1.1), ['floods', 'high']);
});

test('the worst group is the one with floods, then the one with most alarms, and null if all are acceptable', () => {
  const group = (name, per_10_min, flood_percent = 0) => ({group: name, day: {raised: 144 * per_10_min, per_10_min, flood_percent}});
  assert.equal(worstOf([group('A', 0.5), group('B', 1.5), group('C', 1.6)], FIGURES).group, 'C');
  assert.equal(worstOf([group('A', 3), group('B', 0.9, 2)], FIGURES).group, 'A');
  assert.equal(worstOf([group('A', 1.9), group('B', 0.9, 2)], FIGURES).group, 'B');
  assert.equal(worstOf([group('A', 1)], FIGURES), null);
  assert.equal(worstOf([], FIGURES), null);
});

test('a curve of steps has its gaps and is cut off at the top', () => {
  assert.equal(curvePath([0, 5, null, 20, 10], 50, 20, 10), 'M0 20H10V10H20M30 0H40V0H50');
  assert.equal(curvePath([null, null], 50, 20, 10), '');
});

test('only the requested numbers have bars', () => {
  const bins = [0, 2, 12, 4];
  assert.equal(barPath(bins, 16, 8, (n) => n <= 10), 'M1 16V12h1V16zM3 16V8h1V16z');
  assert.equal(barPath(bins, 16, 8, (n) => n > 10), 'M2 16V0h1V16z');
});

test('the greatest known value is found', () => {
  assert.equal(greatest([null, 3, 9, 4]), 9);
  assert.equal(greatest([null, null]), null);
  assert.equal(greatest([]), null);
});
