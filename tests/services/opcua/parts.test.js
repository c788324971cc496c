// SPDX-License-Identifier: Apache-2.0
// Tests of values, node ids, pauses and lines of feed.sock.
import assert from "node:assert/strict";
import fs from "node:fs";
import net from "node:net";
import os from "node:os";
import path from "node:path";
import { test } from "node:test";
import "../../../services/opcua/lib/quiet.js";
import { Feed } from "../../../services/opcua/lib/feed.js";
import { didYouMean } from "../../../services/opcua/lib/nearest.js";
import { fromNodeId, parseNodeId, toNodeId } from "../../../services/opcua/lib/node_ids.js";
import { pause } from "../../../services/opcua/lib/pause.js";
import { toFed } from "../../../services/opcua/lib/value.js";
import { DataType, StatusCodes } from "../../../services/opcua/node_modules/node-opcua-client/dist/index.js";

const valueOf = (dataType, value, { statusCode = StatusCodes.Good, arrayType = 0, sourceTimestamp = new Date(1_764_000_000_123) } = {}) =>
  toFed({ value: { dataType, value, arrayType }, statusCode, sourceTimestamp });

test("numbers of every type are values", () => {
  assert.deepEqual(valueOf(DataType.Double, 12.5), { value: 12.5, time: 1_764_000_000.123, quality: "good", why: "" });
  assert.equal(valueOf(DataType.Boolean, true).value, 1);
  assert.equal(valueOf(DataType.UInt64, [1, 2]).value, 2 ** 32 + 2);
  assert.equal(valueOf(DataType.Int64, [0xffffffff, 0xfffffffe]).value, -2);
  assert.equal(valueOf(DataType.Int16, -3, { sourceTimestamp: null }).time, null);
});

test("a text becomes a word, for a loop's mode", () => {
  assert.equal(valueOf(DataType.String, "AUTO").value, "AUTO");
  assert.equal(valueOf(DataType.LocalizedText, { text: "MAN", locale: "en" }).value, "MAN");
});

test("a value that is not a number is bad, with the reason", () => {
  for (const [type, value, options, why] of [
    [DataType.String, "A".repeat(65), {}, /text/],
    [DataType.String, "", {}, /text/],
    [DataType.DateTime, new Date(), {}, /of type DateTime/],
    [DataType.Double, [1, 2], { arrayType: 1 }, /an array/],
    [DataType.Double, NaN, {}, /NaN/],
    [DataType.Double, 1, { statusCode: StatusCodes.BadSensorFailure }, /BadSensorFailure/],
  ]) {
    const fed = valueOf(type, value, options);
    assert.deepEqual([fed.value, fed.quality], [null, "bad"]);
    assert.match(fed.why, why);
  }
  assert.equal(toFed({ statusCode: StatusCodes.Good }).quality, "bad");
  const uncertain = valueOf(DataType.Double, 1, { statusCode: StatusCodes.UncertainLastUsableValue });
  assert.deepEqual([uncertain.value, uncertain.quality], [1, "uncertain"]);
});

test("node ids keep their namespace's URI whatever its index", () => {
  const text = "nsu=urn:a%3Bb%25;s=x;y=1";
  for (const namespaces of [["ua", "urn:a;b%"], ["ua", "other", "urn:a;b%"]]) {
    const nodeId = toNodeId(parseNodeId(text), namespaces);
    assert.deepEqual([nodeId.namespace, nodeId.value], [namespaces.length - 1, "x;y=1"]);
    assert.equal(fromNodeId(nodeId, namespaces), text);
  }
  assert.equal(toNodeId(parseNodeId(text), ["ua"]), undefined);
  assert.equal(fromNodeId(toNodeId(parseNodeId("i=85"), ["ua"]), ["ua"]), "i=85");
  for (const wrong of ["", "s=", "i=x", "i=4294967296", "g=1", "ns=1;s=x", "nsu=;s=x", "FIC205.PV"]) assert.throws(() => parseNodeId(wrong), /must/, wrong);
});

test("waits double up to the longest", () => {
  assert.deepEqual([1, 2, 3, 9].map((n) => pause(n, { first: 1, longest: 5 }, 1)), [1, 2, 4, 5]);
  assert.equal(pause(1, { first: 1, longest: 5 }, 0), 0.5);
  assert.equal(didYouMean("brows", ["trust", "browse"]), "; did you mean 'browse'?");
  assert.equal(didYouMean("xyz", ["trust", "browse"]), "");
});

test("feed.sock receives valid lines, and after a reconnection the newest value of each name", async (t) => {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "loopwarden-opcua-"));
  const file = path.join(folder, "feed.sock");
  let socket;
  let text = "";
  const daemon = net.createServer((one) => {
    socket = one;
    one.on("data", (more) => { text += more; });
    one.on("error", () => {});
  }).listen(file);
  const feed = new Feed(file, { info() {}, warn() {} });
  t.after(() => {
    feed.end();
    socket.destroy();
    daemon.close();
    fs.rmSync(folder, { recursive: true });
  });
  const until = async (holds) => { while (!holds()) await new Promise((done) => { setTimeout(done, 10); }); };
  await until(() => socket);
  feed.send([]);
  await until(() => text === '{"values":[]}\n');
  const many = Array.from({ length: 1000 }, (_, i) => ({ name: `FIC${i}`.padEnd(150, "x"), value: i, time: null, quality: "good" }));
  feed.send(many);
  const received = () => text.trimEnd().split("\n").flatMap((line) => JSON.parse(line).values);
  await until(() => text.endsWith("\n") && received().length === 1000);
  assert.ok(text.split("\n").every((line) => line.length < 65_536));
  feed.send([{ ...many[0], value: -1 }]);
  await until(() => text.endsWith("]}\n") && received().length === 1001);
  text = "";
  const before = socket;
  socket.destroy();
  await until(() => socket !== before && text.endsWith("\n") && received().length === 1000);
  assert.equal(received()[0].value, -1);

  // A daemon that stops reading for a while receives the newest value of each name afterwards.
  socket.pause();
  text = "";
  for (let i = 1; i <= 200; i++) feed.send(many.map((one) => ({ ...one, value: i })));
  socket.resume();
  await until(() => text.endsWith("\n") && received().some(({ name, value }) => name === many[999].name && value === 200));
  assert.ok(received().length < 200 * 1000);
});
