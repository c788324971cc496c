// SPDX-License-Identifier: Apache-2.0
// Writes lines to standard error, like the other services.
const LEVELS = ["debug", "info", "warn", "error"];
const MOST_A_MINUTE = 50; // lines about single values

export class Log {
  #least;
  #minute = 0;
  #lines = 0;

  constructor(level = "info") {
    this.#least = LEVELS.indexOf(level);
  }
  debug(text) { this.#write("debug", text); }
  info(text) { this.#write("info", text); }
  warn(text) { this.#write("warn", text); }
  error(text) { this.#write("error", text); }

  // Logs a line about one value of thousands. Beyond MOST_A_MINUTE only the number of lines is logged.
  ofValue(text) {
    const minute = Math.floor(Date.now() / 60_000);
    if (minute !== this.#minute) {
      if (this.#lines > MOST_A_MINUTE) this.warn(`${this.#lines - MOST_A_MINUTE} more values changed their state in that minute`);
      [this.#minute, this.#lines] = [minute, 0];
    }
    if (++this.#lines <= MOST_A_MINUTE) this.warn(text);
  }

  #write(level, text) {
    if (LEVELS.indexOf(level) >= this.#least) process.stderr.write(`${new Date().toISOString()} ${level === "warn" ? "warning" : level} ${text}\n`);
  }
}
