// SPDX-License-Identifier: Apache-2.0
// A loop's gains: those in force, those of the file, and, for an engineer, the proposals of the rules and their effect.
import {GAINS, against, answersOf, fileLines, firstChoice, gainUnits, integralTime, sameGains, sickness, sticks} from '../lib/tuning.js';
import {NONE, duration, fixed, percent, significant} from '../lib/format.js';
import {Trend} from '../lib/trend.js';
import {el, facts, icon, scroller, table} from '../lib/dom.js';
import {get, loopPath, query} from '../lib/api.js';
import {live} from '../lib/live.js';
import {tune} from './acting.js';
import {wall} from '../lib/shell.js';
import {changeName, fill, texts} from '../texts.js';

const t = texts.tuning;
const MOST_MS = 2; // above it the loop has little margin: the user must confirm it
const nameOf = (trial) => (trial.rule ? t.rules[trial.rule] ?? trial.rule : t.today);

// The lines to paste, with a reminder that a restart drops values that are not in the file.
function fileNote(gains) {
  const lines = fileLines(gains.in_force, gains.file).join('\n');
  const copy = navigator.clipboard ? el('button', {type: 'button', click: async (event) => {
    await navigator.clipboard.writeText(lines);
    event.target.textContent = texts.copied;
  }}, texts.copy) : null;
  const set = gains.by ? fill(t.setBy, {who: gains.by, time: wall().dateTime(gains.since_ms)}) : '';
  return el('div', {class: 'not-in-file'}, el('p', {}, icon('low'), ' ', el('strong', {}, t.notInFile), set ? ` ${set}` : ''),
    el('p', {}, fill(t.restart, {gains: GAINS.map((name) => `${name} ${gains.file[name]}`).join(', ')}), ' ', t.paste),
    el('div', {class: 'command'}, el('code', {class: 'lines'}, lines), copy));
}

function gainFacts(gains, loop) {
  const units = gainUnits(loop.pv_unit, loop.co_unit), now = gains.in_force, ti = integralTime(now);
  return facts([...GAINS.map((name) => [t.gains[name], `${significant(now[name], 5)} ${units[name]}`]),
    [t.integralTime, ti === null ? t.noIntegral : duration(ti)]]);
}

class Proposals {
  constructor(loop, scope, uPlot, after) {
    Object.assign(this, {loop, scope, uPlot, after, model: '', form: 'pi', asked: 0});
    this.node = el('div', {class: 'proposals'}, el('button', {type: 'button', click: () => this.load()}, `${t.propose} …`));
    scope.on(live, 'theme', () => this.trend?.redraw());
    scope.atEnd(() => this.trend?.end());
  }

  async load(change = {}) {
    Object.assign(this, change);
    const mine = ++this.asked;
    if (sticks(live.alarms, this.loop.tag)) {
      this.#clear(el('p', {class: 'sick', role: 'status'}, icon('high'), ' ', fill(t.sticks, {alarms: sickness(live.alarms, this.loop.tag).map(changeName).join(', ')})),
        el('button', {type: 'button', click: () => this.load()}, texts.again));
      return;
    }
    this.#clear(el('p', {class: 'nothing', role: 'status'}, t.working));
    try {
      const answer = await get(loopPath(this.loop.tag, 'tuning') + query({model: this.model, form: this.form}), this.scope.signal);
      if (mine === this.asked) this.#show(answer);
    } catch (error) {
      if (error.name === 'AbortError' || mine !== this.asked) return;
      this.#clear(el('p', {class: 'trouble', role: 'alert'}, fill(texts.failed, {why: error.message})), el('button', {type: 'button', click: () => this.load()}, texts.again));
    }
  }

  #clear(...what) {
    this.trend?.end();
    this.trend = null;
    this.node.replaceChildren(...what);
  }

  #show(answer) {
    this.answer = answer;
    this.model = answer.model.source;
    if (!answer.rules) {
      this.#clear(this.#choices(), el('p', {}, answer.model.why_not), answer.model.settle ? el('p', {}, answer.model.settle) : '');
      return;
    }
    this.chosen = firstChoice(answer);
    this.box = el('div', {class: 'panes'});
    this.apply = el('div', {class: 'hands'});
    const sick = sickness(live.alarms, this.loop.tag).map(changeName).join(', ');
    this.#clear(this.#choices(), this.#about(), sick ? el('p', {class: 'sick'}, icon('low'), ' ', fill(t.sick, {alarms: sick})) : '', this.#table(), el('p', {class: 'soft small'}, fill(t.steps, {most: answer.most_sensitivity})), this.box, this.apply);
    this.#draw();
  }

  #choices() {
    const chip = (name, value, text, disabled, why) => el('label', {class: 'chip', title: disabled ? why : null}, el('input', {type: 'radio', name: `tuning-${name}`, value, disabled,
      checked: this[name] === value, change: () => this.load({[name]: value})}), el('span', {}, text));
    const {has_twin} = this.answer.model, {can_pid} = this.answer;
    return el('div', {class: 'tools'},
      el('fieldset', {class: 'chips'}, el('legend', {}, t.model), chip('model', 'twin', t.twin, !has_twin, texts.explain.noTwin), chip('model', 'record', t.record)),
      el('fieldset', {class: 'chips'}, el('legend', {}, t.form), chip('form', 'pi', 'PI'), chip('form', 'pid', 'PID', !can_pid, t.noFilter)));
  }

  #about() {
    const {model} = this.answer, {process} = model, {loop} = this, between = (name) => {
      const found = model.intervals?.[name];
      return found && found[1] !== null ? ` (${significant(found[0], 3)} … ${significant(found[1], 3)})` : '';
    };
    const perCo = `${loop.pv_unit || 'PV'}/${loop.co_unit || 'CO'}${process.time_constant_s === null ? '/s' : ''}`;
    return el('div', {}, facts([[t.gain, `${significant(process.gain, 4)} ${perCo}${between('gain')}`],
      process.time_constant_s === null ? null : [t.timeConstant, `${significant(process.time_constant_s, 4)} s${between('time_constant_s')}`],
      process.second_time_constant_s > 0 ? [t.secondLag, `${significant(process.second_time_constant_s, 4)} s`] : null,
      [t.deadTime, `${significant(process.dead_time_s, 4)} s${between('dead_time_s')}`],
      model.step_ms ? [t.step, fill(t.stepAt, {time: wall().dateTime(model.step_ms), fit: percent(model.fit_percent)})] : null]),
    (model.notes ?? []).map((note) => el('p', {class: 'soft small'}, note)));
  }

  #table() {
    const {answer, loop} = this, columns = [{head: t.rule, row: true}, ...GAINS.map((name) => ({head: name, class: 'number'})), {head: t.overshoot, class: 'number'}, {head: t.settling, class: 'number'},
      {head: fill(t.iae, {unit: `${loop.pv_unit || 'PV'} s`}), class: 'number'}, {head: t.gainMargin, class: 'number'}, {head: 'Ms', class: 'number'}, {head: t.remark}];
    const rows = answer.rules.map((trial, i) => {
      const name = i ? el('label', {class: 'choice'}, el('input', {type: 'radio', name: 'tuning-rule', value: i, checked: i === this.chosen, change: () => {
        this.chosen = i;
        this.#draw();
      }}), nameOf(trial)) : nameOf(trial);
      const remarks = [...(i === answer.recommended ? [t.recommended] : []), ...against(trial, answer.most_sensitivity).map((key) => t.against[key])];
      return [name, ...GAINS.map((gain) => significant(trial.gains[gain], 4)), percent(trial.overshoot_percent), trial.settling_2_percent_s === null ? NONE : duration(trial.settling_2_percent_s),
        significant(trial.load_absolute_error, 3), fixed(trial.gain_margin, 2), fixed(trial.sensitivity, 2), remarks.join('; ')];
    });
    return scroller(t.title, table(t.caption, columns, rows, {class: 'as-cards', captionHidden: true}));
  }

  #draw() {
    const {answer, loop} = this, trial = answer.rules[this.chosen], v = texts.values;
    const drawn = answersOf(answer, this.chosen ?? 0), then = trial ? nameOf(trial) : t.today;
    this.trend?.end();
    this.box.replaceChildren();
    this.trend = new Trend(this.uPlot, this.box, {x: {unit: 's'}, panes: [
      {label: t.upper, unit: loop.pv_unit, range: loop.pv_range, high: 230, curves: [{key: 'sp', name: v.sp, ink: 'sp', dash: [6, 4]}, {key: 'pv_now', name: `${v.pv}, ${t.today}`, ink: 'measured', dash: [3, 3]}, {key: 'pv', name: `${v.pv}, ${then}`, ink: 'c1', width: 1.8}]},
      {label: t.lower, unit: loop.co_unit, range: loop.co_range, high: 160, curves: [{key: 'co_now', name: `${v.co}, ${t.today}`, ink: 'co', dash: [3, 3]}, {key: 'co', name: `${v.co}, ${then}`, ink: 'c1', width: 1.8}]}]});
    this.trend.show(drawn, [0, drawn.t.at(-1)]);
    const old = answer.in_force.in_force;
    this.apply.replaceChildren(!trial || sameGains(trial.gains, old) ? el('p', {class: 'soft'}, t.nothing)
      : el('button', {type: 'button', class: 'main', click: () => tune(loop, old, trial.gains, this.after, trial.sensitivity > MOST_MS || trial.sensitivity === null ? trial.sensitivity ?? Infinity : null)}, fill(t.apply, {rule: then})));
  }
}

// Returns in words why the page can't change the gains; null: it can.
function whyNot() {
  const {session} = live;
  if (session.can?.tuning) return null;
  return session.login && live.describe.page?.tuning ? t.needsEngineer : t.off;
}

// {node, show(gains), refresh()}: `gains` as the daemon reports them; refresh() requests them.
export function tuningPart(loop, scope, uPlot) {
  const told = el('div', {class: 'told'}, el('p', {class: 'nothing'}, texts.loading)), why = whyNot();
  let key = '';
  const show = (gains) => {
    const now = JSON.stringify(gains);
    if (!gains || now === key) return;
    key = now;
    told.replaceChildren(gainFacts(gains, loop), gains.not_in_file ? fileNote(gains) : '');
  };
  const refresh = async () => {
    try {
      show((await get(loopPath(loop.tag), scope.signal)).gains);
    } catch (error) {
      if (error.name === 'AbortError') return;
      key = '';
      told.replaceChildren(el('p', {class: 'trouble', role: 'alert'}, fill(texts.failed, {why: error.message})));
    }
  };
  // New gains are shown immediately; the proposals stay next to them.
  const proposals = why ? null : new Proposals(loop, scope, uPlot, async () => {
    await refresh();
    await proposals.load();
  });
  return {node: el('div', {class: 'tuning'}, told, proposals?.node ?? el('p', {class: 'soft small'}, why)), show, refresh};
}
