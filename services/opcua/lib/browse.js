// SPDX-License-Identifier: Apache-2.0
// Writes all variables below a node as CSV, with data type, engineering unit, range and description from the server.
import { AttributeIds, BrowseDirection, browseAll, DataType, NodeClass, NodeClassMask, resolveNodeId } from "node-opcua-client";
import { fromNodeId } from "./node_ids.js";
import { splitUp } from "./server.js";

const OBJECTS_FOLDER = "i=85";
const SERVER_OBJECT = "ns=0;i=2253"; // about the server itself
const HIERARCHICAL = "i=33";
const HAS_PROPERTY = "ns=0;i=46";
const RESULT_ALL = 63;
const COLUMNS = ["name", "node_id", "data_type", "unit", "low", "high", "description", "value"];
const TEXTS = new Set([DataType.String, DataType.LocalizedText]);
const isText = (type) => type?.namespace === 0 && TEXTS.has(type.value);

const quoted = (text) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
const asRow = (cells) => `${cells.map((cell) => quoted(String(cell ?? ""))).join(",")}\n`;

// Returns [{name, nodeId, unit, range}]: `unit` and `range` are the node ids of its properties, if it has them.
async function findVariables(session, root) {
  const found = new Map();
  const seen = new Set([root.toString(), SERVER_OBJECT]);
  let level = [{ nodeId: root, name: "" }];
  while (level.length > 0) {
    const results = await browseAll(session, level.map(({ nodeId }) => ({
      nodeId,
      browseDirection: BrowseDirection.Forward,
      referenceTypeId: HIERARCHICAL,
      includeSubtypes: true,
      nodeClassMask: NodeClassMask.Object | NodeClassMask.Variable,
      resultMask: RESULT_ALL,
    })));
    const next = [];
    results.forEach((result, i) => {
      const parent = level[i];
      for (const reference of result.references ?? []) {
        const browseName = reference.browseName.name;
        if (reference.referenceTypeId.toString() === HAS_PROPERTY) {
          const variable = found.get(parent.nodeId.toString());
          if (variable && browseName === "EngineeringUnits") variable.unit = reference.nodeId;
          if (variable && browseName === "EURange") variable.range = reference.nodeId;
          continue;
        }
        const key = reference.nodeId.toString();
        if (seen.has(key)) continue;
        seen.add(key);
        const child = { nodeId: reference.nodeId, name: parent.name ? `${parent.name}.${browseName}` : browseName };
        if (reference.nodeClass === NodeClass.Variable) found.set(key, child);
        next.push(child);
      }
    });
    level = next;
  }
  return [...found.values()];
}

async function readAll(server, asked) {
  const values = [];
  for (const batch of splitUp(asked, server.limits.nodesPerRead)) values.push(...await server.session.read(batch));
  return values;
}

// Types that the server defines are named by their node ids.
function typeName(nodeId, namespaces) {
  if (nodeId?.namespace === 0 && DataType[nodeId.value]) return DataType[nodeId.value];
  return nodeId ? fromNodeId(nodeId, namespaces) : "";
}

// `root`: a node id of the server, otherwise its folder Objects. Writes to `out`, returns the number of variables.
export async function browse(server, root, out) {
  const variables = await findVariables(server.session, root ?? resolveNodeId(OBJECTS_FOLDER));
  const asked = variables.flatMap(({ nodeId, unit, range }) => [
    { nodeId, attributeId: AttributeIds.DataType },
    { nodeId, attributeId: AttributeIds.Description },
    ...(unit ? [{ nodeId: unit, attributeId: AttributeIds.Value }] : []),
    ...(range ? [{ nodeId: range, attributeId: AttributeIds.Value }] : []),
  ]);
  const values = (await readAll(server, asked)).map((one) => one.value?.value)[Symbol.iterator]();
  const next = () => values.next().value;
  const rows = variables.map(({ name, nodeId, unit, range }) => {
    const type = next();
    const description = next();
    const units = unit ? next() : undefined;
    const limits = range ? next() : undefined;
    return { nodeId, type, cells: [name, fromNodeId(nodeId, server.namespaces), typeName(type, server.namespaces), units?.displayName?.text, limits?.low, limits?.high, description?.text] };
  });
  // The words of a mode show how the server writes them.
  const texts = rows.filter(({ type }) => isText(type));
  const now = await readAll(server, texts.map(({ nodeId }) => ({ nodeId, attributeId: AttributeIds.Value })));
  texts.forEach(({ cells }, k) => {
    const value = now[k].value?.value;
    cells.push(typeof value === "object" ? value?.text : value);
  });
  out.write(asRow(COLUMNS));
  for (const { cells } of rows) out.write(asRow(cells.length < COLUMNS.length ? [...cells, ""] : cells));
  return variables.length;
}
