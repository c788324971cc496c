// SPDX-License-Identifier: Apache-2.0
// Sound and notification for waiting alarms, as the user of this browser chose. Pure: `out` makes sounds and notifications, `memory` stores.

export const PRIORITIES = ['off', 'high', 'low']; // no alarm; alarms that need action now; every alarm
const EACH_MS = 10_000; // between two sounds, also if further alarms are raised. A muted browser makes no sound
const WISH = 'bell', SILENT = 'bell-silent-until';

export class Bell {
  #told = null; // keys of the notified alarms; null: not known yet
  #rang_ms = -Infinity;

  // memory: {recall(key), remember(key, text or null)}; out: {sound(): whether it played, notify(call)}.
  constructor(memory, out) { Object.assign(this, {memory, out}); }

  get asked() { return PRIORITIES.includes(this.memory.recall(WISH)); }
  get wish() { return this.asked ? this.memory.recall(WISH) : 'off'; }
  set wish(priority) { this.memory.remember(WISH, priority); }

  // End of the silence, UTC in ms; null: not silenced.
  silentUntil(now_ms) {
    const until = Number(this.memory.recall(SILENT));
    return until > now_ms ? until : null;
  }
  silence(until_ms) { this.memory.remember(SILENT, until_ms === null ? null : String(until_ms)); }

  // `calls`: waiting alarms, {key, grave: high or low, ...}; null: not known.
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
