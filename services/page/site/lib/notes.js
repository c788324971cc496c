// SPDX-License-Identifier: Apache-2.0
// Notes of users about a loop, from the journal's lines: author, time of writing, text, and the time they refer to. Pure.

const byTime = (a, b) => a.at_ms - b.at_ms || a.said_ms - b.said_ms;
const numbered = (note, i) => ({...note, number: i + 1});

// `lines`: newest first. Returns the notes, earliest first, numbered as on a trend.
export function notesOf(lines) {
  return lines.filter((line) => line.what === 'note' && line.result === 'done')
    .map((line) => ({loop: line.loop, at_ms: Date.parse(line.new) || line.utc_ms, said_ms: line.utc_ms, who: line.peer.split(' by ')[0], text: line.reason}))
    .sort(byTime).map(numbered);
}

// Adds accepted notes that are in no line yet, because the journal waits for its disk: their `on_disk` is false.
export function withWaiting(notes, waiting) {
  const still = waitingStill(notes, waiting).map((note) => ({...note, on_disk: false}));
  return still.length ? [...notes, ...still].sort(byTime).map(numbered) : notes;
}
export const waitingStill = (notes, waiting) => waiting.filter((one) => !notes.some((note) => note.loop === one.loop && note.text === one.text && Math.abs(note.at_ms - one.at_ms) < 1000));

export const notesIn = (notes, [from, to]) => notes.filter(({at_ms}) => at_ms >= from && at_ms <= to);
