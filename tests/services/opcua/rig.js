// SPDX-License-Identifier: Apache-2.0
// An OPC UA server, the real loopwardend, and loopwarden-opcua between them, in a separate folder.
import { spawn, spawnSync } from "node:child_process";
import fs from "node:fs";
import net from "node:net";
import os from "node:os";
import path from "node:path";
import readline from "node:readline";

const HERE = import.meta.dirname ?? path.dirname(new URL(import.meta.url).pathname);
export const ROOT = path.resolve(HERE, "../../..");
const BIN = process.env.LOOPWARDEN_BIN_DIR ?? path.join(ROOT, "build/release/bin");
export const FEEDER = path.join(ROOT, "services/opcua/loopwarden-opcua");

const sleep = (ms) => new Promise((done) => { setTimeout(done, ms); });
const freePort = () => new Promise((done) => {
  const tried = net.createServer().listen(0, "127.0.0.1", () => {
    const { port } = tried.address();
    tried.close(() => done(port));
  });
});

const loopFile = (tag) => `loop: ${tag}
control: elsewhere
sample_time: 0.1
process_variable: {unit: m3/h, range: [0, 40], max_age: 3}
output: {unit: "%", range: [0, 100]}
recording: {enabled: false}
io:
  backend: feed
  pv: {feed: "opcua:${tag}.PV"}
  co: {feed: "opcua:${tag}.OP"}
  sp: {feed: "opcua:${tag}.SP"}
  mode: {feed: "opcua:${tag}.MODE", automatic: [1], manual: [0]}
`;

export class Rig {
  folder = fs.mkdtempSync(path.join(os.tmpdir(), "loopwarden-opcua-"));
  lines = []; // lines written by the feeder
  log = ""; // of the feeder
  #children = new Set();
  #proxy;

  async start(tags) {
    this.port = await freePort();
    fs.mkdirSync(path.join(this.folder, "config/loops.d"), { recursive: true });
    fs.mkdirSync(path.join(this.folder, "feeder"));
    this.write("config/loopwardend.yaml", `real_time: {priority: 0, lock_memory: false}
runtime_directory: ${this.folder}
state_directory: ${this.folder}/state
feeders: {opcua: {user: ${os.userInfo().username}}}
`);
    for (const tag of tags) this.write(`config/loops.d/${tag}.yaml`, loopFile(tag));
    this.write("password", "correct horse battery\n");
    const nodes = tags.flatMap((tag) => ["PV", "OP", "SP", "MODE"].map((part) => `  ${tag}.${part}: nsu=urn:test:dcs;s=${tag}.${part}\n`));
    this.write("opcua.yaml", `url: opc.tcp://127.0.0.1:${this.port}
user: watcher
password: {file: password}
runtime_directory: feeder
state_directory: opcua
publishing_interval: 0.2
sampling_interval: 0.1
reconnect_min: 0.2
reconnect_max: 1
nodes:
${nodes.join("")}`);
    this.#listen();
    this.#spawn(path.join(BIN, "loopwardend"), ["--config", path.join(this.folder, "config")]);
    await this.eventually("the daemon answers", () => fs.existsSync(path.join(this.folder, "feed.sock")));
  }

  async eventually(what, holds, seconds = 15) {
    for (const end = Date.now() + seconds * 1000; Date.now() < end; await sleep(50)) {
      if (await holds()) return;
    }
    throw new Error(`not within ${seconds} s: ${what}; log of the feeder:\n${this.log}`);
  }

  // Lines of the feeder are passed on to the daemon, and are stored.
  #listen() {
    this.#proxy = net.createServer((feeder) => {
      const daemon = net.createConnection(path.join(this.folder, "feed.sock"));
      feeder.pipe(daemon).pipe(feeder);
      for (const one of [feeder, daemon]) one.on("error", () => one.destroy());
      readline.createInterface({ input: feeder }).on("line", (line) => this.lines.push(...JSON.parse(line).values));
    }).listen(path.join(this.folder, "feeder/feed.sock"));
  }

  write(name, text) { fs.writeFileSync(path.join(this.folder, name), text); }

  #spawn(program, words) {
    const child = spawn(program, words, { stdio: ["pipe", "pipe", "pipe"] });
    this.#children.add(child);
    child.on("close", () => this.#children.delete(child));
    return child;
  }

  async startServer(...options) {
    const account = ["--user", "watcher:correct horse battery"];
    const server = this.#spawn(process.execPath, [path.join(HERE, "server.js"), String(this.port), path.join(this.folder, "server"), ...account, ...options]);
    let waiting;
    let failed;
    let said = "";
    server.stderr.on("data", (text) => { said += text; });
    readline.createInterface({ input: server.stdout }).on("line", (line) => waiting?.(line));
    server.once("close", () => failed?.(new Error(`the server has ended: ${said}`)));
    const next = () => new Promise((done, fail) => { [waiting, failed] = [done, fail]; });
    let line = await next();
    while (line !== "ready") line = await next();
    this.server = {
      order: async (...words) => {
        const answer = next();
        server.stdin.write(`${words.join(" ")}\n`);
        return JSON.parse(await answer);
      },
      kill: () => server.kill("SIGKILL"),
    };
  }

  startFeeder() {
    const feeder = this.#spawn(FEEDER, ["--config", path.join(this.folder, "opcua.yaml")]);
    feeder.stderr.on("data", (text) => { this.log += text; });
    this.feeder = feeder;
  }

  run(...words) {
    const { status, stdout, stderr } = spawnSync(FEEDER, [...words, "--config", path.join(this.folder, "opcua.yaml")], { encoding: "utf8" });
    return { status, stdout, stderr };
  }

  ask(request) {
    return new Promise((done, fail) => {
      const socket = net.createConnection(path.join(this.folder, "status.sock"));
      socket.on("error", fail);
      readline.createInterface({ input: socket }).once("line", (line) => {
        socket.destroy();
        done(JSON.parse(line));
      });
      socket.write(`${JSON.stringify(request)}\n`);
    });
  }
  loop(tag) { return this.ask({ request: "loop", loop: tag }); }
  newest(name) { return this.lines.findLast((one) => one.name === name); }

  async end() {
    const ends = [...this.#children].map((child) => new Promise((done) => { child.once("close", done); }));
    for (const child of this.#children) child.kill("SIGKILL");
    await Promise.all(ends);
    this.#proxy?.close();
    fs.rmSync(this.folder, { recursive: true, force: true });
  }
}
