// SPDX-License-Identifier: Apache-2.0
// Finds whether a user is present at this page: a key was pressed or a pointer moved within the last minute. Only then do requests keep an
// idle session alive. Automatic requests of the page don't.

const HERE_MS = 60_000;
const RENEWED_EACH_MS = 20_000;
const SIGNS = ['keydown', 'pointerdown', 'pointermove', 'wheel'];

export class Person {
  #seen = -Infinity; // on this computer's clock, ms
  #told = -Infinity;
  watch(target) {
    for (const sign of SIGNS) target.addEventListener(sign, () => this.seen(performance.now()), {passive: true, capture: true});
  }
  seen(now) { this.#seen = now; }
  isHere(now) { return now - this.#seen < HERE_MS; }
  // For a request that is sent now.
  headers(now) {
    if (!this.isHere(now)) return {};
    this.#told = now;
    return {'X-Loopwarden-Person': '1'};
  }
  // In a view without requests, the presence of a user must still be reported.
  isUntold(now) { return this.isHere(now) && now - this.#told >= RENEWED_EACH_MS; }
}

export const person = new Person();
