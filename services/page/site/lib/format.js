// SPDX-License-Identifier: Apache-2.0
// Formats numbers, durations and wall-clock time. Pure: no document, no clock.

export const NONE = '–';
const SPACE = '\u00A0'; // a number and its unit stay on one line
const THIN_SPACE = '\u2009';

// Returns the decimals that show a thousandth of the span: two for 10 L/min, one for 100 %, zero for 16 000 kg/h.
export function decimalsFor(range) {
  const span = range ? Math.abs(range[1] - range[0]) : 100;
  if (!(span > 0) || !Number.isFinite(span)) return 2;
  return Math.min(6, Math.max(0, 3 - Math.ceil(Math.log10(span) - 1e-9)));
}

// Returns the decimals that show each mark of an axis exactly: two for 0.25.
export function decimalsOfStep(step) {
  for (let decimals = 0; decimals < 6; ++decimals) {
    const scaled = step * 10 ** decimals;
    if (Math.abs(scaled - Math.round(scaled)) < 1e-6 * scaled) return decimals;
  }
  return 6;
}

export function fixed(value, decimals) {
  if (typeof value !== 'number' || !Number.isFinite(value)) return NONE;
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? (0).toFixed(decimals) : text; // never "-0.00"
}

// Formats with at most `digits` significant digits, without trailing zeros.
export function significant(value, digits = 3) {
  if (typeof value !== 'number' || !Number.isFinite(value)) return NONE;
  return String(Number(value.toPrecision(digits)));
}

export function quantity(value, range, unit) {
  const text = fixed(value, decimalsFor(range));
  return text === NONE || !unit ? text : `${text}${SPACE}${unit}`;
}

export function percent(value, decimals = 0) {
  const text = fixed(value, decimals);
  return text === NONE ? text : `${text}${SPACE}%`;
}

// Formats 1234567 as "1 234 567": no language uses a space as its decimal separator.
export function count(value) {
  if (typeof value !== 'number' || !Number.isFinite(value)) return NONE;
  return String(Math.round(value)).replace(/\B(?=(\d{3})+$)/g, THIN_SPACE);
}

export function bytes(value) {
  if (typeof value !== 'number' || !Number.isFinite(value)) return NONE;
  const units = ['B', 'kB', 'MB', 'GB', 'TB'];
  let power = 0;
  while (Math.abs(value) >= 1000 && power < units.length - 1) {
    value /= 1000;
    ++power;
  }
  return `${power === 0 ? Math.round(value) : significant(value, 3)}${SPACE}${units[power]}`;
}

// Formats a counter according to its name: counters of bytes are shown as bytes.
export function counter(name, value) {
  if (typeof value !== 'number') return String(value);
  return /(^|_)bytes(_|$)/.test(name) ? bytes(value) : Number.isInteger(value) ? count(value) : significant(value, 6);
}

// Formats with the two greatest units: "3 d 4 h", "5 min 12 s", "0.8 s".
export function duration(seconds) {
  if (typeof seconds !== 'number' || !Number.isFinite(seconds)) return NONE;
  const s = Math.abs(seconds);
  if (s < 10) return `${significant(s, 2)}${SPACE}s`;
  const whole = Math.round(s);
  const parts = [[86400, 'd'], [3600, 'h'], [60, 'min'], [1, 's']];
  const at = parts.findIndex(([size]) => whole >= size);
  const [size, unit] = parts[at];
  const first = `${Math.floor(whole / size)}${SPACE}${unit}`;
  const next = parts[at + 1];
  const rest = next ? Math.floor((whole % size) / next[0]) : 0;
  return rest ? `${first} ${rest}${SPACE}${next[1]}` : first;
}

export function microseconds(us) {
  if (typeof us !== 'number' || !Number.isFinite(us)) return NONE;
  if (us < 1000) return `${significant(us, 3)}${SPACE}µs`;
  return us < 1e6 ? `${significant(us / 1000, 3)}${SPACE}ms` : `${significant(us / 1e6, 3)}${SPACE}s`;
}

function fieldsIn(zone) {
  const form = new Intl.DateTimeFormat('en-CA', {
    timeZone: zone, hourCycle: 'h23', year: 'numeric', month: '2-digit', day: '2-digit',
    hour: '2-digit', minute: '2-digit', second: '2-digit',
  });
  return (ms) => {
    const fields = {};
    for (const {type, value} of form.formatToParts(ms)) fields[type] = value;
    return fields;
  };
}

// Wall-clock time in a zone of the IANA database. An unknown zone is replaced by UTC and shown as UTC.
export class WallClock {
  constructor(zone) {
    try {
      this.fields = fieldsIn(zone || 'UTC');
      this.zone = zone || 'UTC';
    } catch {
      this.fields = fieldsIn('UTC');
      this.zone = 'UTC';
    }
  }
  time(ms) {
    if (typeof ms !== 'number' || !(ms > 0)) return NONE;
    const f = this.fields(ms);
    return `${f.hour}:${f.minute}:${f.second}`;
  }
  date(ms) {
    if (typeof ms !== 'number' || !(ms > 0)) return NONE;
    const f = this.fields(ms);
    return `${f.year}-${f.month}-${f.day}`;
  }
  dateTime(ms) {
    return typeof ms === 'number' && ms > 0 ? `${this.date(ms)} ${this.time(ms)}` : NONE;
  }
  // With tenths or thousandths of a second, for a cursor on samples of such a period.
  fine(ms, step_ms) {
    const more = step_ms < 100 ? 3 : step_ms < 1000 ? 1 : 0;
    const fraction = more ? (Math.floor(((ms % 1000) + 1000) % 1000) / 1000).toFixed(3).slice(1, 2 + more) : '';
    return this.dateTime(ms) + fraction;
  }
  // Returns the offset to add to UTC at that time.
  offset_ms(ms) {
    const f = this.fields(ms);
    return Date.UTC(f.year, f.month - 1, f.day, f.hour, f.minute, f.second) - Math.floor(ms / 1000) * 1000;
  }
  // "UTC+02:00"
  offsetText(ms) {
    const minutes = Math.round(this.offset_ms(ms) / 60000);
    const two = (n) => String(n).padStart(2, '0');
    return `UTC${minutes < 0 ? '−' : '+'}${two(Math.floor(Math.abs(minutes) / 60))}:${two(Math.abs(minutes) % 60)}`;
  }
  // Returns UTC in ms for a date, or a date and time, in this zone; NaN for an invalid one. In the hour that the end of summer time repeats, it
  // returns one of both times.
  fromInput(text) {
    const [date, time = '00:00'] = text.trim().split(/[T ]/), local = Date.parse(`${date}T${time}Z`);
    if (Number.isNaN(local)) return NaN;
    const guess = local - this.offset_ms(local);
    return local - this.offset_ms(guess);
  }
  toInput(ms) {
    return `${this.date(ms)} ${this.time(ms)}`;
  }
}
