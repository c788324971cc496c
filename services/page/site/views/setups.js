// SPDX-License-Identifier: Apache-2.0
// Unfinished setups, as the daemon reads them from the files of `loopwarden setup`.
import {el, table} from '../lib/dom.js';
import {wall} from '../lib/shell.js';
import {fill, texts} from '../texts.js';

const t = texts.setups;

const stateOf = ({state, since_ms}) => (state === 'running' && since_ms ? fill(t.runningSince, {time: wall().dateTime(since_ms)}) : t.states[state] ?? texts.notKnown);

export function setupsPart(setups) {
  return [el('p', {class: 'soft'}, t.about), setups.map(({loop, begun_ms, command, steps}) => [
    el('h3', {}, loop), begun_ms ? el('p', {}, fill(t.begun, {time: wall().dateTime(begun_ms)})) : null,
    table(fill(t.caption, {loop}), [{head: t.step, row: true}, {head: t.does}, {head: t.state}], steps.map((step) => [step.name, step.title, stateOf(step)]), {captionHidden: true, class: 'lines'}),
    el('p', {}, el('code', {}, command)),
  ])].flat(2);
}
