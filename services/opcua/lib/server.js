// SPDX-License-Identifier: Apache-2.0
// A session at the server: Basic256Sha256, signed and encrypted. It reads, browses and subscribes; it never writes or calls methods.
// The library's own reconnection is off, because it would continue with namespace indices that may have changed.
import {
  AttributeIds, MessageSecurityMode, OPCUAClient, readNamespaceArray, SecurityPolicy, UserTokenType,
} from "node-opcua-client";
import { readSecret } from "./config.js";
import { leafOf } from "./certificates.js";

const TIMEOUT_MS = 15_000;
const SESSION_TIMEOUT_MS = 60_000;
const GOODBYE_MS = 3000;
const BATCH = 500; // if the server reports no limit
const LIMITS = { // OperationLimits of OPC UA's own namespace
  nodesPerRead: "i=11705",
  nodesPerBrowse: "i=11710",
  monitoredItemsPerCall: "i=11714",
};

const optionsWith = (certificates) => ({
  applicationName: "loopwarden-opcua",
  clientName: "loopwarden-opcua",
  applicationUri: certificates.applicationUri,
  clientCertificateManager: certificates.manager,
  certificateFile: certificates.file,
  privateKeyFile: certificates.privateKeyFile,
  connectionStrategy: { maxRetry: 0 },
  endpointMustExist: false,
  transportTimeout: TIMEOUT_MS,
  defaultTransactionTimeout: TIMEOUT_MS,
});

// The first line is the message; further lines are details for the library's authors.
export const plainly = (error) => error.message.split("\n")[0].replace(/[ .]+$/, "");

const soon = (promise) => Promise.race([promise.catch(() => {}), new Promise((done) => { setTimeout(done, GOODBYE_MS).unref(); })]);

// Returns the certificate, in DER, of the used endpoint. Throws Error.
export async function askCertificate(config, certificates) {
  const client = OPCUAClient.create(optionsWith(certificates));
  try {
    await client.connect(config.url);
    const endpoints = await client.getEndpoints();
    const fits = (one) => one.securityPolicyUri === SecurityPolicy.Basic256Sha256 && one.securityMode === MessageSecurityMode.SignAndEncrypt;
    const endpoint = endpoints.find(fits);
    if (!endpoint) throw new Error("the server offers no Basic256Sha256 with sign and encrypt");
    return endpoint.serverCertificate;
  } finally {
    await soon(client.disconnect());
  }
}

export function splitUp(list, size) {
  return Array.from({ length: Math.ceil(list.length / size) }, (_, i) => list.slice(i * size, (i + 1) * size));
}

export class Server {
  // Throws Untrusted, Expired, Error.
  static async open(config, certificates) {
    certificates.checkOwn();
    const der = await askCertificate(config, certificates);
    certificates.check(der);
    const server = new Server();
    server.lost = new Promise((_, fail) => { server.fail = (why) => fail(new Error(why)); });
    server.lost.catch(() => {}); // the awaiting code handles it
    server.client = OPCUAClient.create({
      ...optionsWith(certificates),
      securityMode: MessageSecurityMode.SignAndEncrypt,
      securityPolicy: SecurityPolicy.Basic256Sha256,
      serverCertificate: leafOf(der).raw,
      requestedSessionTimeout: SESSION_TIMEOUT_MS,
      keepSessionAlive: true,
    });
    server.client.on("connection_lost", () => server.fail("the connection is lost"));
    server.client.on("close", () => server.fail("the connection is closed"));
    try {
      await server.client.connect(config.url);
      const who = config.user
        ? { type: UserTokenType.UserName, userName: config.user, password: readSecret(config.password) }
        : { type: UserTokenType.Anonymous };
      server.session = await server.client.createSession(who);
      server.session.on("session_closed", () => server.fail("the server has closed the session"));
      server.namespaces = await readNamespaceArray(server.session);
      server.limits = await server.#readLimits();
    } catch (error) {
      await server.close();
      throw error;
    }
    return server;
  }

  async #readLimits() {
    const values = await this.session.read(Object.values(LIMITS).map((nodeId) => ({ nodeId, attributeId: AttributeIds.Value })));
    return Object.fromEntries(Object.keys(LIMITS).map((name, i) => [name, Math.min(Number(values[i].value?.value) || BATCH, BATCH)]));
  }

  async close() {
    if (this.session) await soon(this.session.close(true));
    await soon(this.client.disconnect());
  }
}
