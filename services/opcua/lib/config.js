// SPDX-License-Identifier: Apache-2.0
// Reads opcua.yaml as strictly as the other files: every error has line, column, key and the expected value.
import fs from "node:fs";
import path from "node:path";
import { isMap, isScalar, LineCounter, parseDocument, visit } from "yaml";
import { didYouMean } from "./nearest.js";
import { parseNodeId } from "./node_ids.js";

const MOST_BYTES = 1024 * 1024;
const LONGEST_SECRET = 4096; // bytes
const LONGEST_NAME = 200; // characters

const positive = (low, high, fallback, meaning) => ({ kind: "number", low, high, unit: "s", fallback, meaning });
export const KEYS = {
  url: { kind: "url", meaning: "address of the server: opc.tcp://HOST[:PORT]. It is used as written, even if the server reports another host" },
  user: { kind: "text", fallback: "", meaning: "account on the server, with read permission only; empty: anonymous" },
  password: { kind: "secret", fallback: "", meaning: "password of `user`: `credential`, a name of LoadCredential=, or `file`, a path; its first line is used" },
  runtime_directory: { kind: "path", fallback: "/run/loopwardend", meaning: "runtime directory of loopwardend, which contains feed.sock" },
  feeder: { kind: "text", fallback: "", meaning: "name of this feeder in loopwardend.yaml; required if another feeder there has the same user" },
  state_directory: { kind: "path", fallback: "/var/lib/loopwarden-opcua", meaning: "directory of the own key and certificate and of trusted certificates" },
  publishing_interval: positive(0.05, 60, 1, "time between two messages of the server, which show that it is alive; at most a third of max_age of the loops"),
  sampling_interval: positive(0.01, 60, 1, "interval at which the server samples each node"),
  reconnect_min: positive(0.1, 600, 1, "first wait before a new attempt; it doubles"),
  reconnect_max: positive(0.1, 3600, 30, "longest wait before a new attempt, and before refused nodes are requested again"),
  log_level: { kind: "choice", words: ["debug", "info", "warn", "error"], fallback: "info", meaning: "lowest severity that is logged" },
  nodes: { kind: "nodes", meaning: "NAME: node id. The loops' files use NAME after `opcua:`" },
};

const READERS = {
  text: (text) => text,
  path: (text, key, file) => path.resolve(path.dirname(file), text),
  url: (text) => {
    let url;
    try {
      url = new URL(text);
    } catch {
      // Reported below.
    }
    if (url?.protocol !== "opc.tcp:" || url.hostname === "") throw new Error(`must be opc.tcp://HOST[:PORT] (got '${text}')`);
    return text;
  },
  number: (text, { low, high, unit }) => {
    const number = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i.test(text) ? Number(text) : NaN;
    if (!(number >= low && number <= high)) throw new Error(`must be a number from ${low} to ${high}, in ${unit} (got '${text}')`);
    return number;
  },
  choice: (text, { words }) => {
    if (!words.includes(text)) throw new Error(`must be ${words.slice(0, -1).join(", ")} or ${words.at(-1)} (got '${text}')`);
    return text;
  },
};

class Reader {
  #file;
  #lines;
  errors = [];

  constructor(file, lines) {
    this.#file = file;
    this.#lines = lines;
  }
  error(offset, key, message) {
    const { line, col } = this.#lines.linePos(offset);
    this.errors.push({ line, col, text: `${this.#file}:${line}:${col}: error: ${key ? `${key}: ` : ""}${message}` });
  }
  // Returns {key: its node} of a mapping whose keys are all known.
  entries(map, known, prefix = "") {
    const found = {};
    for (const { key, value } of map.items) {
      const name = String(key.value ?? key);
      if (known.includes(name)) found[name] = { at: key.range[0], value };
      else this.error(key.range[0], prefix + name, `is not known${didYouMean(name, known)}`);
    }
    return found;
  }
  textOf(node, key, at) {
    if (isScalar(node) && node.value !== null) return String(node.source ?? node.value);
    this.error(node?.range?.[0] ?? at, key, "must be a single value");
    return undefined;
  }
  read(key, spec, { at, value }) {
    if (spec.kind === "secret") return this.secret(key, value, at);
    if (spec.kind === "nodes") return this.nodes(value, at);
    const text = this.textOf(value, key, at);
    if (text === undefined) return undefined;
    try {
      return READERS[spec.kind](text, spec.kind === "path" ? key : spec, this.#file);
    } catch (error) {
      this.error(value.range[0], key, error.message);
      return undefined;
    }
  }
  secret(key, node, at) {
    if (!isMap(node)) {
      this.error(at, key, "must be {credential: NAME} or {file: PATH}. Don't write the password into this file");
      return null;
    }
    const found = this.entries(node, ["credential", "file"], `${key}.`);
    if (Object.keys(found).length !== 1) {
      this.error(at, key, "must have either `credential` or `file`, not both");
      return null;
    }
    const [[kind, { value }]] = Object.entries(found);
    const text = this.textOf(value, `${key}.${kind}`, at);
    if (kind === "file") return { file: path.resolve(path.dirname(this.#file), text ?? "") };
    if (text?.includes("/")) this.error(value.range[0], `${key}.credential`, "must be a name, without '/'");
    return { credential: text };
  }
  nodes(map, at) {
    const nodes = new Map();
    if (!isMap(map)) {
      this.error(at, "nodes", "must be a mapping of names to node ids");
      return nodes;
    }
    if (map.items.length === 0) this.error(at, "nodes", "must have at least one");
    for (const { key, value } of map.items) {
      const name = String(key.value ?? key);
      const text = this.textOf(value, `nodes.${name}`, key.range[0]);
      if (name === "" || name.length > LONGEST_NAME) this.error(key.range[0], `nodes.${name}`, `must have 1 to ${LONGEST_NAME} characters`);
      if (text === undefined) continue;
      try {
        nodes.set(name, { text, ...parseNodeId(text) });
      } catch (error) {
        this.error(value.range[0], `nodes.${name}`, `${error.message} (got '${text}')`);
      }
    }
    return nodes;
  }
}

// Returns {config} or {errors: [text]}. `needed`: required keys.
export function readConfigText(file, text, needed = ["url", "nodes"]) {
  const lines = new LineCounter();
  const document = parseDocument(text, { lineCounter: lines, prettyErrors: false });
  const reader = new Reader(file, lines);
  for (const error of document.errors) reader.error(error.pos[0], "", error.message.replace(/\s+/g, " "));
  if (reader.errors.length === 0) {
    visit(document, (_, node) => {
      if (node?.anchor || node?.tag || node?.type === "ALIAS") reader.error(node.range[0], "", "anchors and tags are not allowed");
    });
    if (!isMap(document.contents)) reader.error(0, "", "must be a mapping of keys to values");
  }
  const config = {};
  if (reader.errors.length === 0) {
    const found = reader.entries(document.contents, Object.keys(KEYS));
    for (const [key, spec] of Object.entries(KEYS)) {
      if (found[key]) config[key] = reader.read(key, spec, found[key]);
      else if (needed.includes(key)) reader.error(0, key, "is missing");
      else config[key] = spec.fallback;
    }
    if (found.password && !found.user) reader.error(found.password.at, "password", "needs user");
    if (found.user && !found.password) reader.error(found.user.at, "user", "needs password");
    if (config.reconnect_min > config.reconnect_max) reader.error((found.reconnect_max ?? found.reconnect_min).at, "reconnect_max", "must be at least reconnect_min");
  }
  reader.errors.sort((a, b) => a.line - b.line || a.col - b.col);
  return reader.errors.length > 0 ? { errors: reader.errors.map(({ text }) => text) } : { config };
}

export function readConfigFile(file, needed) {
  try {
    if (fs.statSync(file).size > MOST_BYTES) return { errors: [`${file}: error: is larger than 1 MiB`] };
    return readConfigText(file, fs.readFileSync(file, "utf8"), needed);
  } catch (error) {
    return { errors: [`${file}: error: can't be read: ${error.message}`] };
  }
}

// Returns the first line of the file. Throws Error.
export function readSecret({ credential, file }) {
  if (credential && !process.env.CREDENTIALS_DIRECTORY) throw new Error(`credential '${credential}': not provided by systemd. Add LoadCredential= to the unit`);
  const from = credential ? path.join(process.env.CREDENTIALS_DIRECTORY, credential) : file;
  const [line] = fs.readFileSync(from, "utf8").split(/\r?\n/, 1);
  if (line === "" || Buffer.byteLength(line) > LONGEST_SECRET) throw new Error(`${from}: its first line must have 1 to ${LONGEST_SECRET} bytes`);
  return line;
}
