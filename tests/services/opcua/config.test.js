// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { test } from "node:test";
import { KEYS, readConfigFile, readConfigText, readSecret } from "../../../services/opcua/lib/config.js";
import { FEEDER, ROOT } from "./rig.js";

const GOOD = "url: opc.tcp://dcs:4840\nnodes:\n  A.PV: nsu=urn:x;s=A.PV\n";
const errorsOf = (text) => readConfigText("/etc/o/opcua.yaml", text).errors;
const one = (text, expected) => {
  const errors = errorsOf(text);
  assert.equal(errors?.length, 1, String(errors));
  assert.match(errors[0], expected);
};

test("defaults, and paths relative to the file", () => {
  const { config } = readConfigText("/etc/o/opcua.yaml", `${GOOD}state_directory: state\nuser: x\npassword: {file: secret}\n`);
  assert.equal(config.runtime_directory, "/run/loopwardend");
  assert.equal(config.state_directory, "/etc/o/state");
  assert.equal(config.publishing_interval, 1);
  assert.deepEqual(config.password, { file: "/etc/o/secret" });
  assert.deepEqual(config.nodes.get("A.PV"), { text: "nsu=urn:x;s=A.PV", uri: "urn:x", identifier: "s=A.PV" });
});

test("an error has line, column and key", () => {
  one(`${GOOD}publishing_intervall: 1\n`, /^\/etc\/o\/opcua\.yaml:4:1: error: publishing_intervall: is not known; did you mean 'publishing_interval'\?$/);
  one("nodes:\n  A: i=1\n", /:1:1: error: url: is missing/);
  one("url: opc.tcp://dcs\n", /nodes: is missing/);
  one(GOOD.replace("opc.tcp", "http"), /:1:6: error: url: must be opc\.tcp/);
  one(GOOD.replace("nsu=urn:x;", "ns=2;"), /:3:9: error: nodes\.A\.PV: must name its namespace by the URI/);
  one(GOOD.replace("s=A.PV", "x=1"), /nodes\.A\.PV: must be a node id/);
  one(`${GOOD}publishing_interval: 0x10\n`, /must be a number from 0\.05 to 60, in s \(got '0x10'\)/);
  one(`${GOOD}sampling_interval: 0\n`, /must be a number from/);
  one(`${GOOD}log_level: loud\n`, /must be debug, info, warn or error/);
  one(`${GOOD}reconnect_min: 5\nreconnect_max: 2\n`, /:5:1: error: reconnect_max: must be at least reconnect_min/);
  one(`${GOOD}user: x\n`, /user: needs password/);
  one(`${GOOD}user: x\npassword: secret\n`, /Don't write the password/);
  one(`${GOOD}user: x\npassword: {file: a, credential: b}\n`, /either `credential` or `file`/);
  one(`${GOOD}user: x\npassword: {credential: a/b}\n`, /must be a name/);
  assert.match(errorsOf(`${GOOD}user: x\npassword: {fil: a}\n`)[1], /:5:12: error: password\.fil: is not known; did you mean 'file'/);
  one(`${GOOD}  A.PV: nsu=urn:x;s=B\n`, /:4:3: error: .*unique/i);
  one(`${GOOD}user: &a x\npassword: {file: y}\n`, /anchors and tags/);
  one("- a\n", /must be a mapping/);
  one("url: opc.tcp://dcs\nnodes: {}\n", /must have at least one/);
  assert.match(readConfigFile("/nowhere/opcua.yaml").errors[0], /can't be read/);
});

test("a secret is the first line of its file", (t) => {
  const folder = fs.mkdtempSync("/tmp/loopwarden-opcua-");
  t.after(() => fs.rmSync(folder, { recursive: true }));
  fs.writeFileSync(path.join(folder, "password"), "a b\nmore\n");
  fs.writeFileSync(path.join(folder, "empty"), "\n");
  assert.equal(readSecret({ file: path.join(folder, "password") }), "a b");
  assert.throws(() => readSecret({ file: path.join(folder, "empty") }), /1 to 4096 bytes/);
  delete process.env.CREDENTIALS_DIRECTORY;
  assert.throws(() => readSecret({ credential: "password" }), /LoadCredential/);
  process.env.CREDENTIALS_DIRECTORY = folder;
  assert.equal(readSecret({ credential: "password" }), "a b");
});

test("the example is valid, and docs/reference/opcua-keys.md has every key with its default", () => {
  assert.ok(readConfigFile(path.join(ROOT, "examples/opcua/opcua.yaml")).config);
  const document = fs.readFileSync(path.join(ROOT, "docs/reference/opcua-keys.md"), "utf8");
  for (const [key, { fallback, meaning, unit }] of Object.entries(KEYS)) {
    const cell = fallback === undefined ? "required" : fallback === "" ? "none" : `${fallback}${unit ? ` ${unit}` : ""}`;
    assert.ok(document.includes(`| \`${key}\` | ${cell} | ${meaning} |`), `| \`${key}\` | ${cell} | ${meaning} |`);
  }
});

test("its version is the project's", () => {
  const [, version] = /project\(loopwarden VERSION (\S+)/.exec(fs.readFileSync(path.join(ROOT, "CMakeLists.txt"), "utf8"));
  assert.equal(JSON.parse(fs.readFileSync(path.join(path.dirname(FEEDER), "package.json"), "utf8")).version, version);
});
