// SPDX-License-Identifier: Apache-2.0
// Subscribes to the configured nodes at the server, and passes their values on.
import { AttributeIds, ClientMonitoredItemGroup, resolveNodeId, TimestampsToReturn } from "node-opcua-client";
import { toNodeId } from "./node_ids.js";
import { splitUp } from "./server.js";
import { toFed } from "./value.js";

const LIFETIME_S = 60; // the server deletes the subscription this long after the program's last request
const SERVER_TIME = "i=2258"; // Server_ServerStatus_CurrentTime: its constant change shows that the server is alive
const MOST_NAMED = 20; // in one line of the log
const GONE = new Set(["BadNodeIdUnknown", "BadNodeIdInvalid"]);

// A server counts as silent after three missing messages and a margin for the network.
const silentAfterMs = (subscription) => 3 * subscription.publishingInterval * subscription.maxKeepAliveCount + 5000;

const initialized = (group) => new Promise((done, fail) => {
  group.once("initialized", done);
  group.once("err", (message) => fail(new Error(String(message?.message ?? message))));
});

export class Watch {
  #config;
  #feed;
  #log;
  // The state of each name outlives a session.
  #states = new Map(); // name: {why, stamp, ours}; `ours`: the last value sent was bad, without the source's stamp

  #lost = false; // the daemon has been told that the server is lost

  constructor(config, feed, log) {
    [this.#config, this.#feed, this.#log] = [config, feed, log];
    for (const name of config.nodes.keys()) this.#states.set(name, { why: "", stamp: -Infinity, ours: false });
  }

  // Runs until the session is lost or `ended` resolves. Throws Error with the reason of the loss.
  async run(server, ended) {
    this.#lost = false;
    const subscriptions = [];
    let heard = Date.now();
    const alive = (values) => {
      heard = Date.now();
      this.#feed.send(values);
    };
    let again;
    const askAgainMs = this.#config.reconnect_max * 1000;
    try {
      let refused = await this.#subscribe(server, subscriptions, [...this.#config.nodes.keys()], alive);
      this.#log.info(`${this.#config.url}: ${this.#config.nodes.size - refused.length} of ${this.#config.nodes.size} nodes`);
      const silence = new Promise((_, fail) => {
        let busy = false;
        let asked = Date.now();
        again = setInterval(async () => {
          const longest = Math.max(0, ...subscriptions.map(silentAfterMs));
          if (Date.now() - heard > Math.max(longest, 10_000)) fail(new Error("the server is silent"));
          for (const one of subscriptions) refused.push(...one.gone.splice(0));
          if (busy || refused.length === 0 || Date.now() - asked < askAgainMs) return;
          [busy, asked] = [true, Date.now()];
          try {
            refused = await this.#subscribe(server, subscriptions, [...new Set(refused)], alive);
          } catch (error) {
            fail(error);
          }
          busy = false;
        }, 1000);
      });
      await Promise.race([server.lost, silence, ended]);
    } finally {
      clearInterval(again);
    }
  }

  // Uses as many subscriptions as the server's limits require. Returns the refused names, which are bad from now on.
  async #subscribe(server, subscriptions, names, alive) {
    const refused = new Map(); // name: why
    const wanted = [];
    for (const name of names) {
      const node = this.#config.nodes.get(name);
      const nodeId = toNodeId(node, server.namespaces);
      if (nodeId) wanted.push({ name, nodeId });
      else refused.set(name, `the server has no namespace ${node.uri}`);
    }
    if (subscriptions.length === 0) wanted.unshift({ name: "", nodeId: resolveNodeId(SERVER_TIME) });
    let rest = wanted;
    while (rest.length > 0) {
      const one = await this.#open(server, alive);
      const full = [];
      for (const batch of splitUp(rest, server.limits.monitoredItemsPerCall)) {
        full.push(...await this.#monitor(one, batch, server, refused));
      }
      if (full.length === rest.length) {
        for (const { name } of full) refused.set(name, "BadTooManyMonitoredItems");
        await one.subscription.terminate();
        break;
      }
      one.settled = true;
      subscriptions.push(one.subscription);
      rest = full;
    }
    // Then its messages without values show that it is alive, as rarely as the server sends them.
    if (refused.delete("")) this.#log.warn("the server's clock can't be subscribed to: without changes its messages are rare. Increase max_age of the loops");
    this.#sayRefused(refused);
    return [...refused.keys()];
  }

  async #open(server, alive) {
    const { publishing_interval: interval } = this.#config;
    const subscription = await server.session.createSubscription2({
      requestedPublishingInterval: interval * 1000,
      requestedLifetimeCount: Math.ceil(LIFETIME_S / interval),
      requestedMaxKeepAliveCount: 1,
      maxNotificationsPerPublish: 0,
      publishingEnabled: true,
      priority: 0,
    });
    const one = { subscription, alive, settled: false, values: [], sending: false };
    subscription.gone = [];
    subscription.on("keepalive", () => alive([]));
    subscription.on("status_changed", (status) => server.fail(`the server has ended a subscription: ${status.name}`));
    subscription.on("terminated", () => { if (one.settled) server.fail("a subscription has ended"); });
    subscription.on("internal_error", (error) => server.fail(error.message));
    if (subscription.publishingInterval !== interval * 1000) {
      this.#log.warn(`the server publishes each ${subscription.publishingInterval / 1000} s instead of ${interval} s. Increase max_age of the loops`);
    }
    return one;
  }

  // Returns the items for which this subscription has no room; items refused for other reasons are added to `refused`.
  async #monitor(one, batch, server, refused) {
    const { sampling_interval: sampling, publishing_interval: publishing } = this.#config;
    const group = ClientMonitoredItemGroup.create(one.subscription, batch.map(({ nodeId }) => ({ nodeId, attributeId: AttributeIds.Value })), {
      samplingInterval: sampling * 1000,
      queueSize: 2 * Math.ceil(publishing / sampling), // a late message loses no values
      discardOldest: true,
    }, TimestampsToReturn.Source);
    group.on("changed", (item, dataValue, i) => {
      // All values of one message are sent in one line.
      if (!one.sending) setImmediate(() => {
        one.sending = false;
        one.alive(one.values.splice(0));
      });
      one.sending = true;
      if (batch[i].name) one.values.push(this.#take(batch[i].name, toFed(dataValue)));
      if (GONE.has(dataValue.statusCode.name)) {
        one.subscription.gone.push(batch[i].name);
        item.terminate().catch(() => {}); // it is requested again
      }
    });
    try {
      await initialized(group);
    } catch (error) {
      // The real limit may be lower than the reported one.
      if (!/BadTooManyOperations/.test(error.message) || batch.length === 1) throw error;
      server.limits.monitoredItemsPerCall = Math.ceil(batch.length / 2);
      const full = [];
      for (const half of splitUp(batch, server.limits.monitoredItemsPerCall)) full.push(...await this.#monitor(one, half, server, refused));
      return full;
    }
    const full = [];
    const revised = new Set();
    group.monitoredItems.forEach((item, i) => {
      const { statusCode } = item;
      if (statusCode?.name === "BadTooManyMonitoredItems") full.push(batch[i]);
      else if (!statusCode?.isGood()) refused.set(batch[i].name, statusCode?.name ?? "not answered");
      else if (batch[i].name && item.result.revisedSamplingInterval !== sampling * 1000) revised.add(item.result.revisedSamplingInterval / 1000);
    });
    if (revised.size > 0) this.#log.info(`the server samples each ${[...revised].sort((a, b) => a - b).join(", ")} s instead of ${sampling} s`);
    return full;
  }

  // Prepares a value for the daemon. If the daemon received this stamp before a bad value without stamp, it would count the value as a duplicate.
  #take(name, { value, time, quality, why }) {
    const state = this.#states.get(name);
    this.#say(name, why);
    const known = state.ours && time !== null && time <= state.stamp;
    state.ours = false;
    if (time !== null) state.stamp = Math.max(state.stamp, time);
    return { name, value, time: known ? null : time, quality };
  }

  #say(name, why) {
    const state = this.#states.get(name);
    if (why === state.why) return;
    this.#log.ofValue(`${name}: ${why || "good again"}`);
    state.why = why;
  }

  // Without a session the state of each value is unknown until the next one arrives.
  lost() {
    if (this.#lost) return;
    this.#lost = true;
    this.#sendBad([...this.#states.keys()], { reason: "link", source: `server ${this.#config.url}` });
    for (const state of this.#states.values()) state.ours = true;
  }

  #sendBad(names, why = {}) {
    this.#feed.send(names.map((name) => ({ name, value: null, time: null, quality: "bad", ...why })));
  }

  #sayRefused(refused) {
    this.#sendBad([...refused.keys()]);
    const reasons = new Map();
    for (const [name, why] of refused) {
      const state = this.#states.get(name);
      state.ours = true;
      if (state.why === why) continue;
      state.why = why;
      reasons.set(why, [...(reasons.get(why) ?? []), name]);
    }
    for (const [why, names] of reasons) {
      const more = names.length > MOST_NAMED ? ` and ${names.length - MOST_NAMED} more` : "";
      const named = names.slice(0, MOST_NAMED).map((name) => `${name} (${this.#config.nodes.get(name).text})`).join(", ");
      this.#log.warn(`${why}: ${named}${more}`);
    }
  }
}
