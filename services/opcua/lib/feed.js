// SPDX-License-Identifier: Apache-2.0
// The connection to the daemon's feed.sock: a line of JSON for each notification, reconnected automatically. If values can't be sent, the
// newest of each name is kept, and sent first when the daemon accepts lines again.
import net from "node:net";
import os from "node:os";
import { pause } from "./pause.js";

const LONGEST_LINE = 60_000; // bytes; the daemon takes 65536
const RECONNECT_S = { first: 0.5, longest: 10 };

export class Feed {
  #path;
  #feeder;
  #log;
  #socket = null;
  #full = false; // the daemon reads slower than values arrive
  #ended = false;
  #newest = new Map(); // by name, all that were ever sent: a restarted daemon has no values
  #waiting = new Set();
  #replaced = 0;
  #attempts = 0;
  #timer;
  #said = "";

  // feeder: its name for the daemon; empty: its user identifies it.
  constructor(path, log, feeder = "") {
    this.#path = path;
    this.#feeder = feeder;
    this.#log = log;
    this.#connect();
  }

  // values: [{name, value, time, quality}]; an empty list shows that the feeder is alive.
  send(values) {
    for (const one of values) this.#newest.set(one.name, one);
    if (!this.#socket) return;
    if (!this.#full) {
      this.#write(values);
      return;
    }
    for (const { name } of values) {
      if (this.#waiting.has(name)) this.#replaced++;
      this.#waiting.add(name);
    }
  }

  end() {
    this.#ended = true;
    clearTimeout(this.#timer);
    this.#socket?.end();
  }

  #write(values) {
    let line = [];
    let length = 0;
    const flush = () => {
      this.#full = !this.#socket.write(`{"values":[${line.join(",")}]}\n`);
      [line, length] = [[], 0];
    };
    for (const one of values) {
      const text = JSON.stringify(one);
      if (length + Buffer.byteLength(text) > LONGEST_LINE) flush();
      line.push(text);
      length += Buffer.byteLength(text) + 1;
    }
    if (line.length > 0 || values.length === 0) flush();
  }

  #drained() {
    this.#full = false;
    const values = [...this.#waiting].map((name) => this.#newest.get(name));
    this.#waiting.clear();
    if (values.length > 0) this.#write(values);
    if (this.#replaced > 0) this.#log.warn(`loopwardend was slow: ${this.#replaced} values were replaced by newer ones before it took them`);
    this.#replaced = 0;
  }

  #connect() {
    const socket = net.createConnection(this.#path);
    let why = "";
    let connected = 0;
    socket.on("connect", () => {
      connected = Date.now();
      [this.#socket, this.#full] = [socket, false];
      this.#waiting.clear();
      if (this.#feeder) socket.write(`${JSON.stringify({ values: [], feeder: this.#feeder })}\n`);
      if (this.#newest.size > 0) this.#write([...this.#newest.values()]);
    });
    socket.on("drain", () => this.#drained());
    socket.on("data", () => {}); // requests without an id get no answer
    socket.on("error", (error) => { why = error.message; });
    socket.on("close", () => {
      this.#socket = null;
      if (this.#ended) return;
      // The daemon closes the connection of an unknown feeder at once.
      const stayed = connected > 0 && Date.now() - connected > 5000;
      this.#attempts = stayed ? 1 : this.#attempts + 1;
      this.#say(why || (stayed ? "loopwardend has closed it" : `loopwardend has closed it: is user '${os.userInfo().username}' a feeder in loopwardend.yaml?`));
      this.#timer = setTimeout(() => this.#connect(), pause(this.#attempts, RECONNECT_S) * 1000);
    });
    socket.on("ready", () => setTimeout(() => {
      if (this.#socket !== socket) return;
      this.#said = "";
      this.#log.info(`${this.#path}: connected`);
    }, 200));
  }

  // Logs a text once, not at each attempt.
  #say(text) {
    if (text !== this.#said) this.#log.warn(`${this.#path}: ${text}`);
    this.#said = text;
  }
}
