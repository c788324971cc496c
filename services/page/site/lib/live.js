// SPDX-License-Identifier: Apache-2.0
// Live data of the box: one stream of server-sent events for all views and tabs. It reports when values become old, and
// reconnects without user action.
import {Spark} from './history.js';
import {get, keepCsrf, loopPath, onLost, post, query} from './api.js';
import {openStream} from './event_stream.js';
import {person} from './person.js';

const OLD_AFTER_MS = 1500; // checked each 250 ms, so it is noticed within two seconds
const STEPS = 60;

export class Live extends EventTarget {
  session = null;
  describe = null; // the daemon's, with `loops`
  overview = null; // columns in the order of describe.loops; `stands`: whether a loop's cycle has stopped although the daemon answers
  alarms = [];
  incidents = []; // the newest of each loop, if it is active or waits
  alarmsKnown = false; // whether `alarms` was received from the box
  sparks = []; // one for each loop
  daemon = {up: true, since_ms: null, why: ''};
  heard_ms = 0; // arrival of the newest overview, on this computer's clock
  stale = null; // {since_ms, why} while values are old
  places = new Map(); // tag -> index
  #source = null;
  #frame = 0;
  #fresh = new Set();
  #filled = new Set(); // indexes of the loops whose steps were read from their records
  #moved = []; // for each loop, when its cycle last advanced
  #periods = [];
  #retry = 0;
  #sparks_due = 0;
  #asked = 0; // last request for the description
  #told_ms = -Infinity; // last request for the session

  // A valve alarm of at least this size needs action now, % of the CO span.
  get severe_percent() { return this.describe?.alarms?.severe_percent ?? 5; }

  async start() {
    this.session = await get('/api/session');
    keepCsrf(this.session.csrf);
    onLost.act = () => this.lose();
    person.watch(document);
    setInterval(() => { this.#watch(); this.#keep(); }, 250);
    document.addEventListener('visibilitychange', () => { if (!document.hidden) this.#watch(); });
    if (!this.session.must_login) this.connect();
  }

  // Without a daemon there is no stream. renew: the session has changed.
  connect(renew = false) {
    if (this.session.box === false) return;
    this.#source?.close();
    if (!this.overview) this.heard_ms = Date.now();
    const source = openStream(renew);
    this.#source = source;
    const on = (type, act) => source.addEventListener(type, (event) => act(event.data ? JSON.parse(event.data) : null));
    on('overview', (o) => this.#take(o));
    on('alarms', (a) => { this.alarms = a.alarms; this.incidents = a.incidents; this.alarmsKnown = true; this.#soon('alarms'); });
    on('daemon', (d) => { this.daemon = d; this.#watch(); this.#soon('daemon'); });
    on('describe', () => this.#fetchDescribe());
    on('ended', () => this.lose());
    source.onopen = () => { this.#retry = 0; this.#fetchDescribe(); };
    source.onerror = () => {
      // After a lost connection the browser reconnects itself. After a refusal this code has to.
      if (source.readyState !== EventSource.CLOSED) return;
      clearTimeout(this.#retry);
      this.#retry = setTimeout(() => this.#comeBack(), 1000);
    };
  }

  disconnect() { this.#source?.close(); }

  // Reads the session again: it may have ended, or another server may answer now.
  async #comeBack() {
    try {
      await this.#fetchSession();
      if (!this.session.must_login) this.connect();
    } catch {
      this.#retry = setTimeout(() => this.#comeBack(), 1000);
    }
  }

  async #fetchSession() {
    const told = () => JSON.stringify({...this.session, utc_offset_s: 0, csrf: ''}), before = told();
    const session = await get('/api/session');
    keepCsrf(session.csrf);
    this.#told_ms = performance.now();
    if (session.must_login && !this.session.must_login) { this.lose(); return; }
    this.session = session;
    if (told() !== before) this.#soon('session');
  }

  // After a log-in.
  async renewSession() {
    await this.#fetchSession();
    if (!this.session.must_login) this.connect(true);
  }

  async logOut() {
    try {
      await post('/api/logout', {});
    } catch {
      // If it hasn't reached the box, the session still exists and is shown again.
    }
    this.lose();
  }

  // Ends the session: removes all data of the box from memory and screen.
  lose() {
    if (!this.session?.login || this.session.must_login) return;
    this.#source?.close();
    clearTimeout(this.#retry);
    this.session = {...this.session, user: null, role: 'none', must_login: true, can: {alarms: false, control: false}};
    Object.assign(this, {describe: null, overview: null, alarms: [], incidents: [], alarmsKnown: false, sparks: [], places: new Map(), stale: null,
      daemon: {up: true, since_ms: null, why: ''}, heard_ms: 0});
    this.#periods = [];
    this.#moved = [];
    this.#fresh.clear();
    for (const type of ['session', 'describe', 'alarms', 'stale', 'overview']) this.dispatchEvent(new Event(type));
    this.#comeBack(); // gets the token for a visitor; another tab may be logged in
  }

  // Keeps the session of a user who is present at a view without requests. If no stream reports the session's end, the server is asked.
  #keep() {
    const now = performance.now();
    if (!this.session?.user || now - this.#told_ms < 2000) return;
    if (!person.isUntold(now) && (this.session.box !== false || document.hidden)) return;
    this.#told_ms = now;
    this.#fetchSession().catch(() => {});
  }

  async #fetchDescribe() {
    this.#asked = performance.now();
    try {
      const describe = await get('/api/describe');
      // If a daemon never answered, its loops are unknown; that differs from a daemon without loops.
      if (describe.up === false && (this.describe || !describe.loops?.length)) return;
      const same = JSON.stringify(describe.loops?.map((l) => l.tag)) === JSON.stringify(this.describe?.loops?.map((l) => l.tag));
      this.describe = {...describe, loops: describe.loops ?? []};
      if (!same) {
        this.places = new Map(this.describe.loops.map((loop, i) => [loop.tag, i]));
        this.sparks = this.describe.loops.map(() => new Spark(STEPS, 10));
        this.overview = null;
        this.#periods = [];
      }
      this.#soon('describe');
      await Promise.all([this.#fetchSparks(), this.#fetchSession()]); // the daemon decides which actions are allowed
    } catch {
      // The stream reports the failure, and requests again after it.
    }
  }

  async #fetchSparks() {
    this.#sparks_due = performance.now() + 300_000;
    const {step_s, pv} = await get('/api/sparklines');
    if (pv.length !== this.sparks.length) return;
    pv.forEach((steps, i) => { this.sparks[i].load(steps, step_s); });
    this.#filled.clear();
    this.#soon('sparks');
    this.#soon('overview');
  }

  // After a restart the server's steps are empty: reads those of loop i from its records, once.
  async fillSpark(i) {
    const spark = this.sparks[i], loop = this.describe?.loops[i], now_ms = this.overview?.now_ms;
    if (!spark?.lacks || !loop?.recording || !now_ms || this.#filled.has(i)) return;
    this.#filled.add(i);
    const pace = this.describe.accelerate || 1, from_ms = Math.round(now_ms - 1000 * STEPS * spark.step_s / pace);
    try {
      spark.fill(await get(`${loopPath(loop.tag, 'history')}${query({from_ms, to_ms: Math.round(now_ms), points: 8 * STEPS})}`), now_ms, pace);
      this.#soon('overview');
    } catch {
      // The strip stays as it is.
    }
  }

  #take(o) {
    const loops = this.describe?.loops;
    this.heard_ms = Date.now();
    if (!loops || o.pv.length !== loops.length) {
      // The description of these columns is still on its way, or was lost.
      if (performance.now() - this.#asked > 1000) this.#fetchDescribe();
      return;
    }
    const now = performance.now();
    for (let i = 0; i < loops.length; ++i) {
      if (o.period[i] === this.#periods[i]) continue;
      this.#moved[i] = now;
      if (o.period[i] !== null) this.sparks[i].add(o.period[i] * loops[i].sample_time_s, o.pv[i]);
    }
    this.#periods = o.period;
    o.stands = loops.map((_, i) => o.period[i] !== null && this.#stands(i, now));
    this.overview = o;
    if (this.stale) this.#watch();
    this.#soon('overview');
    if (now > this.#sparks_due) this.#fetchSparks().catch(() => {});
  }

  #stands(i, now) {
    const limit = 2000 + 3000 * this.describe.loops[i].sample_time_s / (this.describe.accelerate || 1);
    return now - (this.#moved[i] ?? 0) > limit;
  }

  #watch() {
    if (!this.heard_ms) return; // not connected
    const silent = Date.now() - this.heard_ms > OLD_AFTER_MS;
    let stale = null;
    if (this.daemon.up === false) stale = {since_ms: this.daemon.since_ms ?? this.heard_ms, why: 'daemon', words: this.daemon.why};
    else if (silent) stale = {since_ms: this.heard_ms || Date.now(), why: 'silent', words: ''};
    if (stale && this.stale && stale.why === this.stale.why) return;
    if (!stale && !this.stale) return;
    this.stale = stale;
    this.#soon('stale');
    this.#soon('overview');
  }

  // Shows everything that arrived since the last frame with the next one. A hidden page has no frames.
  #soon(type) {
    this.#fresh.add(type);
    if (this.#frame) return;
    const tell = () => {
      this.#frame = 0;
      const types = [...this.#fresh];
      this.#fresh.clear();
      for (const one of types) this.dispatchEvent(new Event(one));
    };
    this.#frame = document.hidden ? setTimeout(tell, 100) : requestAnimationFrame(tell);
  }
}

export const live = new Live();
