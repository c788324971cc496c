// SPDX-License-Identifier: Apache-2.0
// Tests of the common parts of trends, on a fake document and a fake server.
import assert from 'node:assert/strict';
import test from 'node:test';
import {Node} from './document.mjs';

const server = {asked: [], answers: {}};
const timers = [];
Object.assign(globalThis, {
  setTimeout: (act, ms) => timers.push({act, ms}), clearTimeout: (n) => { if (n) timers[n - 1].act = () => {}; },
  fetch: async (path) => {
    server.asked.push(path);
    const [, answer] = Object.entries(server.answers).find(([key]) => path.startsWith(key)) ?? [];
    if (!answer) return {ok: false, status: 500, headers: new Headers(), json: async () => ({error: `nothing for ${path}`})};
    return {ok: true, status: 200, headers: new Headers(), json: async () => (typeof answer === 'function' ? answer() : answer)};
  },
});
const {FollowingTrend} = await import('../../../../services/page/site/lib/trend_tools.js');
const {live} = await import('../../../../services/page/site/lib/live.js');
const {Scope} = await import('../../../../services/page/site/lib/scope.js');
const {texts} = await import('../../../../services/page/site/texts.js');

const past = (t, more = {}) => ({t, pv: t.map(() => 1), oldest_ms: 1000, newest_ms: t.at(-1) ?? null, bucket_s: null, ...more});
const line = (loop, to, utc_ms) => ({kind: 'alarm', loop, alarm: 'stiction', from: 'normal', to, utc_ms});
class Two extends FollowingTrend {
  constructor(scope) {
    super(scope, null, {span: '60'}, 'two');
    this.tags = ['A', 'B'];
    this.trend = {show: (...what) => { this.shown = what; }, end() {}, redraw() {}};
  }
  rows() { return this.histories.A && this.histories.B ? {t: [...this.histories.A.t, ...this.histories.B.t]} : null; }
  drawn(span) { this.span_drawn = span; }
}
function rig() {
  timers.length = 0;
  server.asked.length = 0;
  server.answers = {'/api/loops/A/history': past([50_000, 90_000]), '/api/loops/B/history': past([60_000, 100_000], {oldest_ms: 500}),
    '/api/journal?loop=A&kind=alarm': {lines: [line('A', 'unacknowledged', 80_000)]}, '/api/journal?loop=B&kind=alarm': {lines: []}, '/api/journal': {lines: []}};
  Object.assign(live, {overview: {now_ms: 100_000}, describe: {loops: [], alarms: {severe_percent: 5}}, alarms: [], session: {can: {}}, stale: null});
  const scope = new Scope();
  return {scope, trend: new Two(scope)};
}

test('the loops of a trend share one span and one row of buttons, and have bands from the journal', async () => {
  const {trend} = rig();
  await trend.load();
  assert.deepEqual(trend.span_drawn, [40_000, 100_000]);
  assert.deepEqual(trend.shown[2].map(({label, from_ms, to_ms, lane, priority}) => [label, from_ms, to_ms, lane, priority]), [['Stiction', 80_000, null, 0, 'low']]);
  assert.equal(trend.spans[0].attributes['aria-pressed'], 'true');
  assert.equal(trend.followButton.attributes['aria-pressed'], 'true');
  assert.equal(trend.box.dataset.rows, 4);
  assert.match(server.asked.find((path) => path.startsWith('/api/loops/A/history')), /from_ms=40000&to_ms=100000&points=800/);
});

test('the journal is read less often than the curves, and an unreadable journal doesn’t remove a curve', async () => {
  const {trend} = rig(), asked = () => server.asked.filter((path) => path.includes('kind=alarm')).length;
  await trend.load();
  await trend.load();
  assert.equal(asked(), 2);
  const other = rig().trend;
  delete server.answers['/api/journal?loop=A&kind=alarm'];
  delete server.answers['/api/journal'];
  await other.load();
  assert.equal(other.box.dataset.rows, 4);
});

test('an answer that is too late is dropped', async () => {
  const {trend} = rig(), held = {};
  server.answers['/api/loops/A/history'] = () => new Promise((done) => { held.done = done; });
  const first = trend.load();
  await new Promise(setImmediate);
  server.answers['/api/loops/A/history'] = past([95_000]);
  await trend.load();
  held.done(past([1, 2, 3, 4, 5, 6]));
  await first;
  assert.equal(trend.box.dataset.rows, 3);
});

test('a chosen span stays and is requested after it is drawn, and a following span immediately', async () => {
  const {trend} = rig();
  await trend.load();
  server.asked.length = 0;
  trend.want([70_000, 80_000]);
  assert.deepEqual(trend.span_drawn, [70_000, 80_000]);
  assert.equal(trend.followButton.attributes['aria-pressed'], 'false');
  assert.equal(server.asked.length, 0);
  timers.at(-1).act();
  assert.ok(server.asked[0].includes('from_ms=70000&to_ms=80000'));
  await new Promise(setImmediate);
  const before = timers.length;
  trend.follow();
  assert.equal(timers.length, before, 'no new timer');
});

test('a following span is requested without a wait', async () => {
  const {trend} = rig();
  await trend.load();
  server.asked.length = 0;
  trend.want('all');
  assert.ok(server.asked[0].startsWith('/api/loops/A/history'));
});

test('a following trend loads again when a bucket is full, at most every three seconds', async () => {
  const {trend} = rig();
  await trend.load();
  assert.equal(timers.at(-1).ms, 3000);
  server.answers['/api/loops/B/history'] = past([60_000], {bucket_s: 12});
  await trend.load();
  assert.equal(timers.at(-1).ms, 12_000);
});

test('the way of drawing a curve is shown', () => {
  const {trend} = rig();
  assert.equal(trend.said(past([5]), [0, 9]), texts.trend.every);
  assert.equal(trend.said(past([5]), [6, 9]), texts.trend.empty);
  assert.match(trend.said(past([5], {bucket_s: 2}), [0, 9]), /first, lowest, highest and last of each 2/);
});

test('a closed view sends no further requests', async () => {
  const {trend, scope} = rig();
  await trend.load();
  const before = timers.length;
  scope.end();
  trend.follow();
  assert.equal(timers.length, before);
});
