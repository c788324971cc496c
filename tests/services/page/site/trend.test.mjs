// SPDX-License-Identifier: Apache-2.0
// Tests of the drawing by a trend before and after its curves, on a fake plotter.
import assert from 'node:assert/strict';
import test from 'node:test';
import {Node} from './document.mjs';

globalThis.ResizeObserver = class { observe() {} disconnect() {} };
const {Trend} = await import('../../../../services/page/site/lib/trend.js');

// Calls the hook as uPlot does, once the curves are drawn.
class Plotter {
  static all = [];
  over = new Node('div');
  bbox = {left: 0, top: 50, width: 1000, height: 100};
  log = [];
  constructor(options) {
    this.options = options;
    Plotter.all.push(this);
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
    assert.equal(this.options.hooks.drawClear, undefined, 'no drawing below the curves');
    this.options.hooks.draw[0](this);
  }
}

const curve = {key: 'pv', name: 'PV', ink: 'measured'};
function shown(bands, notes = []) {
  const pane = {label: 'PV', unit: 'V', range: [0, 10], curves: [curve]}, trend = new Trend(Plotter, new Node('div'), {panes: [pane, pane], x: {unit: 's'}});
  trend.show({t: [0, 500, 1000], pv: [1, null, 3]}, [0, 1000], bands, notes);
  return Plotter.all.slice(-2);
}

const filled = ({log}) => log.filter(([what]) => what === 'fill');

test('the band of an alarm is above the curves of each pane and covers none, and over the first pane it has its name', () => {
  const panes = shown([{from_ms: 200, to_ms: 400, lane: 0, label: 'Stiction', priority: 'high'}]);
  for (const {bbox, ...pane} of panes) {
    assert.deepEqual(filled(pane).map(([, colour, x, , width]) => [colour, x, width]), [['the colour --high', 200, 200]]);
    for (const [, , , top, , high] of filled(pane)) assert.ok(high > 0 && top + high <= bbox.top, 'it covers a curve');
  }
  assert.deepEqual(panes.map(({log}) => log.some(([what, text]) => what === 'text' && text === 'Stiction')), [true, false]);
});

test('parts beyond the span are not drawn, and an active alarm reaches the end of the span', () => {
  const bands = [{from_ms: -9, to_ms: -5, lane: 0, label: 'A', priority: 'low'}, {from_ms: 900, to_ms: null, lane: 0, label: 'B', priority: 'low'}];
  for (const pane of shown(bands)) assert.deepEqual(filled(pane).map(([, , x, , width]) => [x, width]), [[900, 100]]);
});

test('a note that is not on the disk yet is marked', () => {
  const texts = (note) => shown([], [{at_ms: 500, number: 3, ...note}])[0].log.filter(([what]) => what === 'text').map(([, text]) => text);
  assert.deepEqual(texts({}), ['3']);
  assert.deepEqual(texts({on_disk: false}), ['3 …']);
  assert.deepEqual(texts({at_ms: 2000}), []);
});

test('a missing value stays a gap', () => {
  const [pane] = shown([]);
  assert.deepEqual(pane.columns, [[0, 500, 1000], [1, null, 3]]);
  assert.equal(pane.options.series[1].spanGaps, false);
});

test('a time that the right edge would cut off is omitted', () => {
  const [{options}] = shown([]), [axis] = options.axes, u = {width: 1000, bbox: {left: 0}, ctx: {measureText: (text) => ({width: 10 * text.length})}, valToPos: (v) => v};
  assert.deepEqual(axis.values(u, [500, 975, 985]), ['500 s', '975 s', '']);
});
