// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import {Node} from './document.mjs';

const {setupsPart} = await import('../../../../services/page/site/views/setups.js');

const wordsOf = (node) => (typeof node === 'object' ? node.children.map(wordsOf).join(' ') : String(node)).replaceAll('\u00a0', ' ');
const all = (node, name) => (typeof node === 'object' ? [...(node.name === name ? [node] : []), ...node.children.flatMap((child) => all(child, name))] : []);
const shown = (setups) => { const place = new Node('div'); place.append(...setupsPart(setups).filter(Boolean)); return place; };
const step = (name, state, more = {}) => ({name, title: `title of ${name}`, state, since_ms: null, ...more});

test('a setup has its steps with their states, the time of its start, and the command that continues it', () => {
  const place = shown([{loop: 'FIC-101', begun_ms: 1800000000000, command: 'loopwarden setup FIC-101', steps: [step('loop', 'done'), step('devices', 'running', {since_ms: 1800000060000}), step('file', 'open'), step('start', 'asleep')]}]);
  const cells = all(place, 'tr').slice(1).map((row) => row.children.map(wordsOf));
  assert.deepEqual(cells.map(([name, title, state]) => [name, title, state.replace(/2027-01-15.*/, 'TIME')]), [['loop', 'title of loop', 'done'], ['devices', 'title of devices', 'running now, since TIME'],
    ['file', 'title of file', 'open'], ['start', 'title of start', 'unknown']]);
  assert.match(wordsOf(place), /Begun 2027-01-15/);
  assert.deepEqual(all(place, 'code').map(wordsOf), ['loopwarden setup FIC-101']);
});

test('unknown data of a setup are left out', () => {
  const place = shown([{loop: 'FIC-102', begun_ms: null, command: 'loopwarden setup FIC-102', steps: [step('loop', 'running')]}]);
  assert.doesNotMatch(wordsOf(place), /Begun/);
  assert.equal(wordsOf(all(place, 'tr')[1].children[2]), 'running now');
});

test('words of a file stay text', () => {
  const place = shown([{loop: '<b>x</b>', begun_ms: null, command: '<script>', steps: []}]);
  assert.deepEqual(all(place, 'h3')[0].children, ['<b>x</b>']);
});
