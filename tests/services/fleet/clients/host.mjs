// SPDX-License-Identifier: Apache-2.0
// A Sparkplug host of npm packages: reads births, asks for a rebirth, gets it, reads data by alias.
// Usage: node host.mjs PORT GROUP EDGE. Prints what it saw as one line of JSON.
import mqtt from "mqtt";
import sparkplug from "sparkplug-payload";

const [port, group, edge] = process.argv.slice(2);
const codec = sparkplug.get("spBv1.0");
const number = (value) => (value !== null && typeof value === "object" ? value.toNumber() : value);
const seen = { births: 0, device: null, pv: null, unit: null, config_hash: null, data: 0, gaps: 0 };
const names = new Map(); // by alias
let expected = null;
let asked = false;

setTimeout(() => end("no further data within 60 s"), 60_000);
const client = mqtt.connect(`mqtt://127.0.0.1:${port}`, { clientId: "npm-host" });

function end(why) {
  console.log(JSON.stringify(seen));
  if (why) console.error(why);
  client.end(true, () => process.exit(why ? 1 : 0));
}

function ask() {
  asked = true;
  const metrics = [{ name: "Node Control/Rebirth", type: "Boolean", value: true }];
  client.publish(`spBv1.0/${group}/NCMD/${edge}`, Buffer.from(codec.encodePayload({ timestamp: Date.now(), metrics })));
}

const find = (metrics, name) => metrics.find((metric) => metric.name === name);

function birth(type, device, metrics) {
  for (const metric of metrics) if (metric.alias != null) names.set(number(metric.alias), metric.name);
  if (type === "NBIRTH") {
    if (number(find(metrics, "bdSeq").value) !== 0) return end("bdSeq is not 0");
    if (find(metrics, "Node Control/Rebirth").value !== false) return end("Node Control/Rebirth is not false");
    seen.births += 1;
    seen.config_hash = number(find(metrics, "config_hash").value);
  } else {
    seen.device = device;
    seen.pv = find(metrics, "pv").value;
    seen.unit = find(metrics, "pv").properties.engUnit.value;
  }
}

client.on("connect", () => client.subscribe(`spBv1.0/${group}/#`, () => ask()));
client.on("message", (topic, bytes) => {
  const [, , type, , device] = topic.split("/");
  if (!["NBIRTH", "DBIRTH", "NDATA", "DDATA"].includes(type)) return;
  const payload = codec.decodePayload(bytes);
  const seq = number(payload.seq);
  if (type !== "NBIRTH" && expected !== null && seq !== expected) seen.gaps += 1;
  expected = (seq + 1) % 256;
  if (type.endsWith("BIRTH")) return birth(type, device, payload.metrics);
  if (type === "DDATA" && asked && seen.births > 0) {
    for (const metric of payload.metrics) {
      if (!names.has(number(metric.alias))) return end(`alias ${metric.alias} that no birth gave`);
      if (metric.value === undefined) return end("a value that can't be read");
    }
    seen.data += 1;
    if (seen.data === 3) end("");
  }
});
