// SPDX-License-Identifier: Apache-2.0
// What a trend draws before and after its curves, on a plotter of the test's own.
import assert from 'node:assert/strict';
import test from 'node:test';
import {Node} from './document.mjs';

globalThis.ResizeObserver = class { observe() {} disconnect() {} };
const {Trend} = await import('../../../../services/page/site/lib/trend.js');

// Calls the hooks as uPlot does: drawClear, the curves, draw.
class Plotter {
  static newest = null;
  over = new Node('div');
  bbox = {left: 0, top: 50, width: 1000, height: 100};
  log = [];
  constructor(options) {
    this.options = options;
    Plotter.newest = this;
    const {log} = this;
    this.ctx = {save() {}, restore() {}, beginPath() {}, rect() {}, clip() {}, moveTo() {}, lineTo() {}, stroke() { log.push(['stroke']); }, setLineDash() {},
      fillRect(...at) { log.push(['fill', this.fillStyle, ...at]); }, fillText(text) { log.push(['text', text]); }};
  }
  batch(act) { act(); }
  setData(columns) { this.columns = columns; }
  setScale() {}
  setCursor() {}
  destroy() {}
  valToPos(v) { return v; }
  posToVal(v) { return v; }
  redraw() {
    this.log.length = 0;
    const {drawClear, draw} = this.options.hooks;
    drawClear[0](this);
    this.log.push(['curves']);
    draw[0](this);
  }
}

const curve = {key: 'pv', name: 'PV', ink: 'measured'};
function shown(bands, notes = []) {
  const trend = new Trend(Plotter, new Node('div'), {panes: [{label: 'PV', unit: 'V', range: [0, 10], curves: [curve]}], x: {unit: 's'}});
  trend.show({t: [0, 500, 1000], pv: [1, null, 3]}, [0, 1000], bands, notes);
  return Plotter.newest;
}

test('the band of an alarm lies behind the curves, and its name above them', () => {
  const {log, bbox} = shown([{from_ms: 200, to_ms: 400, lane: 0, label: 'Stiction', priority: 'high'}]), at = log.findIndex(([what]) => what === 'curves');
  assert.deepEqual(log.slice(0, at), [['fill', 'the colour --band', 200, bbox.top, 200, bbox.height]]);
  const after = log.slice(at + 1).filter(([what]) => what === 'fill');
  assert.deepEqual(after.map(([, colour, x, , width]) => [colour, x, width]), [['the colour --high', 200, 200]]);
  for (const [, , , top, , high] of after) assert.ok(top + high <= bbox.top, 'it covers no curve');
  assert.ok(log.some(([what, text]) => what === 'text' && text === 'Stiction'));
});

test('what is beyond the span is not drawn, and what is on still reaches to its end', () => {
  const bands = [{from_ms: -9, to_ms: -5, lane: 0, label: 'A', priority: 'low'}, {from_ms: 900, to_ms: null, lane: 0, label: 'B', priority: 'low'}];
  assert.deepEqual(shown(bands).log.filter(([what, colour]) => what === 'fill' && colour.endsWith('--band')).map(([, , x, , width]) => [x, width]), [[900, 100]]);
});

test('a note that is not on the disk yet is marked', () => {
  const texts = (note) => shown([], [{at_ms: 500, number: 3, ...note}]).log.filter(([what]) => what === 'text').map(([, text]) => text);
  assert.deepEqual(texts({}), ['3']);
  assert.deepEqual(texts({on_disk: false}), ['3 …']);
  assert.deepEqual(texts({at_ms: 2000}), []);
});

test('a value that is missing stays a hole', () => {
  assert.deepEqual(shown([]).columns, [[0, 500, 1000], [1, null, 3]]);
  assert.equal(Plotter.newest.options.series[1].spanGaps, false);
});
