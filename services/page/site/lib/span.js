// SPDX-License-Identifier: Apache-2.0
// The time span of a trend, and its history of earlier spans. Pure.

export const SPANS_S = [60, 600, 3600, 28800, 86400, 604800, 0]; // 0: all there is
const MOST_BEFORE = 20;

export class SpanChoice {
  before = [];
  // fixed: [from, to] in UTC ms, or null: follows the newest time.
  constructor(fixed = null, span_s = 600) { Object.assign(this, {fixed, span_s}); }

  // Returns the address options: {from, to} or {span}.
  static of({from, to, span}) {
    const ends = [Number(from), Number(to)], known = SPANS_S.includes(Number(span)) && span !== undefined;
    return new SpanChoice(ends[0] > 0 && ends[1] > ends[0] ? ends : null, known ? Number(span) : 600);
  }
  get address() { return this.fixed ? {from: Math.round(this.fixed[0]), to: Math.round(this.fixed[1])} : {span: this.span_s}; }

  span(newest_ms, oldest_ms) {
    if (this.fixed) return this.fixed;
    return [this.span_s ? newest_ms - 1000 * this.span_s : Math.min(oldest_ms ?? newest_ms - 600_000, newest_ms - 60_000), newest_ms];
  }
  // Follows the newest time from now on.
  pick(seconds) {
    this.#keep();
    this.span_s = seconds;
    this.fixed = null;
  }
  // null: the previous span; 'all': the whole record.
  want(span) {
    if (span === 'all') { this.pick(0); return; }
    if (span === null) { this.fixed = this.before.pop() ?? null; return; }
    this.#keep();
    this.fixed = span;
  }
  #keep() {
    this.before.push(this.fixed);
    if (this.before.length > MOST_BEFORE) this.before.shift();
  }
}
