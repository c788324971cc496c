// SPDX-License-Identifier: Apache-2.0
// Sound and notification for alarms that wait, as this browser's reader wishes. Pure: `out` sounds and notifies, `memory` keeps.

export const PRIORITIES = ['off', 'high', 'low']; // none; what is acted on now; every alarm
const EACH_MS = 10_000; // between two sounds, whatever comes meanwhile: who mutes the browser hears nothing
const WISH = 'bell', SILENT = 'bell-silent-until';

export class Bell {
  #told = null; // keys of what has been notified; null: nothing is known yet
  #rang_ms = -Infinity;

  // memory: {recall(key), remember(key, text or null)}; out: {sound(): whether it was heard, notify(call)}.
  constructor(memory, out) { Object.assign(this, {memory, out}); }

  get asked() { return PRIORITIES.includes(this.memory.recall(WISH)); }
  get wish() { return this.asked ? this.memory.recall(WISH) : 'off'; }
  set wish(priority) { this.memory.remember(WISH, priority); }

  // UTC, ms; null: it is not silent.
  silentUntil(now_ms) {
    const until = Number(this.memory.recall(SILENT));
    return until > now_ms ? until : null;
  }
  silence(until_ms) { this.memory.remember(SILENT, until_ms === null ? null : String(until_ms)); }

  // `calls`: what waits, {key, grave: high or low, ...}; null: not known.
  take(calls, now_ms) {
    if (!calls) { this.#told = null; return; }
    const due = calls.filter(({grave}) => this.wish === 'low' || (this.wish === 'high' && grave === 'high'));
    const fresh = due.filter(({key}) => !this.#told?.has(key));
    this.#told = new Set(due.map(({key}) => key));
    if (!due.length || this.silentUntil(now_ms) !== null) return;
    for (const call of fresh) this.out.notify(call);
    if (now_ms - this.#rang_ms < EACH_MS && now_ms >= this.#rang_ms) return;
    if (this.out.sound()) this.#rang_ms = now_ms;
  }
}
