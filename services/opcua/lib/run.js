// SPDX-License-Identifier: Apache-2.0
// Runs the feeder: one session after another until it is stopped.
import path from "node:path";
import { Certificates, describe, Expired, Untrusted } from "./certificates.js";
import { Feed } from "./feed.js";
import { pause } from "./pause.js";
import { plainly, Server } from "./server.js";
import { Watch } from "./watch.js";

const WARN_OWN_DAYS = 30;

// Returns true if it was stopped. Throws Untrusted if the first server that answers has a certificate that is not trusted.
// After the first session it waits instead until a replaced certificate is trusted: the values are stale meanwhile.
export async function run(config, log, ended) {
  const certificates = await Certificates.open(config.state_directory);
  const { own } = certificates;
  log.info(`own certificate ${certificates.file}: ${describe(own).replace("\n", ", ")}`);
  if (Date.parse(own.validTo) - Date.now() < WARN_OWN_DAYS * 86_400_000) {
    log.warn(`own certificate: expires on ${own.validTo}. Remove it: the next start makes a new one`);
  }
  const feed = new Feed(path.join(config.runtime_directory, "feed.sock"), log, config.feeder);
  const watch = new Watch(config, feed, log);
  let over = false;
  const end = ended.then(() => { over = true; });
  let served = false;
  let said = "";
  for (let attempts = 1; !over; attempts++) {
    let server;
    try {
      server = await Server.open(config, certificates);
      [served, attempts, said] = [true, 0, ""];
      await watch.run(server, end);
    } catch (error) {
      if (error instanceof Untrusted && !served) {
        feed.end();
        throw error;
      }
      const text = error instanceof Untrusted || error instanceof Expired ? error.message : plainly(error);
      if (text !== said) log.error(`${config.url}: ${text}`);
      said = text;
      watch.lost();
    } finally {
      await server?.close();
    }
    if (over) break;
    let timer;
    const wait = pause(Math.max(attempts, 1), { first: config.reconnect_min, longest: config.reconnect_max });
    await Promise.race([end, new Promise((done) => { timer = setTimeout(done, 1000 * wait); })]);
    clearTimeout(timer);
  }
  feed.end();
}
