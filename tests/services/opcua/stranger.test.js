// SPDX-License-Identifier: Apache-2.0
// Byte sequences that answer in place of an OPC UA server (OPC UA 10000-6, 7.1.2).
import assert from "node:assert/strict";
import fs from "node:fs";
import net from "node:net";
import os from "node:os";
import path from "node:path";
import { test } from "node:test";
import { Certificates } from "../../../services/opcua/lib/certificates.js";
import { askCertificate } from "../../../services/opcua/lib/server.js";

const u32 = (n) => { const bytes = Buffer.alloc(4); bytes.writeUInt32LE(n); return bytes; };
const text = (words) => Buffer.concat([u32(words.length), Buffer.from(words)]);
const message = (type, body) => Buffer.concat([Buffer.from(`${type}F`), u32(8 + body.length), body]);
const ACKNOWLEDGE = message("ACK", Buffer.concat([0, 65535, 65535, 1 << 24, 1000].map(u32)));

test("a peer that is not an OPC UA server is refused soon, with a reason", { timeout: 60_000 }, async (t) => {
  const folder = fs.mkdtempSync(path.join(os.tmpdir(), "loopwarden-opcua-"));
  const certificates = await Certificates.open(folder);
  t.after(() => fs.rmSync(folder, { recursive: true }));
  for (const [what, answer] of [
    ["hangs up", () => null],
    ["is a web server", () => Buffer.from("HTTP/1.1 400 Bad Request\r\n\r\n")],
    ["refuses the URL", () => message("ERR", Buffer.concat([u32(0x80830000), text("BadTcpEndpointUrlInvalid")]))],
    ["ends behind its acknowledgement", (first) => (first ? ACKNOWLEDGE : null)],
    ["sends noise behind it", (first) => (first ? ACKNOWLEDGE : Buffer.alloc(200, 0xa5))],
    ["claims a message of 4 GB", (first) => (first ? ACKNOWLEDGE : Buffer.concat([Buffer.from("OPNF"), u32(0xffffffff)]))],
  ]) {
    const server = net.createServer((socket) => {
      let first = true;
      socket.on("error", () => {});
      socket.on("data", () => {
        const bytes = answer(first);
        first = false;
        if (bytes === null) socket.destroy();
        else socket.write(bytes, () => { if (answer(false) === null || !bytes.equals(ACKNOWLEDGE)) setTimeout(() => socket.destroy(), 200); });
      });
    });
    await new Promise((done) => { server.listen(0, "127.0.0.1", done); });
    const config = { url: `opc.tcp://127.0.0.1:${server.address().port}` };
    await assert.rejects(askCertificate(config, certificates), (error) => error.message.length > 0, what);
    server.close();
  }
});
