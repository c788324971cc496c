// SPDX-License-Identifier: Apache-2.0
import {el, facts, icon, scroller, table} from '../lib/dom.js';
import {NONE, bytes, count, counter, duration, microseconds, percent} from '../lib/format.js';
import {get} from '../lib/api.js';
import {live} from '../lib/live.js';
import {meter} from '../lib/charts.js';
import {wall} from '../lib/shell.js';
import {fill, texts} from '../texts.js';

const t = texts.system;
const panel = (title, ...what) => el('section', {class: 'panel'}, el('h2', {}, title), what);
const hex = (crc) => (typeof crc === 'number' ? crc.toString(16).padStart(8, '0') : crc ?? NONE);

const unfolded = new Set(); // titles of histograms that the reader has opened

// Bin k holds what took from 2^k to 2^(k+1) µs; the first also what took less, the last also what took more.
function histogram(title, h) {
  const total = h.bins.reduce((sum, n) => sum + n, 0), most = Math.max(...h.bins, 1);
  const used = h.bins.map((n, k) => [n, k]).filter(([n]) => n > 0), from = used[0]?.[1] ?? 0, to = used.at(-1)?.[1] ?? 0;
  const rows = h.bins.map((n, k) => [k === h.bins.length - 1 ? `> ${microseconds(2 ** k)}` : microseconds(2 ** (k + 1)), meter(n ? Math.max(Math.log1p(n) / Math.log1p(most), 0.02) : 0), count(n),
    n ? percent(100 * n / total, n / total < 0.001 ? 4 : 2) : '']).slice(from, to + 1);
  return el('div', {class: 'histogram'}, el('h3', {}, title),
    facts([[t.median, microseconds(h.p50)], [t.p99, microseconds(h.p99)], [t.p999, microseconds(h.p99_9)], [t.worst, microseconds(h.worst)]]),
    el('details', {open: unfolded.has(title), toggle: (event) => { if (event.target.open) unfolded.add(title); else unfolded.delete(title); }}, el('summary', {}, t.histogram), table(`${title}: ${t.histogram}`, [{head: t.bin, row: true, class: 'number'}, {head: '', class: 'gauge'}, {head: t.count, class: 'number'}, {head: t.share, class: 'number'}], rows, {captionHidden: true, class: 'pairs'})));
}

function warningsOf(d, loops) {
  const c = d.configuration ?? {}, list = [];
  const add = (when, text, values = {}) => { if (when) list.push(fill(text, values)); };
  add(d.real_time_missing, t.noRealTime, {text: d.real_time_missing});
  add(d.overruns > 0, t.overrunsWarn, {n: count(d.overruns)});
  add(d.events_dropped > 0, t.eventsLost, {n: count(d.events_dropped)});
  add(d.journal?.error, t.journalError, {text: d.journal?.error});
  add(d.journal?.damaged > 0, t.journalDamaged, {n: d.journal?.damaged});
  add(d.evidence?.error, t.evidenceError, {text: d.evidence?.error});
  add(d.recorder?.disk_wait_s > 1, t.diskWait, {long: duration(d.recorder?.disk_wait_s)});
  for (const waiting of c.waiting_for_restart ?? []) add(true, t.waitingRestart, waiting);
  for (const waiting of c.waiting_for_output ?? []) add(true, t.waitingOutput, waiting);
  add(c.refused?.length, t.refusedFile, {text: [c.refused].flat().join('; ')});
  for (const {loop, io, recording} of loops) {
    const lost = recording.dropped + (recording.queue_dropped ?? 0) + recording.rows_lost;
    add(!io.connected, t.linkDown, {loop});
    add(lost > 0, t.rowsLost, {loop, n: count(lost)});
  }
  return list;
}

function busTable(loops) {
  const h = texts.health, names = ['transactions', 'timeouts', 'device_exceptions', 'invalid_replies', 'reconnects', 'write_errors'];
  const columns = [{head: texts.overview.tag, row: true}, {head: h.connected}, ...names.map((name) => ({head: h[name], class: 'number'}))];
  return scroller(t.buses, table(t.busCaption, columns, loops.map(({loop, io}) => [el('a', {href: `#/loop/${encodeURIComponent(loop)}`}, loop), io.connected ? texts.yes : texts.no,
    ...names.map((name) => count(io[name]))]), {captionHidden: true, class: 'lines'}));
}

function pairsOf(object) {
  return Object.entries(object ?? {}).filter(([, value]) => ['number', 'string', 'boolean'].includes(typeof value))
    .map(([name, value]) => [name.replaceAll('_', ' '), counter(name, value)]);
}

function parts(answer) {
  const d = answer.daemon ?? {}, loops = answer.loops ?? [], c = d.configuration ?? {}, disk = answer.disk ?? {};
  const warnings = warningsOf(d, loops);
  return [
    el('div', {class: 'wider'}, panel(t.warnings, warnings.length ? el('ul', {class: 'warnings'}, warnings.map((text) => el('li', {}, icon('low'), text))) : el('p', {class: 'calm'}, icon('ok'), t.noWarnings))),
    panel(t.versions, facts([[t.version, d.version ?? NONE], [t.configHash, el('code', {}, hex(d.config_hash))], [t.modelHash, el('code', {}, hex(d.model_hash))],
      [t.filesInForce, c.files_in_force ? texts.yes : texts.no], [t.started, `${wall().dateTime(live.describe?.started_ms)} (${fill(t.uptime, {long: duration(d.uptime_s)})})`],
      [t.zone, live.session.time_zone], [t.host, live.session.host ?? NONE], live.describe?.state_directory ? [t.stateDirectory, el('code', {}, live.describe.state_directory)] : null])),
    el('div', {class: 'across'}, panel(t.cycle, facts([[t.ticks, count(d.ticks)], [t.overruns, count(d.overruns)], [t.skipped, count(d.skipped_ticks)]]),
      el('div', {class: 'two'}, d.wake_up_us ? histogram(t.wake, d.wake_up_us) : null, d.work_us ? histogram(t.work, d.work_us) : null))),
    panel(t.disk, facts([disk.free_bytes !== undefined ? [t.free, fill(t.freeOf, {free: bytes(disk.free_bytes), all: bytes(disk.bytes)})] : null,
      [t.journal, fill(t.journalWritten, {n: count(d.journal?.written), waiting: count(d.journal?.waiting), lost: count(d.journal?.lost)})],
      [t.evidence, fill(t.journalWritten, {n: count(d.evidence?.written), waiting: count(d.evidence?.waiting), lost: count(d.evidence?.lost)})], [t.logLost, count(d.log_lines_lost)]])),
    panel(t.monitor, facts([[t.windows, count(d.monitor?.windows)], [t.backlog, count(d.monitor?.backlog)], [t.dropped, count(d.monitor?.dropped)],
      [t.explanations, fill(t.explained, {n: count(d.explanations?.explained), waiting: count(d.explanations?.waiting), failed: count(d.explanations?.failed)})]])),
    d.modbus_server ? panel(t.modbus, facts([[t.modbus, fill(t.port, {port: d.modbus_server.port})], [t.clients, count(d.modbus_server.clients)], [t.requests, count(d.modbus_server.requests)], [t.malformed, count(d.modbus_server.malformed)]])) : null,
    answer.page ? panel(t.page, facts(pairsOf(answer.page))) : null,
    loops.length ? el('div', {class: 'across'}, panel(t.buses, busTable(loops))) : null,
  ].filter(Boolean);
}

export async function show(main, _, scope) {
  const place = el('div', {class: 'cards'});
  main.append(el('h1', {tabindex: -1}, t.title), place);
  await scope.every(5000, async () => {
    try {
      const answer = await get('/api/system', scope.signal);
      const at = [...place.querySelectorAll('.scroller')].map((one) => one.scrollTop);
      place.replaceChildren(...parts(answer));
      place.querySelectorAll('.scroller').forEach((one, i) => { one.scrollTop = at[i] ?? 0; });
    } catch (error) {
      if (error.name !== 'AbortError' && !place.firstChild) place.replaceChildren(panel(t.warnings, el('p', {class: 'trouble'}, fill(texts.failed, {why: error.message}))));
    }
  });
}
