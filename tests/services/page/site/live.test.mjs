// SPDX-License-Identifier: Apache-2.0
// The stream of events without a browser, with a scripted server.
import assert from 'node:assert/strict';
import test from 'node:test';
import {get} from '../../../../services/page/site/lib/api.js';
import {Live} from '../../../../services/page/site/lib/live.js';
import {person} from '../../../../services/page/site/lib/person.js';

class Stream extends EventTarget {
  static newest = null;
  static CLOSED = 2;
  readyState = 1;
  constructor() { super(); Stream.newest = this; }
  close() { this.readyState = Stream.CLOSED; }
  say(type, data) { this.dispatchEvent(Object.assign(new Event(type), {data: JSON.stringify(data)})); }
}

const LOOPS = [{tag: 'A', sample_time_s: 0.1}, {tag: 'B', sample_time_s: 0.1}];
const VERA = {user: 'vera', role: 'viewer', csrf: 'hers', login: true, must_login: false, can: {alarms: false, control: false}, box: true};
const NOBODY = {...VERA, user: null, role: 'none', csrf: 'nobody', must_login: true};
const server = {session: VERA, asked: [], describe: {up: true, loops: LOOPS}};

Object.assign(globalThis, {
  EventSource: Stream,
  document: Object.assign(new EventTarget(), {hidden: false}),
  requestAnimationFrame: (act) => setTimeout(act, 0),
  setInterval: (act) => { server.tick = act; return 0; }, // the test calls the timer
  fetch: async (path, {headers}) => {
    server.asked.push([path, headers]);
    const known = {'/api/session': server.session, '/api/describe': server.describe, '/api/sparklines': {step_s: 10, pv: [[], []]}};
    const status = path !== '/api/session' && server.session.must_login ? 401 : 200;
    return {ok: status === 200, status, headers: new Headers(), json: async () => (status === 200 ? known[path] ?? {} : {error: 'log in first'})};
  },
});

const settled = () => new Promise((done) => { setTimeout(done, 20); });

// Returns the live data as a viewer receives it.
async function looking() {
  server.session = VERA;
  const live = new Live();
  await live.start();
  Stream.newest.onopen();
  await settled();
  Stream.newest.say('alarms', [{loop: 'A', alarm: 'stiction', state: 'unacknowledged'}]);
  Stream.newest.say('overview', {period: [1, 1], pv: [1, 2]});
  await settled();
  assert.equal(live.alarmsKnown, true);
  assert.equal(live.overview.pv[1], 2);
  return live;
}

function knowsNothing(live) {
  assert.equal(live.overview, null);
  assert.equal(live.describe, null);
  assert.deepEqual(live.alarms, []);
  assert.equal(live.alarmsKnown, false);
  assert.equal(live.stale, null);
  assert.equal(live.session.must_login, true);
  assert.equal(Stream.newest.readyState, Stream.CLOSED);
}

test('without a log-in the alarms are unknown, and are not shown as none', async () => {
  server.session = NOBODY;
  const live = new Live();
  await live.start();
  await settled();
  assert.equal(live.alarmsKnown, false);
  assert.equal(live.overview, null);
  assert.equal(live.stale, null);
});

test('when the stream reports the end of the session all data of the box are removed immediately', async () => {
  const live = await looking();
  const heard = [];
  for (const type of ['session', 'alarms', 'describe']) live.addEventListener(type, () => heard.push([type, live.alarmsKnown]));
  server.session = NOBODY;
  Stream.newest.say('ended', {});
  knowsNothing(live);
  assert.deepEqual(heard, [['session', false], ['describe', false], ['alarms', false]], 'the view is removed first, then the other parts are notified');
  await settled();
  knowsNothing(live);
  assert.equal(heard.length, 3, 'the log-in is not shown twice');
});

test('the loops of a daemon that never answered are unknown', async () => {
  server.session = VERA;
  server.describe = {up: false, loops: []};
  const live = new Live();
  await live.start();
  Stream.newest.onopen();
  Stream.newest.say('daemon', {up: false, since_ms: 1000, why: 'no daemon answers'});
  await settled();
  assert.equal(live.describe, null);
  assert.equal(live.stale.why, 'daemon');
  server.describe = {up: true, loops: LOOPS};
  Stream.newest.say('describe', {});
  await settled();
  assert.equal(live.describe.loops.length, 2);
});

test('any answer that reports the end of the session ends it', async () => {
  const live = await looking();
  server.session = NOBODY;
  await assert.rejects(get('/api/journal'), {status: 401});
  knowsNothing(live);
});

test('a log-out ends the session immediately', async () => {
  const live = await looking();
  server.session = NOBODY;
  await live.logOut();
  knowsNothing(live);
});

test('a page of only a fleet, which has no stream, asks whether it is still logged in', async () => {
  server.session = {...VERA, box: false};
  const live = new Live();
  await live.start();
  server.session = {...NOBODY, box: false};
  server.tick();
  await settled();
  assert.equal(live.session.must_login, true);
});

test('a loop whose cycle has stopped is marked, and one without a cycle is only unknown', async t => {
  const live = await looking(), now = performance.now.bind(performance);
  let ahead_ms = 3000;
  t.mock.method(performance, 'now', () => now() + ahead_ms);
  Stream.newest.say('overview', {period: [1, 31], pv: [1, 2]});
  assert.deepEqual(live.overview.stands, [true, false]);
  Stream.newest.say('overview', {period: [2, 32], pv: [1, 2]});
  assert.deepEqual(live.overview.stands, [false, false]);
  Stream.newest.say('overview', {period: [null, 32], pv: [null, 2]});
  ahead_ms = 9000;
  Stream.newest.say('overview', {period: [null, 32], pv: [null, 2]});
  assert.deepEqual(live.overview.stands, [false, true]);
});

test('after a log-in in another tab all data return', async () => {
  const live = await looking();
  Stream.newest.say('ended', {});
  assert.equal(live.session.must_login, true);
  await settled();
  assert.equal(live.session.user, 'vera');
  assert.equal(Stream.newest.readyState, 1);
});

test('requests carry the mark of a user who is present', async () => {
  await looking();
  assert.ok(server.asked.every(([, headers]) => !('X-Loopwarden-Person' in headers)));
  person.seen(performance.now());
  await get('/api/journal');
  assert.equal(server.asked.at(-1)[1]['X-Loopwarden-Person'], '1');
});
