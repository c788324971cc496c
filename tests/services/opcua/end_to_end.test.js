// SPDX-License-Identifier: Apache-2.0
// From an OPC UA server to loops of the real daemon. The server uses the same library as the feeder
// (docs/project/testing.md).
import assert from "node:assert/strict";
import fs from "node:fs";
import path from "node:path";
import { after, before, test } from "node:test";
import { Rig } from "./rig.js";

const rig = new Rig();
const eventually = rig.eventually.bind(rig);
const PV = "FIC001.PV";
const good = async (tag) => {
  const loop = await rig.loop(tag);
  return loop.pv_quality === "good" && loop.mode === "AUTO" && loop.sp !== null && loop.co !== null;
};
const reason = async (tag, text) => (await rig.loop(tag)).pv_reason === text;

before(async () => {
  await rig.start(["FIC001", "FIC002"]);
  await rig.startServer();
});
after(() => rig.end());

test("an untrusted certificate ends the feeder with exit code 78 and its fingerprint", async () => {
  const started = rig.run();
  assert.equal(started.status, 78);
  const [, fingerprint] = /SHA-256 ([0-9A-F:]{95})/.exec(started.stderr.slice(started.stderr.indexOf("not trusted")));
  assert.equal(rig.lines.length, 0);
  assert.equal(rig.run("trust", "--fingerprint", fingerprint).status, 0);
});

test("browse prints the server's data about its tags", () => {
  const { status, stdout } = rig.run("browse");
  assert.equal(status, 0);
  const rows = stdout.trimEnd().split("\n");
  assert.equal(rows[0], "name,node_id,data_type,unit,low,high,description,value");
  assert.equal(rows.length, 1 + 8);
  assert.ok(rows.includes('FIC001.SP,nsu=urn:test:dcs;s=FIC001.SP,Double,m3/h,0,40,"Feed, ""wanted""",'));
  assert.ok(rows.includes("FIC002.MODE,nsu=urn:test:dcs;s=FIC002.MODE,Int32,,,,,"));
});

test("a wrong password is reported, and browse prints no variables", () => {
  rig.write("password", "wrong\n");
  const { status, stdout, stderr } = rig.run("browse");
  rig.write("password", "correct horse battery\n");
  assert.equal(status, 74);
  assert.equal(stdout, "");
  assert.match(stderr, /BadUserAccessDenied|BadIdentityToken/);
});

test("values reach the loops with the source's stamps", async () => {
  rig.startFeeder();
  await eventually("both loops are good", async () => await good("FIC001") && await good("FIC002"));
  const loop = await rig.loop("FIC001");
  assert.deepEqual([loop.pv, loop.sp, loop.co, loop.mode], [20, 21, 50, "AUTO"]);
  const stamp = Math.round(Date.now() - 500) / 1000;
  await rig.server.order("set", PV, 12.5, stamp);
  await eventually("PV is 12.5", async () => (await rig.loop("FIC001")).pv === 12.5);
  assert.deepEqual(rig.newest(PV), { name: PV, value: 12.5, time: stamp, quality: "good" });
  await rig.server.order("set", "FIC001.MODE", 0);
  await eventually("manual", async () => (await rig.loop("FIC001")).mode === "MAN");
  await rig.server.order("set", "FIC001.MODE", 1);
  await eventually("held while nothing changes", () => reason("FIC001", "held"));
});

test("bad and uncertain quality are shown by name", async () => {
  for (const [code, quality, value] of [["BadSensorFailure", "bad", null], ["UncertainLastUsableValue", "uncertain", 12.5]]) {
    await rig.server.order("status", PV, code);
    await eventually(code, () => rig.newest(PV).quality === quality);
    await eventually("the loop says it", async () => (await rig.loop("FIC001")).pv_quality === quality);
    assert.equal((await rig.loop("FIC001")).pv_reason, "said by the source");
    assert.equal(rig.newest(PV).value, value);
    await eventually("it is logged", () => rig.log.includes(`${PV}: ${code}`));
  }
  assert.equal((await rig.loop("FIC002")).pv_quality, "good");
  await rig.server.order("status", PV, "Good");
  await eventually("good again", () => good("FIC001"));
});

test("a renamed tag is bad by name, and is good again with its old name", async () => {
  await rig.server.order("rename", PV, "FIC001.PX");
  await eventually("bad", () => reason("FIC001", "said by the source"));
  await eventually("it is logged", () => /BadNodeIdUnknown.*FIC001\.PV/.test(rig.log) || /FIC001\.PV.*BadNodeIdUnknown/.test(rig.log));
  assert.equal((await rig.loop("FIC002")).pv_quality, "good");
  await rig.server.order("rename", "FIC001.PX", PV);
  await eventually("good again, with the old stamp", () => good("FIC001"));
});

test("a session that the server drops is opened again without a restart", async () => {
  const before = await rig.server.order("requests");
  await rig.server.order("drop");
  await eventually("another session", async () => (await rig.server.order("requests")).CreateSessionRequest > before.CreateSessionRequest);
  await rig.server.order("set", PV, 13.5);
  await eventually("its values arrive", async () => (await rig.loop("FIC001")).pv === 13.5);
});

test("values of a lost server are bad, with its address; it returns with a new certificate, other namespace indices and narrow limits", async () => {
  const asked = await rig.server.order("requests");
  assert.ok(asked.CreateMonitoredItemsRequest > 0);
  for (const name of Object.keys(asked)) assert.doesNotMatch(name, /Write|Call|HistoryUpdate|AddNodes|DeleteNodes|AddReferences|DeleteReferences/);
  rig.server.kill();
  await eventually("bad", () => reason("FIC001", "link lost"));
  assert.match(rig.newest(PV).source, /^server opc\.tcp:/);
  assert.equal((await rig.loop("FIC001")).pv, null);
  // Simulates another certificate. The feeder waits, and continues only after the certificate is
  // trusted.
  const trusted = path.join(rig.folder, "opcua/trusted");
  fs.renameSync(trusted, `${trusted}.away`);
  fs.mkdirSync(trusted);
  await rig.startServer("--first-namespace", "urn:test:other", "--most-per-call", "3", "--most-items", "5", "--sampling", "300", "--publishing", "600");
  await eventually("it is logged", () => rig.log.includes("the server's certificate is not trusted"));
  assert.equal((await rig.loop("FIC001")).pv_reason, "link lost");
  fs.rmdirSync(trusted);
  fs.renameSync(`${trusted}.away`, trusted);
  await eventually("both are good", async () => await good("FIC001") && await good("FIC002"), 60);
  assert.equal((await rig.loop("FIC001")).pv, 20);
  assert.match(rig.log, /the server samples each 0.3 s instead of 0.1 s/);
  assert.match(rig.log, /the server publishes each 0.6 s instead of 0.2 s/);
  const again = await rig.server.order("requests");
  assert.ok(again.CreateSubscriptionRequest >= 2); // 9 items, 5 each
  assert.ok(again.CreateMonitoredItemsRequest >= 3); // 3 each
  await rig.server.order("set", "FIC002.MODE", 0); // the last item
  await eventually("every value still arrives", async () => (await rig.loop("FIC002")).mode === "MAN");
});

test("the feeder ends on a signal, and its loops are stale", async () => {
  const ended = new Promise((done) => { rig.feeder.once("exit", done); });
  rig.feeder.kill("SIGTERM");
  assert.equal(await ended, 0);
  await eventually("stale", () => reason("FIC001", "stale"));
});
