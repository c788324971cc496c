// SPDX-License-Identifier: Apache-2.0
// Tests of the drawing of PV over CO, on a fake canvas.
import assert from 'node:assert/strict';
import test from 'node:test';
import {Node} from './document.mjs';

const {drawPhase} = await import('../../../../services/page/site/lib/charts.js');

// Returns the number of lines and dots of a record, without the grid, which is drawn before the
// first change of opacity.
function drawn(history) {
  const canvas = new Node('canvas'), found = {lines: 0, dots: 0};
  let grid = true;
  const count = (name) => () => { if (!grid) ++found[name]; };
  const ctx = {setTransform() {}, beginPath() {}, moveTo() {}, stroke() {}, arc() {}, fill() {}, fillText() {}, lineTo: count('lines'), fillRect: count('dots'),
    set globalAlpha(_) { grid = false; }};
  Object.assign(canvas, {parentNode: {clientWidth: 400}, style: {}, getContext: () => ctx});
  drawPhase(canvas, history, [0, history.t.length], {co: [0, 10], pv: [0, 10]}, ['CO V', 'PV L/min']);
  return found;
}

// PV and CO run around a square, as with a sticking valve.
const n = 60, at = (k) => [[0, 5], [5, 5], [5, 0], [0, 0]][k % 4], square = (sample) => ({t: [...Array(n).keys()], co: [...Array(n).keys()].map((k) => at(k)[0]), pv: [...Array(n).keys()].map((k) => at(k)[1]), sample});

test('every sample is joined to the next', () => {
  assert.deepEqual(drawn(square(Array(n).fill(1))), {lines: n - 1, dots: 0});
  assert.deepEqual(drawn(square(undefined)), {lines: n - 1, dots: 0});
});

test('in decimated data distant samples are dots without lines, and extremes are not drawn', () => {
  const sample = Array(n).fill(1);
  sample[30] = sample[31] = 0;
  const {lines, dots} = drawn(square(sample));
  assert.equal(lines, 0);
  assert.ok(dots >= n - 2);
});

test('in decimated data near samples are still joined', () => {
  const near = {t: [...Array(n).keys()], co: [...Array(n).keys()].map((k) => k / 10), pv: [...Array(n).keys()].map((k) => k / 10), sample: Array(n).fill(1)};
  near.sample[3] = 0;
  assert.equal(drawn(near).lines, n - 2);
});
