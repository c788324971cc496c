// SPDX-License-Identifier: Apache-2.0
// Node ids in the notation of OPC UA 10000-6, 5.3.1.11 (1.05), with the namespace by its URI: nsu=urn:plant:dcs;s=FIC205.PV. An index
// may change with each start of the server. Without nsu= the namespace is OPC UA's own, 0. In a URI ';' is
// %3B and '%' is %25.
import { resolveNodeId } from "node-opcua-client";

const FORM = /^(?:nsu=([^;]+);)?([isgb])=(.+)$/s;
const IDENTIFIERS = {
  i: /^\d{1,10}$/,
  s: /^.+$/s,
  g: /^[0-9a-fA-F]{8}(-[0-9a-fA-F]{4}){3}-[0-9a-fA-F]{12}$/,
  b: /^[A-Za-z0-9+/]+={0,2}$/,
};

// Throws Error with the expected notation.
export function parseNodeId(text) {
  if (/^ns=/.test(text)) throw new Error("must name its namespace by the URI, nsu=URI;s=NAME: an index may change ('loopwarden-opcua browse' prints them so)");
  const [, uri, kind, identifier] = FORM.exec(text) ?? [];
  if (!kind || !IDENTIFIERS[kind].test(identifier) || (kind === "i" && Number(identifier) > 0xffffffff)) {
    throw new Error("must be a node id such as nsu=urn:plant:dcs;s=FIC205.PV or nsu=urn:plant:dcs;i=1001");
  }
  return { uri: uri?.replaceAll("%3B", ";").replaceAll("%25", "%"), identifier: `${kind}=${identifier}` };
}

// Returns the node id for a server with these namespaces; undefined if the namespace is missing.
export function toNodeId({ uri, identifier }, namespaces) {
  const index = uri === undefined ? 0 : namespaces.indexOf(uri);
  return index < 0 ? undefined : resolveNodeId(`ns=${index};${identifier}`);
}

export function fromNodeId(nodeId, namespaces) {
  const identifier = nodeId.toString().replace(/^ns=\d+;/, "");
  if (nodeId.namespace === 0) return identifier;
  return `nsu=${namespaces[nodeId.namespace].replaceAll("%", "%25").replaceAll(";", "%3B")};${identifier}`;
}
