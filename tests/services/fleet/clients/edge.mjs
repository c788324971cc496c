// SPDX-License-Identifier: Apache-2.0
// A Sparkplug edge node of npm packages with one device: births, then data by alias, until a rebirth is asked for; then
// births and data again.  Usage: node edge.mjs PORT GROUP EDGE DEVICE. Runs until it is ended.
import mqtt from "mqtt";
import sparkplug from "sparkplug-payload";

const [port, group, edge, device] = process.argv.slice(2);
const codec = sparkplug.get("spBv1.0");
const topic = (type, name) => `spBv1.0/${group}/${type}/${edge}${name ? `/${name}` : ""}`;
const bdSeq = { name: "bdSeq", type: "Int64", value: 0 };
const values = { PV: 4.5, OP: 41.25, MODE: -1 };
const types = { PV: "Float", OP: "Double", MODE: "Int16" };
let seq = 0;

const encoded = (metrics, numbered) => {
  const timestamp = Date.now();
  const payload = { timestamp, metrics: metrics.map((metric) => ({ timestamp, ...metric })) };
  if (numbered) payload.seq = seq++ % 256;
  return Buffer.from(codec.encodePayload(payload));
};
const all = (withNames) =>
  Object.keys(values).map((name, i) => ({ ...(withNames ? { name } : {}), alias: i + 1, type: types[name], value: values[name] }));

const client = mqtt.connect(`mqtt://127.0.0.1:${port}`, {
  clientId: "npm-edge",
  will: { topic: topic("NDEATH"), payload: encoded([bdSeq], false), qos: 1 },
});

function births() {
  seq = 0;
  client.publish(topic("NBIRTH"), encoded([bdSeq, { name: "Node Control/Rebirth", type: "Boolean", value: false }], true));
  client.publish(topic("DBIRTH", device), encoded(all(true), true));
}

client.on("connect", () => client.subscribe(topic("NCMD"), births));
client.on("message", (_, bytes) => {
  if (!codec.decodePayload(bytes).metrics.some((metric) => metric.name === "Node Control/Rebirth" && metric.value)) return;
  values.PV = 5.5; // shows that it was asked
  births();
});
setInterval(() => client.publish(topic("DDATA", device), encoded(all(false), true)), 200);
