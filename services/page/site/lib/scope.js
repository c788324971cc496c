// SPDX-License-Identifier: Apache-2.0
// Resources of a view that must end when the user leaves it: listeners, timers, requests.

export class Scope {
  #abort = new AbortController();
  #ends = [];
  get signal() { return this.#abort.signal; }
  get over() { return this.#abort.signal.aborted; }
  atEnd(end) { this.#ends.push(end); }
  on(target, type, act, options = {}) { target.addEventListener(type, act, {...options, signal: this.signal}); }
  // Calls `act` now, and again `ms` after each call has ended; pauses while the page is hidden.
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
