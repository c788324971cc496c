// SPDX-License-Identifier: Apache-2.0
// The nodes of the configuration, subscribed to at the server, and what becomes of them.
import { AttributeIds, ClientMonitoredItemGroup, resolveNodeId, TimestampsToReturn } from "node-opcua-client";
import { toNodeId } from "./node_ids.js";
import { splitUp } from "./server.js";
import { toFed } from "./value.js";

const LIFETIME_S = 60; // without this program, after which the server forgets the subscription
const SERVER_TIME = "i=2258"; // Server_ServerStatus_CurrentTime: changes all the time, which shows that the server lives
const MOST_NAMED = 20; // in one line of the log
const GONE = new Set(["BadNodeIdUnknown", "BadNodeIdInvalid"]);

// A server is silent when it owes three signs of life, and a moment for the network.
const silentAfterMs = (subscription) => 3 * subscription.publishingInterval * subscription.maxKeepAliveCount + 5000;

const initialized = (group) => new Promise((done, fail) => {
  group.once("initialized", done);
  group.once("err", (message) => fail(new Error(String(message?.message ?? message))));
});

export class Watch {
  #config;
  #feed;
  #log;
  // What is known of each name outlives a session.
  #states = new Map(); // name: {why, stamp, ours}; `ours`: the last thing said was bad, without the source's stamp

  #ran = false;

  constructor(config, feed, log) {
    [this.#config, this.#feed, this.#log] = [config, feed, log];
    for (const name of config.nodes.keys()) this.#states.set(name, { why: "", stamp: -Infinity, ours: false });
  }

  // Until the session is lost or `ended` resolves. Throws Error with what has ended it.
  async run(server, ended) {
    if (this.#ran) this.#forget();
    this.#ran = true;
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

  // In as many subscriptions as the server asks for. Returns the names that it has refused, which are bad from now on.
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
    // Its messages without news are the sign of life then, as seldom as it sends them.
    if (refused.delete("")) this.#log.warn("the server does not tell its time: without news its signs of life are seldom, and max_age of the loops must be long");
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
      this.#log.warn(`the server publishes each ${subscription.publishingInterval / 1000} s, asked for ${interval} s: max_age of the loops must be longer`);
    }
    return one;
  }

  // Returns what this subscription has no room for; what is refused otherwise goes into `refused`.
  async #monitor(one, batch, server, refused) {
    const { sampling_interval: sampling, publishing_interval: publishing } = this.#config;
    const group = ClientMonitoredItemGroup.create(one.subscription, batch.map(({ nodeId }) => ({ nodeId, attributeId: AttributeIds.Value })), {
      samplingInterval: sampling * 1000,
      queueSize: 2 * Math.ceil(publishing / sampling), // a late message loses nothing
      discardOldest: true,
    }, TimestampsToReturn.Source);
    group.on("changed", (item, dataValue, i) => {
      // All of one message go in one line.
      if (!one.sending) setImmediate(() => {
        one.sending = false;
        one.alive(one.values.splice(0));
      });
      one.sending = true;
      if (batch[i].name) one.values.push(this.#take(batch[i].name, toFed(dataValue)));
      if (GONE.has(dataValue.statusCode.name)) {
        one.subscription.gone.push(batch[i].name);
        item.terminate().catch(() => {}); // it is asked for anew
      }
    });
    try {
      await initialized(group);
    } catch (error) {
      // The limit that it names may not be the one that it has.
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
    if (revised.size > 0) this.#log.info(`the server samples each ${[...revised].sort((a, b) => a - b).join(", ")} s, asked for ${sampling} s`);
    return full;
  }

  // As it goes to the daemon. A stamp that the daemon had before the name was bad without one would count as doubled.
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

  // After a session that was lost nobody knows what came of a value until it is heard again.
  #forget() {
    this.#sendBad([...this.#states.keys()]);
    for (const state of this.#states.values()) state.ours = true;
  }

  #sendBad(names) {
    this.#feed.send(names.map((name) => ({ name, value: null, time: null, quality: "bad" })));
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
