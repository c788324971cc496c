#!/usr/bin/env node
// SPDX-License-Identifier: Apache-2.0
// An OPC UA server with loops FIC001, FIC002, ..., with security on. Each has PV, SP, OP and MODE
// with ranges and units. Commands are lines on standard input, each with an answer. The requests of
// clients are counted by name.
//   set NAME VALUE [SECONDS SINCE 1970] | status NAME CODE | rename FROM TO | requests |
//   drop (every session)
// Usage: server.js PORT PKI [--loops N] [--first-namespace URI] [--sampling MS] [--publishing MS]
//   [--most-items N] [--most-per-call N] [--user NAME:PASSWORD]
import readline from "node:readline";
import { parseArgs } from "node:util";
import opcua from "node-opcua";

const { DataType, MessageSecurityMode, Subscription, nodesets, OPCUACertificateManager, OPCUAServer, SecurityPolicy, StatusCodes, Variant } = opcua;
const { values: options, positionals: [port, pki] } = parseArgs({
  allowPositionals: true,
  options: {
    loops: { type: "string", default: "2" },
    "first-namespace": { type: "string" },
    "most-items": { type: "string" },
    "most-per-call": { type: "string" },
    user: { type: "string" },
    sampling: { type: "string", default: "50" },
    publishing: { type: "string", default: "50" },
  },
});
const URI = "urn:test:dcs";
const UNITS = "http://www.opcfoundation.org/UA/units/un/cefact";
const manager = new OPCUACertificateManager({ rootFolder: pki, automaticallyAcceptUnknownCertificate: true });
await manager.initialize();
const server = new OPCUAServer({
  port: Number(port),
  host: "127.0.0.1",
  nodeset_filename: [nodesets.standard],
  serverCertificateManager: manager,
  securityPolicies: [SecurityPolicy.Basic256Sha256],
  securityModes: [MessageSecurityMode.SignAndEncrypt],
  allowAnonymous: options.user === undefined,
  userManager: { isValidUser: (name, password) => `${name}:${password}` === options.user },
  serverCapabilities: {
    maxMonitoredItemsPerSubscription: Number(options["most-items"] ?? 100_000),
    operationLimits: { maxMonitoredItemsPerCall: Number(options["most-per-call"] ?? 1000) },
  },
});
Subscription.minimumPublishingInterval = Number(options.publishing);
const requests = {};
server.on("request", (request) => { requests[request.schema.name] = (requests[request.schema.name] ?? 0) + 1; });
await server.initialize();
const { addressSpace } = server.engine;
if (options["first-namespace"]) addressSpace.registerNamespace(options["first-namespace"]);
const namespace = addressSpace.registerNamespace(URI);

const tags = new Map(); // name: {variable, value, status, stamp}
const parts = {
  PV: { type: "Double", value: 20, range: { low: 0, high: 40 }, unit: "m3/h", description: "Feed, measured" },
  SP: { type: "Double", value: 21, range: { low: 0, high: 40 }, unit: "m3/h", description: "Feed, \"wanted\"" },
  OP: { type: "Float", value: 50, range: { low: 0, high: 100 }, unit: "%", description: "Valve" },
  MODE: { type: "Int32", value: 1 },
};
function add(folder, part, name) {
  const { type, value, range, unit, description } = parts[part];
  const tag = { loop: folder, part, value, status: StatusCodes.Good, stamp: new Date() };
  tags.set(name, tag);
  const definition = {
    componentOf: folder,
    browseName: part,
    nodeId: `s=${name}`,
    description,
    dataType: type,
    minimumSamplingInterval: Number(options.sampling),
    value: { dataType: DataType[type], value },
  };
  tag.variable = range
    ? namespace.addAnalogDataItem({ ...definition, engineeringUnitsRange: range, engineeringUnits: { namespaceUri: UNITS, unitId: 0, displayName: unit, description: unit } })
    : namespace.addVariable(definition);
  show(tag);
}
// The values sent to clients.
function show({ variable, part, value, status, stamp }) {
  variable.setValueFromSource({ dataType: DataType[parts[part].type], value }, status, stamp);
}
function change(name, what) {
  show(Object.assign(tags.get(name), what));
}
for (let i = 1; i <= Number(options.loops); i++) {
  const loop = `FIC${String(i).padStart(3, "0")}`;
  const folder = namespace.addObject({ organizedBy: addressSpace.rootFolder.objects, browseName: loop });
  for (const part of Object.keys(parts)) add(folder, part, `${loop}.${part}`);
}
await server.start();
// Some servers report a limit other than the real one.
addressSpace.findNode("i=11714").bindVariable({ get: () => new Variant({ dataType: DataType.UInt32, value: 4 }) }, true);

const orders = {
  set: (name, value, seconds) => change(name, { value: Number(value), stamp: seconds ? new Date(Number(seconds) * 1000) : new Date() }),
  status: (name, code) => change(name, { status: StatusCodes[code], stamp: new Date() }),
  rename(from, to) {
    const tag = tags.get(from);
    addressSpace.deleteNode(tag.variable);
    tags.delete(from);
    add(tag.loop, tag.part, to);
    change(to, { stamp: tag.stamp });
  },
  requests: () => requests,
  drop() {
    for (const session of Object.values(server.engine._sessions)) server.engine.closeSession(session.authenticationToken, true, "Terminated");
  },
};
// The library prints warnings by console.log, but standard output is only for answers.
console.log = console.error;
process.stdout.write("ready\n");
for await (const line of readline.createInterface({ input: process.stdin })) {
  const [order, ...words] = line.split(" ");
  process.stdout.write(`${JSON.stringify(orders[order](...words) ?? null)}\n`);
}
// Closes without goodbyes, so that the port is free at the next start.
process.exit();
