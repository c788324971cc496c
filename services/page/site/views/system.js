// SPDX-License-Identifier: Apache-2.0
import {el, facts, icon, scroller, table} from '../lib/dom.js';
import {NONE, bytes, count, counter, duration, microseconds, percent} from '../lib/format.js';
import {get, query} from '../lib/api.js';
import {live} from '../lib/live.js';
import {meter} from '../lib/charts.js';
import {wall} from '../lib/shell.js';
import {BOX, waits} from '../lib/codes.js';
import {changeOf} from './journal.js';
import {setupsPart} from './setups.js';
import {linesOf, ofBox} from '../lib/incidents.js';
import {outages} from '../lib/state.js';
import {verdictOf, warningsOf} from '../lib/box_health.js';
import {changeName, fill, texts} from '../texts.js';

const t = texts.system;
const panel = (title, ...what) => el('section', {class: 'panel'}, el('h2', {}, title), ...what);
const hex = (crc) => (typeof crc === 'number' ? crc.toString(16).padStart(8, '0') : crc ?? NONE);

const LOOKED_AT = 200, CHANGES = 5; // lines of the journal
const unfolded = new Set(); // titles of opened sections

const folded = (title, ...what) => el('details', {open: unfolded.has(title), toggle: (event) => { if (event.target.open) unfolded.add(title); else unfolded.delete(title); }}, el('summary', {}, title), what);

// Bin k counts durations from 2^k to 2^(k+1) µs; the first also shorter ones, the last also longer ones.
function histogram(title, h) {
  const total = h.bins.reduce((sum, n) => sum + n, 0), most = Math.max(...h.bins, 1);
  const used = h.bins.map((n, k) => [n, k]).filter(([n]) => n > 0), from = used[0]?.[1] ?? 0, to = used.at(-1)?.[1] ?? 0;
  const rows = h.bins.map((n, k) => [k === h.bins.length - 1 ? `> ${microseconds(2 ** k)}` : microseconds(2 ** (k + 1)), meter(n ? Math.max(Math.log1p(n) / Math.log1p(most), 0.02) : 0), count(n),
    n ? percent(100 * n / total, n / total < 0.001 ? 4 : 2) : '']).slice(from, to + 1);
  return el('div', {class: 'histogram'}, el('h3', {}, title),
    facts([[t.median, microseconds(h.p50)], [t.p99, microseconds(h.p99)], [t.p999, microseconds(h.p99_9)], [t.worst, microseconds(h.worst)]]),
    folded(`${title}: ${t.histogram}`, table(`${title}: ${t.histogram}`, [{head: t.bin, row: true, class: 'number'}, {head: '', class: 'gauge'}, {head: t.count, class: 'number'}, {head: t.share, class: 'number'}], rows, {captionHidden: true, class: 'pairs'})));
}

function busTable(loops) {
  const h = texts.health, names = ['transactions', 'timeouts', 'device_exceptions', 'invalid_replies', 'reconnects', 'write_errors'];
  const columns = [{head: texts.overview.tag, row: true}, {head: h.connected}, ...names.map((name) => ({head: h[name], class: 'number'}))];
  return scroller(t.buses, table(t.busCaption, columns, loops.map(({loop, io}) => [el('a', {href: `#/loop/${encodeURIComponent(loop)}`}, loop), io.connected ? texts.yes : texts.no,
    ...names.map((name) => count(io[name]))]), {captionHidden: true, class: 'lines as-cards'}));
}

function pairsOf(object) {
  return Object.entries(object ?? {}).filter(([, value]) => ['number', 'string', 'boolean'].includes(typeof value))
    .map(([name, value]) => [name.replaceAll('_', ' '), counter(name, value)]);
}

// Changes of the box, newest first. Changes of its loops are in the journal.
async function changesOf(signal) {
  const answers = await Promise.all([{kind: 'system'}, {text: 'reload'}, {loop: BOX}].map((which) => get(`/api/journal${query({...which, most: LOOKED_AT})}`, signal)));
  const lines = new Map(answers.flatMap((answer) => answer.lines).filter((line) => !line.loop || ofBox(line)).map((line) => [line.id, line]));
  return [...lines.values()].sort((a, b) => b.id - a.id).slice(0, CHANGES);
}

function changesPart(lines) {
  if (!lines) return el('p', {class: 'soft'}, texts.notKnownNow);
  if (!lines.length) return el('p', {class: 'soft'}, t.noChanges);
  return el('ul', {class: 'changes'}, lines.map((line) => el('li', {}, el('span', {class: 'soft time'}, wall().dateTime(line.utc_ms)),
    el('span', {}, [line.alarm && changeName(line.alarm), line.what, changeOf(line), line.peer, line.result, line.reason].filter(Boolean).join(', ')))));
}

// The health of the box is shown first.
function healthPart(answer, warnings) {
  if (!answer?.daemon) {
    const since = answer?.daemon_state?.since_ms;
    return [el('p', {class: 'verdict bad'}, icon('bad'), since ? fill(t.notKnownSince, {time: wall().dateTime(since)}) : t.notKnown), answer?.daemon_state?.why ? el('p', {class: 'soft'}, answer.daemon_state.why) : null];
  }
  const [words, sign] = verdictOf(warnings, live.alarmsKnown && Boolean(live.overview), live.describe?.started_ms, (ms) => wall().dateTime(ms));
  const waiting = linesOf(live.alarms, live.incidents).filter((line) => !ofBox(line) && waits(line.state)).length;
  return [el('p', {class: 'verdict'}, icon(sign), words), waiting ? el('p', {}, el('a', {href: '#/alarms'}, fill(t.loopsWait, {n: waiting}))) : null,
    warnings.length ? el('ul', {class: 'warnings'}, warnings.map((one) => el('li', {}, icon(one.sign), one.href ? el('a', {href: one.href}, one.text) : one.text))) : null].filter(Boolean);
}

// Feeders and links, with the brokers, edge nodes and units that are lost behind them.
function connectionsPart(connections, loops) {
  const c = texts.connections, tagsOf = (name) => (live.describe?.loops ?? []).filter(({source}) => source === name).map(({tag}) => tag);
  const columns = [{head: c.name, row: true}, {head: c.state}, {head: c.loops, class: 'number'}, {head: c.silent, class: 'number'}, {head: c.lost, class: 'words'}];
  if (!connections.length) return el('p', {class: 'soft'}, loops.length ? c.none : texts.overview.empty);
  return scroller(c.title, table(c.caption, columns, connections.map((one) => {
    const bad = !one.up || one.lost.length > 0, words = one.up ? (bad ? c.partly : c.up) : c.down;
    return [one.name, el('span', {class: `state ${bad ? 'high' : ''}`}, el('span', {class: 'sign'}, icon(bad ? 'bad' : 'ok')), el('span', {}, words)), el('span', {title: tagsOf(one.name).join(', ')}, count(one.loops)), count(one.silent_loops), one.lost.join(', ')];
  }), {captionHidden: true, class: 'lines as-cards'}));
}

function counters(d, loops, page) {
  return folded(t.counters, el('div', {class: 'cards'},
    el('div', {class: 'across'}, panel(t.cycle, facts([[t.ticks, count(d.ticks)], [t.overruns, count(d.overruns)], [t.skipped, count(d.skipped_ticks)]]),
      el('div', {class: 'two'}, d.wake_up_us ? histogram(t.wake, d.wake_up_us) : null, d.work_us ? histogram(t.work, d.work_us) : null))),
    panel(t.disk, facts([[t.journal, fill(t.journalWritten, {n: count(d.journal?.written), waiting: count(d.journal?.waiting), lost: count(d.journal?.lost)})],
      [t.evidence, fill(t.journalWritten, {n: count(d.evidence?.written), waiting: count(d.evidence?.waiting), lost: count(d.evidence?.lost)})], [t.logLost, count(d.log_lines_lost)]])),
    panel(t.monitor, facts([[t.windows, count(d.monitor?.windows)], [t.backlog, count(d.monitor?.backlog)], [t.dropped, count(d.monitor?.dropped)],
      [t.explanations, fill(t.explained, {n: count(d.explanations?.explained), waiting: count(d.explanations?.waiting), failed: count(d.explanations?.failed)})]])),
    d.modbus_server ? panel(t.modbus, facts([[t.modbus, fill(t.port, {port: d.modbus_server.port})], [t.clients, count(d.modbus_server.clients)], [t.requests, count(d.modbus_server.requests)], [t.malformed, count(d.modbus_server.malformed)]])) : null,
    page ? panel(t.page, facts(pairsOf(page))) : null,
    loops.length ? el('div', {class: 'across'}, panel(t.buses, busTable(loops))) : null));
}

function parts(answer, changes) {
  const d = answer?.daemon, loops = answer?.loops ?? [], c = d?.configuration ?? {}, disk = answer?.disk, connected = loops.filter(({io}) => io.connected).length;
  const warnings = d ? warningsOf(answer, live.alarms, live.overview && live.describe ? outages(live.overview, live.describe.loops) : [], live.severe_percent, (ms) => wall().dateTime(ms)) : [];
  return [
    d ? el('div', {class: 'across'}, panel(texts.connections.title, connectionsPart(d.connections ?? [], loops))) : null,
    el('div', {class: 'wider stack'}, panel(t.health, ...healthPart(answer, warnings)), d ? panel(t.changes, changesPart(changes)) : null),
    answer?.setups?.length ? el('div', {class: 'across'}, panel(texts.setups.title, setupsPart(answer.setups))) : null,
    d ? panel(t.versions, facts([[t.started, `${wall().dateTime(live.describe?.started_ms)} (${fill(t.uptime, {long: duration(d.uptime_s)})})`],
      [t.connected, fill(t.nOf, {n: count(connected), all: count(loops.length)})], disk ? [t.free, fill(t.freeOf, {free: bytes(disk.free_bytes), all: bytes(disk.bytes)})] : null,
      [t.filesInForce, c.files_in_force ? texts.yes : texts.no], [t.version, d.version ?? NONE], [t.configHash, el('code', {}, hex(d.config_hash))], [t.modelHash, el('code', {}, hex(d.model_hash))],
      [t.zone, live.session.time_zone], [t.host, live.session.host ?? NONE], live.describe?.state_directory ? [t.stateDirectory, el('code', {}, live.describe.state_directory)] : null])) : null,
    d ? el('div', {class: 'across'}, counters(d, loops, answer.page)) : null,
  ].filter(Boolean);
}

export async function show(main, _, scope) {
  const place = el('div', {class: 'cards'}, el('p', {class: 'nothing'}, texts.loading));
  main.append(el('h1', {tabindex: -1}, t.title), place);
  const load = async () => {
    try {
      const [answer, changes] = await Promise.all([get('/api/system', scope.signal), changesOf(scope.signal).catch(() => null)]);
      const at = [...place.querySelectorAll('.scroller')].map((one) => one.scrollTop);
      place.replaceChildren(...parts(answer, changes));
      place.querySelectorAll('.scroller').forEach((one, i) => { one.scrollTop = at[i] ?? 0; });
    } catch (error) {
      if (error.name !== 'AbortError') place.replaceChildren(...parts(null, null));
    }
  };
  scope.on(live, 'stale', load);
  scope.on(live, 'alarms', load);
  if (!live.overview) scope.on(live, 'overview', load, {once: true});
  await scope.every(5000, load);
}
