// SPDX-License-Identifier: Apache-2.0
import assert from "node:assert/strict";
import { X509Certificate } from "node:crypto";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { after, test } from "node:test";
import { Certificates, Expired, Untrusted } from "../../../services/opcua/lib/certificates.js";

const folder = fs.mkdtempSync(path.join(os.tmpdir(), "loopwarden-opcua-"));
const certificates = await Certificates.open(folder);
after(() => fs.rmSync(folder, { recursive: true }));

async function made(startDate, validity) {
  const outputFile = path.join(folder, "made.pem");
  await certificates.manager.createSelfSignedCertificate({ applicationUri: "urn:test:server", dns: ["test"], subject: "/CN=test", outputFile, startDate, validity });
  return new X509Certificate(fs.readFileSync(outputFile));
}

test("the own certificate is made once, names its application, and only its user can read its key", async () => {
  const { fingerprint256 } = certificates.own;
  assert.equal((await Certificates.open(folder)).own.fingerprint256, fingerprint256);
  assert.equal(certificates.applicationUri, `urn:${os.hostname()}:loopwarden-opcua`);
  assert.equal(fs.statSync(certificates.privateKeyFile).mode & 0o077, 0);
  certificates.checkOwn();
});

test("a server's certificate is trusted after its fingerprint was entered, or if its file is in trusted/", async () => {
  const server = await made(new Date(), 10);
  const chain = Buffer.concat([server.raw, certificates.own.raw]); // with its issuer after it
  assert.throws(() => certificates.check(chain), (error) => error instanceof Untrusted && error.message.includes(server.fingerprint256));
  assert.throws(() => certificates.trust(chain, certificates.own.fingerprint256), Untrusted);
  assert.throws(() => certificates.trust(chain, ""), Untrusted);
  assert.throws(() => certificates.check(chain), Untrusted);
  const file = certificates.trust(chain, server.fingerprint256.toLowerCase().replaceAll(":", " "));
  certificates.check(chain);
  fs.rmSync(file);
  assert.throws(() => certificates.check(chain), Untrusted);
  fs.writeFileSync(path.join(folder, "trusted/by-hand.der"), server.raw);
  fs.writeFileSync(path.join(folder, "trusted/note.txt"), "no certificate");
  certificates.check(chain);
});

test("an expired certificate is reported with its file and its end", async () => {
  const old = await made(new Date(Date.now() - 20 * 86_400_000), 10);
  assert.throws(() => certificates.check(old.raw), Untrusted);
  const file = certificates.trust(old.raw, old.fingerprint256);
  assert.throws(() => certificates.check(old.raw), (error) => error instanceof Expired && error.message.includes(file) && error.message.includes(old.validTo));
});
