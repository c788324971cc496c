// SPDX-License-Identifier: Apache-2.0
// What people noted of a loop, from the journal's lines: who, when, words, and the time it is about. Pure.

// `lines`: newest first. The earliest first, numbered as they stand on a trend.
export function notesOf(lines) {
  return lines.filter((line) => line.what === 'note' && line.result === 'done')
    .map((line) => ({loop: line.loop, at_ms: Date.parse(line.new) || line.utc_ms, said_ms: line.utc_ms, who: line.peer.split(' by ')[0], text: line.reason}))
    .sort((a, b) => a.at_ms - b.at_ms || a.said_ms - b.said_ms).map((note, i) => ({...note, number: i + 1}));
}

export const notesIn = (notes, [from, to]) => notes.filter(({at_ms}) => at_ms >= from && at_ms <= to);
