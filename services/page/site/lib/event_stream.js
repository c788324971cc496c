// SPDX-License-Identifier: Apache-2.0
// The stream of events as a tab receives it: from the worker that all tabs share. A browser without shared workers opens one stream per tab.

export const KINDS = ['daemon', 'describe', 'alarms', 'overview', 'ended'];

// Has the members of EventSource that Live uses.
class SharedStream extends EventTarget {
  readyState = 0;
  #worker = new SharedWorker('/lib/events_worker.js', {type: 'module'});
  #own = null; // if the worker can't be loaded

  constructor(renew) {
    super();
    this.#worker.onerror = () => this.#openOwn();
    this.#worker.port.onmessage = ({data}) => this.#take(data);
    this.#worker.port.postMessage({renew});
  }

  #take({kind, data, open}) {
    if (this.readyState === EventSource.CLOSED) return;
    if (kind) { this.dispatchEvent(new MessageEvent(kind, {data})); return; }
    this.readyState = open ? EventSource.OPEN : EventSource.CLOSED;
    if (open) this.onopen(); else this.onerror();
  }

  #openOwn() {
    if (this.readyState === EventSource.CLOSED || this.#own) return;
    const own = this.#own = new EventSource('/api/events');
    for (const kind of KINDS) own.addEventListener(kind, ({data}) => this.#take({kind, data}));
    own.onopen = () => this.#take({open: true});
    own.onerror = () => { if (own.readyState === EventSource.CLOSED) this.#take({}); };
  }

  close() {
    this.readyState = EventSource.CLOSED;
    this.#own?.close();
    this.#worker.port.postMessage({leave: true});
    this.#worker.port.onmessage = null;
  }
}

// renew: opens the stream again, because the session has changed.
export const openStream = (renew) => (globalThis.SharedWorker ? new SharedStream(renew) : new EventSource('/api/events'));
