// SPDX-License-Identifier: Apache-2.0
// One loop: faceplate, trend, and information about its valve.
import {FAULTS, FLAGS, MODES, named, priority, quality, shown} from '../lib/codes.js';
import {FollowingTrend} from '../lib/trend_tools.js';
import {loadPlotter} from '../lib/trend.js';
import {bar, drawPhase} from '../lib/charts.js';
import {curvesText} from '../lib/curves.js';
import {byTag} from '../lib/order.js';
import {decimalsFor, fixed, quantity} from '../lib/format.js';
import {el, facts, foldingPanel, icon, setAttribute, setText, table, timeInput, unseen} from '../lib/dom.js';
import {extent, merged, trimmed} from '../lib/history.js';
import {field} from '../lib/dialog.js';
import {get, loopPath, query} from '../lib/api.js';
import {live} from '../lib/live.js';
import {LoopReports} from './loop_reports.js';
import {wall} from '../lib/shell.js';
import {alarmNow, alarmTable, calmPart, commissioningText, conditionTable, explanationPart, healthTable, judgesOf, measureTable, twinFacts, twinPart, windowTable} from './loop_parts.js';
import {act, operator, order} from './acting.js';
import {reportOf} from './reports.js';
import {testPart} from './planned_test.js';
import {tuningPart} from './tuning.js';
import {actsOf, modeOf, ne107Of, signOf} from '../lib/state.js';
import {fill, texts} from '../texts.js';

const t = texts.loop;
const tt = texts.trend;

const across = (title, node) => el('div', {class: 'across'}, foldingPanel(title, node));
const panel = (title, ...what) => el('section', {class: 'panel'}, el('h2', {}, title), what);

class Faceplate {
  constructor(loop) {
    this.loop = loop;
    const v = texts.values;
    this.pv = bar({name: v.pv, range: loop.pv_range, unit: loop.pv_unit});
    this.sp = bar({name: v.sp, range: loop.pv_range, unit: loop.pv_unit, limits: loop.sp_limits});
    this.co = bar({name: v.co, range: loop.co_range, unit: loop.co_unit, limits: loop.output_limits});
    this.acts = el('p', {class: 'acts'});
    this.mode = el('span', {class: 'mode big'});
    this.asked = el('span', {class: 'soft'});
    this.notes = el('ul', {class: 'notes'});
    this.stem = el('span', {class: 'value'});
    this.#act(actsOf(null, 0, loop, true));
    this.node = el('section', {class: 'panel faceplate', 'aria-label': t.faceplate}, el('h2', {class: 'unseen'}, t.faceplate),
      this.acts, el('div', {class: 'mode-line'}, el('span', {class: 'soft'}, t.mode), this.mode, this.asked),
      el('div', {class: 'bars'}, this.pv.node, this.sp.node, this.co.node),
      loop.stem ? el('p', {class: 'stem-line'}, `${v.stem} `, this.stem) : null, this.notes, this.#hands(), this.judges = el('div', {class: 'judges small'}));
    this.source('');
  }

  // The detectors that judge the valve. For a watched loop also the values that its source leaves out (monitor.source).
  source(text) {
    if (this.sourceShown === text) return;
    this.sourceShown = text;
    this.judges.replaceChildren(facts([[t.judgedBy, judgesOf(this.loop)], text ? [t.source, text] : null]));
  }

  #hands() {
    const {session} = live;
    if (this.loop.control === 'elsewhere') return null;
    if (!session.can?.control) {
      return el('p', {class: 'soft small'}, session.login && !operator() && live.describe.page?.control ? t.needsOperator : t.noControl);
    }
    const hand = (what, text) => el('button', {type: 'button', click: () => order(this.loop, what)}, text);
    return el('div', {class: 'hands', role: 'group', 'aria-label': t.operate}, hand('mode', `${t.mode} …`), hand('set_point', `${t.setPoint} …`),
      this.outputHand = hand('output', `${t.output} …`), this.outputWhy = el('small', {class: 'soft'}, texts.acting.outputAuto));
  }

  // User and time of the last change: from the loop's own answer, which arrives less often.
  commissioning(holder) { this.holder = holder; }

  outOfService(why) { this.out = why; }

  update(o, i) {
    const mode = modeOf(o, i, this.loop), asked = MODES[o.requested_mode?.[i]];
    this.#act(actsOf(o, i, this.loop, Boolean(live.stale)));
    this.pv.set(o.pv[i], o.sp[i]);
    this.sp.set(o.sp[i]);
    this.co.set(o.co[i], o.stem[i]);
    setText(this.mode, mode ? texts.modes[mode] : texts.notKnown);
    setAttribute(this.mode, 'class', mode && mode !== 'automatic' ? 'mode big odd' : 'mode big');
    setText(this.asked, asked && mode && asked !== mode && this.loop.control !== 'elsewhere' ? fill(t.requested, {mode: texts.modes[asked]}) : '');
    setText(this.stem, quantity(o.stem[i], this.loop.co_range, this.loop.co_unit));
    if (this.outputHand) {
      this.outputHand.disabled = mode === 'automatic';
      this.outputWhy.hidden = !this.outputHand.disabled;
    }
    const words = [], fault = named(FAULTS, o.fault[i]), bad = o.quality[i] !== null && quality(o.quality[i]) !== 'good';
    if (fault && fault !== 'none') words.push([texts.faults[fault], fault === 'starting' ? null : 'bad']);
    if (bad && fault !== 'bad_pv') words.push([`${texts.values.pv} ${texts.quality[quality(o.quality[i])]}`, 'bad']);
    if (o.stands[i] && !live.stale) words.push([texts.stale.loop, 'bad']);
    for (const [name, bit] of Object.entries(FLAGS)) if (o.flags[i] & bit && texts.flags[name]) words.push([texts.flags[name], null]);
    if (this.out) words.push([fill(texts.outOfService, {why: this.out}), 'bad']);
    if (o.commissioned?.[i]) words.push([commissioningText(this.holder), 'low']);
    if (o.not_in_file?.[i]) words.push([texts.tuning.notInFile, null]);
    const key = JSON.stringify(words);
    if (key === this.said) return;
    this.said = key;
    this.notes.replaceChildren(...words.map(([text, sign]) => el('li', {class: sign ? 'odd' : null}, sign ? icon(sign) : null, text)));
  }

  #act({key, odd, word, detail}) {
    if (this.acts.shown === detail) return;
    this.acts.shown = detail;
    setAttribute(this.acts, 'data-acts', key);
    this.acts.replaceChildren(el('strong', {class: odd ? 'odd' : null}, word), el('span', {class: 'soft small'}, detail));
  }
}

class LoopTrend extends FollowingTrend {
  #loaded = 0;

  constructor(loop, scope, uPlot, options) {
    super(scope, uPlot, options, t.trend);
    this.loop = loop;
    this.tags = [loop.tag];
    this.csv = el('a', {class: 'button', download: `${loop.tag}.csv`}, tt.csv);
    this.numbers = el('div', {});
    this.node = el('section', {class: 'panel trend'}, el('h2', {class: 'unseen'}, t.trend), this.tools, this.box,
      this.keys, el('div', {class: 'under'}, this.note, el('span', {class: 'stretch'}), this.#jump(), this.#ways(), this.csv), this.noted, this.numbers);
    this.canvas = el('canvas', {role: 'img', 'aria-label': texts.phase.label});
    this.phase = panel(t.phase, el('div', {class: 'phase'}, this.canvas));
    this.curves(this.#panes(), 2000 * loop.sample_time_s / (live.describe.accelerate || 1));
    scope.on(live, 'theme', () => this.rows() && this.#phase());
    const sizes = new ResizeObserver(() => this.rows() && this.#phase());
    sizes.observe(this.phase);
    scope.atEnd(() => sizes.disconnect());
  }

  #panes() {
    const {loop} = this, v = texts.values;
    return [
      {label: tt.upper, unit: loop.pv_unit, range: loop.pv_range, high: 270, curves: [{key: 'sp', name: v.sp, ink: 'sp', dash: [6, 4], width: 1.5}, {key: 'pv', name: v.pv, ink: 'measured', width: 1.7}]},
      {label: tt.lower, unit: loop.co_unit, range: loop.co_range, high: 190, curves: [{key: 'co', name: v.co, ink: 'co', width: 1.7},
        ...(loop.stem ? [{key: 'stem', name: v.stem, ink: 'stem', dash: [3, 3], width: 1.7}] : [])]}];
  }

  #jump() {
    const from = timeInput({required: true}), to = timeInput({required: true});
    const form = el('form', {class: 'filters', submit: (event) => {
      event.preventDefault();
      const span = [wall().fromInput(from.value), wall().fromInput(to.value)];
      if (span[1] > span[0]) this.want(span);
    }}, field(`${tt.from} (${wall().zone})`, from), field(tt.to, to), el('button', {type: 'submit'}, tt.go));
    const details = el('details', {class: 'jump'}, el('summary', {}, tt.jump), form);
    details.addEventListener('toggle', () => { [from.value, to.value] = this.span().map((ms) => wall().toInput(ms)); });
    return details;
  }

  // Links from this trend: a note, a comparison with other loops, a picture.
  #ways() {
    const {tag} = this.loop;
    return [this.noteButton(tag, `${texts.notes.title} …`), el('a', {class: 'button', href: `#/trends${query({curves: curvesText([{tag, quantity: 'pv'}, {tag, quantity: 'sp'}])})}`}, tt.others),
      this.pictureButton(tag)];
  }

  rows() { return this.histories[this.loop.tag] ?? null; }

  async load() {
    this.#loaded = performance.now();
    await super.load();
    if (this.rows()) this.#numbers();
  }

  // If every sample is shown, only the new ones are fetched.
  follow(...how) {
    if (how.length || this.rows()?.bucket_s !== null) super.follow(...how);
    else super.follow(1000, () => this.#tail());
  }

  async #tail() {
    const mine = this.asked, {tag} = this.loop, history = this.rows(), from = history.t.at(-1) ?? this.span()[0];
    try {
      const tail = await this.history(tag, from, this.newest() + 60_000, 4000);
      if (mine !== this.asked) return;
      if (tail.bucket_s !== null || history.t.length > 12_000 || performance.now() - this.#loaded > 15_000) { await this.load(); return; }
      this.histories = {[tag]: trimmed(merged(history, tail), this.span()[0])};
      this.draw();
    } catch (error) {
      if (error.name === 'AbortError') return; // for other errors the stream's banner reports missing data
    }
    this.follow();
  }

  drawn(span) {
    const {oldest_ms} = this.rows(), reaches = oldest_ms === null ? '' : fill(tt.reaches, {time: wall().dateTime(oldest_ms)});
    setText(this.note, [this.said(this.rows(), span), reaches].filter(Boolean).join('. ').replace('..', '.').replace(/^./, (first) => first.toUpperCase()));
    this.csv.href = this.csvHref(this.loop.tag, span);
    this.#phase();
  }

  #phase() {
    const {loop} = this;
    drawPhase(this.canvas, this.rows(), this.span(), {pv: loop.pv_range, co: loop.co_range},
      [`${texts.values.co} ${loop.co_unit}`, `${texts.values.pv} ${loop.pv_unit}`]);
  }

  #numbers() {
    const {loop} = this, v = texts.values;
    const row = (key, name, range, u) => {
      const found = extent(this.rows(), [key], ...this.span()), d = decimalsFor(range);
      return [`${name}${u ? `, ${u}` : ''}`, fixed(this.rows()[key]?.findLast((x) => x !== null), d), fixed(found?.[0], d), fixed(found?.[1], d)];
    };
    const rows = [row('pv', v.pv, loop.pv_range, loop.pv_unit), row('sp', v.sp, loop.pv_range, loop.pv_unit), row('co', v.co, loop.co_range, loop.co_unit)];
    if (loop.stem) rows.push(row('stem', v.stem, loop.co_range, loop.co_unit));
    const columns = [{head: tt.quantity, row: true}, {head: tt.atNewest, class: 'number'}, {head: tt.lowest, class: 'number'}, {head: tt.highest, class: 'number'}];
    const open = this.numbers.querySelector('details')?.open;
    this.numbers.replaceChildren(el('details', {open}, el('summary', {}, tt.table), table(tt.table, columns, rows, {captionHidden: true, class: 'pairs'})));
  }
}

// Area, and the other loops of its cascade.
function placeOf(loop) {
  const link = (one) => el('a', {href: `#/loop/${encodeURIComponent(one.tag)}`}, one.tag);
  const loops = live.describe.loops, master = loops.find((one) => one.tag === loop.master);
  const slaves = loops.filter((one) => one.master === loop.tag);
  const parts = [loop.area || null, master && el('span', {}, `${t.slaveOf} `, link(master)),
    ...slaves.map((one) => el('span', {}, `${t.masterOf} `, link(one)))].filter(Boolean);
  return el('span', {class: 'about'}, ...parts.flatMap((part, k) => (k === 0 ? [part] : [' · ', part])));
}

function header(loop) {
  const tags = live.describe.loops.map((one) => one.tag).sort(byTag), at = tags.indexOf(loop.tag);
  const to = (tag, sign, label) => (tag === undefined ? null : el('a', {class: 'button square', href: `#/loop/${encodeURIComponent(tag)}`, 'aria-label': `${label}: ${tag}`, title: tag}, icon(sign)));
  const ne107 = el('span', {class: 'ne107 wide'});
  const alarms = el('ul', {class: 'loop-alarms', 'aria-label': t.alarms});
  const node = el('div', {class: 'title'}, el('h1', {tabindex: -1}, loop.tag), el('span', {class: 'about'}, loop.description ?? ''), placeOf(loop), ne107, alarms,
    to(tags[at - 1], 'back', t.previous), to(tags[at + 1], 'on', t.next));
  const update = (o, i) => {
    const [letter, meaning] = ne107Of(o, i, Boolean(live.stale));
    if (ne107.shown !== letter) {
      ne107.shown = letter;
      setAttribute(ne107, 'class', `ne107 wide ne-${letter}${loop.simulated ? ' sim' : ''}`);
      ne107.replaceChildren(unseen(`${t.ne107}: `), el('b', {}, letter), ` ${meaning}`);
    }
    const list = live.alarms.filter((alarm) => alarm.loop === loop.tag && shown(alarm.state)), key = JSON.stringify(list);
    if (alarms.shownKey === key) return;
    alarms.shownKey = key;
    alarms.replaceChildren(...list.map((alarm) => {
      const grave = priority(alarm, live.severe_percent);
      return el('li', {}, el('a', {class: `alarm-chip ${alarm.state === 'shelved' ? '' : grave}`, href: `#/alarms/${encodeURIComponent(loop.tag)}/${alarm.alarm}`},
        icon(signOf(alarm.state, grave)), `${texts.alarms[alarm.alarm] ?? alarm.alarm}, ${texts.alarmStates[alarm.state]}`));
    }));
  };
  return {node, update};
}

function described(tag, scope) {
  return new Promise((done) => {
    const look = () => live.describe && done(live.describe.loops[live.places.get(tag)] ?? null);
    if (live.describe) look(); else scope.on(live, 'describe', look);
  });
}

export async function show(main, {parts: [tag = ''], options}, scope) {
  const waiting = el('p', {class: 'nothing'}), say = () => setText(waiting, live.stale ? texts.notKnownNow : texts.loading);
  say();
  scope.on(live, 'stale', say);
  main.append(el('h1', {tabindex: -1}, tag), waiting);
  const [uPlot, loop] = await Promise.all([loadPlotter(), described(tag, scope)]);
  if (scope.over) return;
  if (!loop) {
    main.replaceChildren(el('section', {class: 'panel'}, el('h1', {tabindex: -1}, fill(t.noLoop, {tag}))));
    return;
  }
  const head = header(loop), faceplate = new Faceplate(loop);
  main.replaceChildren(head.node);
  const trend = new LoopTrend(loop, scope, uPlot, options);
  const reports = new LoopReports(loop, trend, scope);
  const places = Object.fromEntries(['condition', 'measures', 'windows', 'health', 'explanation', 'twin', 'alarms'].map((name) => [name, el('div', {class: 'told'}, el('p', {class: 'nothing'}, texts.loading))]));
  places.calm = el('div', {class: 'told'});
  const tuning = loop.control === 'elsewhere' ? null : tuningPart(loop, scope, uPlot);
  const test = loop.twin && loop.control !== 'elsewhere' ? testPart(loop, scope) : null;
  main.append(el('div', {class: 'loop-top'}, faceplate.node, trend.node),
    el('div', {class: 'loop-rest'}, el('div', {class: 'stack'}, trend.phase, panel(t.explanation, places.explanation, reports.receipt, test?.node ?? null, places.calm), loop.twin ? foldingPanel(t.twin, places.twin) : null), foldingPanel(t.measures, places.measures), foldingPanel(t.health, places.health),
      tuning ? across(texts.tuning.title, tuning.node) : null, across(t.processAlarms, places.alarms), across(t.condition, places.condition), across(t.windows, places.windows), across(texts.asked.title, reports.node)));
  scope.on(window, 'beforeprint', () => main.querySelectorAll('.folding').forEach((one) => { one.open = true; }));
  const i = live.places.get(tag);
  const update = () => {
    if (!live.overview) return;
    head.update(live.overview, i);
    faceplate.update(live.overview, i);
  };
  scope.on(live, 'overview', update);
  scope.on(live, 'alarms', update);
  scope.on(live, 'stale', update);
  update();
  await trend.load();
  reports.start();
  followDetails(loop, places, faceplate, scope, tuning);
}

// Slowly changing content: checked each 5 s, written only after a change, so that selection and scroll position stay.
function followDetails(loop, places, faceplate, scope, tuning) {
  const put = (name, key, make) => {
    const text = JSON.stringify(key);
    if (places[name].key === text) return;
    places[name].key = text;
    const scrolled = places[name].querySelector('.scroller')?.scrollLeft ?? 0;
    places[name].replaceChildren(make());
    const fresh = places[name].querySelector('.scroller');
    if (fresh) fresh.scrollLeft = scrolled;
  };
  // The design of alarms changes only with the files.
  let designs = null;
  scope.on(live, 'describe', () => { designs = null; });
  scope.every(5000, async () => {
    if (live.stale) return;
    try {
      designs ??= await get(loopPath(loop.tag, 'alarms'), scope.signal).then(({alarms}) => alarms, () => null);
      const [now, windows] = await Promise.all([get(loopPath(loop.tag), scope.signal), get(loopPath(loop.tag, 'windows'), scope.signal).catch(() => ({windows: []}))]);
      const folder = now.explanation?.folder.split('/').at(-1) ?? null, report = folder && await reportOf(folder, scope.signal);
      faceplate.source(now.monitor.source);
      faceplate.commissioning(now.commissioning);
      faceplate.outOfService(now.out_of_service);
      const stateNow = Object.fromEntries(Object.values(now.alarms).map((alarm) => [alarm.alarm, alarmNow(alarm)]));
      put('alarms', [designs, stateNow], () => (designs ? alarmTable(designs, loop, (alarm) => stateNow[alarm] ?? texts.notKnown) : el('p', {class: 'nothing'}, texts.notKnownNow)));
      tuning?.show(now.gains);
      put('condition', now.monitor.condition, () => conditionTable(now.monitor.condition));
      put('measures', now.monitor, () => measureTable(now.monitor));
      const said = now.monitor.twin && twinFacts(now.monitor.twin);
      if (said) put('twin', said, () => twinPart(said, loop));
      put('health', [now.io, now.recording, now.pv_age_ms], () => healthTable(now));
      put('windows', windows.windows, () => windowTable(windows.windows));
      put('explanation', [now.explanation, report?.id], () => (now.explanation ? explanationPart(now.explanation, report?.id ?? null)
        : el('p', {class: 'nothing'}, loop.twin ? texts.explain.none : texts.explain.noTwin)));
      const begin = live.session.can?.alarms ? () => act(loop.tag, 'stiction', 'calm') : null;
      put('calm', [now.monitor.corrective_action, now.compensator?.says, now.explanation?.effect, Boolean(begin)], () => calmPart(now, begin) ?? '');
    } catch (error) {
      if (error.name !== 'AbortError' && !places.condition.key) places.condition.replaceChildren(el('p', {class: 'trouble'}, fill(texts.failed, {why: error.message})));
    }
  });
}
