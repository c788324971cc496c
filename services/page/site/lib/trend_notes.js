// SPDX-License-Identifier: Apache-2.0
// Notes below a trend, and the dialog that adds one.
import {ask, field, toast} from './dialog.js';
import {el} from './dom.js';
import {get, loopPath, post, query} from './api.js';
import {live} from './live.js';
import {notesIn, notesOf, waitingStill, withWaiting} from './notes.js';
import {wall} from './shell.js';
import {fill, texts} from '../texts.js';

const t = texts.notes;
const MOST_LINES = 200, FRESH_MS = 15_000;
let newest = {tags: null, at_ms: -Infinity, notes: []};
let waiting = []; // for the journal's disk

// Reads the notes of some loops together, numbered over all of them. A following trend calls this every few seconds; the journal is read less often.
export async function fetchNotes(tags, signal) {
  const now_ms = performance.now(), key = tags.join();
  if (newest.tags === key && now_ms - newest.at_ms < FRESH_MS && !waiting.length) return newest.notes;
  const answers = await Promise.all(tags.map((loop) => get(`/api/journal${query({loop, kind: 'operator', text: 'note', most: MOST_LINES})}`, signal)));
  newest = {tags: key, at_ms: now_ms, notes: notesOf(answers.flatMap(({lines}) => lines))};
  const here = ({loop}) => tags.includes(loop);
  waiting = waiting.filter((note) => !here(note)).concat(waitingStill(newest.notes, waiting.filter(here)));
  return withWaiting(newest.notes, waiting.filter(here));
}

// Rewritten only if another note is in the span, so that the user's selection stays.
export function showNotes(place, notes, span, withLoop = false) {
  const seen = notesIn(notes, span), key = JSON.stringify(seen);
  if (place.shown === key) return;
  place.shown = key;
  const lineOf = (note) => el('li', {value: note.number}, el('span', {class: 'soft'}, [wall().dateTime(note.at_ms), withLoop ? note.loop : null, note.who].filter(Boolean).join(' · ')), ` ${note.text}`, note.on_disk === false ? el('small', {class: 'soft'}, ` (${t.notOnDisk})`) : null);
  place.replaceChildren(seen.length ? el('ol', {class: 'trend-notes', 'aria-label': t.title}, seen.map(lineOf)) : '');
}

export const mayNote = () => Boolean(live.session.can?.alarms);

// at_ms: the time it refers to; then(): called after it is written.
export function askNote(tag, at_ms, then) {
  const text = el('input', {name: 'text', maxlength: 200, required: true, autocomplete: 'off'});
  ask({
    title: fill(t.ask, {tag}), label: t.write, body: [el('p', {}, fill(t.about, {time: wall().dateTime(at_ms)})), field(t.text, text)],
    accept: async (data) => {
      const words = String(data.get('text')), answer = await post(loopPath(tag, 'notes'), {text: words, about_ms: Math.floor(at_ms)});
      newest.tags = null;
      if (answer.on_disk === false) {
        waiting.push({loop: tag, at_ms: Math.floor(at_ms), said_ms: live.overview?.now_ms ?? Date.now(), who: live.session.user, text: words});
        toast(texts.alarm.notOnDisk);
      }
      await then();
    },
  });
}
