// SPDX-License-Identifier: Apache-2.0
// What a view has begun and must end when it is left: listeners, timers, requests.

export class Scope {
  #abort = new AbortController();
  #ends = [];
  get signal() { return this.#abort.signal; }
  get over() { return this.#abort.signal.aborted; }
  atEnd(end) { this.#ends.push(end); }
  on(target, type, act, options = {}) { target.addEventListener(type, act, {...options, signal: this.signal}); }
  // Calls `act` now and `ms` after it has ended; not while nobody looks.
  every(ms, act) {
    let timer = 0;
    const round = async () => {
      if (this.over) return;
      if (!document.hidden) await act();
      if (!this.over) timer = setTimeout(round, ms);
    };
    this.on(document, 'visibilitychange', () => {
      if (document.hidden) return;
      clearTimeout(timer);
      timer = setTimeout(round, 0);
    });
    this.atEnd(() => clearTimeout(timer));
    return round();
  }
  end() {
    this.#abort.abort();
    for (const end of this.#ends) end();
  }
}
