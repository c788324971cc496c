// SPDX-License-Identifier: Apache-2.0
// The worker that shares one stream of events, with scripted tabs and streams.
import assert from 'node:assert/strict';
import test from 'node:test';

class Stream extends EventTarget {
  static all = [];
  static OPEN = 1;
  static CLOSED = 2;
  readyState = 0;
  constructor() { super(); Stream.all.push(this); }
  open() { this.readyState = Stream.OPEN; this.onopen(); }
  refuse() { this.readyState = Stream.CLOSED; this.onerror(); }
  close() { this.readyState = Stream.CLOSED; }
  say(kind, data) { this.dispatchEvent(new MessageEvent(kind, {data})); }
  static get newest() { return Stream.all.at(-1); }
}

let connect = null;
Object.assign(globalThis, {EventSource: Stream, addEventListener: (_, act) => { connect = act; }});
await import('../../../../services/page/site/lib/events_worker.js');

// Returns a tab that has joined the stream. `heard`: what it received.
function tab(renew = false) {
  const port = {heard: [], postMessage: (message) => port.heard.push(message)};
  connect({ports: [port]});
  port.onmessage({data: {renew}});
  port.leave = () => port.onmessage({data: {leave: true}});
  return port;
}

test('all tabs share one stream, and one that joins later receives the newest events', () => {
  const before = Stream.all.length, first = tab();
  Stream.newest.open();
  Stream.newest.say('overview', 'old');
  Stream.newest.say('overview', 'new');
  const second = tab();
  Stream.newest.say('describe', '{}');
  assert.equal(Stream.all.length, before + 1);
  assert.deepEqual(first.heard, [{open: true}, {kind: 'overview', data: 'old'}, {kind: 'overview', data: 'new'}, {kind: 'describe', data: '{}'}]);
  assert.deepEqual(second.heard, [{open: true}, {kind: 'overview', data: 'new'}, {kind: 'describe', data: '{}'}]);
  first.leave();
  assert.equal(Stream.newest.readyState, Stream.OPEN);
  second.leave();
  assert.equal(Stream.newest.readyState, Stream.CLOSED);
});

test('a new session has a new stream, without events of the old one', () => {
  const first = tab();
  Stream.newest.open();
  Stream.newest.say('alarms', 'of the old session');
  const old = Stream.newest, second = tab(true);
  assert.equal(old.readyState, Stream.CLOSED);
  assert.deepEqual(second.heard, []);
  Stream.newest.open();
  assert.deepEqual(second.heard, [{open: true}]);
  first.leave();
  second.leave();
});

test('a refused stream is reported to every tab, and the next request opens it again', () => {
  const first = tab(), second = tab();
  Stream.newest.refuse();
  assert.deepEqual([first.heard, second.heard], [[{refused: true}], [{refused: true}]]);
  const refused = Stream.newest;
  first.leave();
  const again = tab();
  assert.notEqual(Stream.newest, refused);
  for (const one of [second, again]) one.leave();
  assert.equal(Stream.newest.readyState, Stream.CLOSED);
});
