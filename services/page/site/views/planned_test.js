// SPDX-License-Identifier: Apache-2.0
// The test that decides between the explanations of a loop: two steps of an engineer, its progress, its decision.
import {decimalsFor, duration, fixed, percent, significant} from '../lib/format.js';
import {el, facts, setText} from '../lib/dom.js';
import {ask, field, toast} from '../lib/dialog.js';
import {get, loopPath, post} from '../lib/api.js';
import {live} from '../lib/live.js';
import {operator} from './acting.js';
import {wall} from '../lib/shell.js';
import {fill, texts} from '../texts.js';

const t = texts.test;
const UNDER_WAY = ['moving', 'restoring', 'judging'];

// Returns in words why the page can't carry out a test; null: it can.
function whyNot() {
  const {session} = live;
  if (session.can?.tests) return null;
  return session.login && live.describe.page?.tests ? t.needsEngineer : t.off;
}

// The move with its largest deviations, and the meaning of each outcome.
function about(loop, plan) {
  const pv = loop.pv_unit || 'PV', co = loop.co_unit || 'CO', number = (value, range) => fixed(value, decimalsFor(range) + 1);
  const within = ([low, high], range, unit) => fill(t.range, {low: number(low, range), high: number(high, range), unit});
  const size = Math.abs(plan.size), [range, unit] = plan.manual ? [loop.co_range, co] : [loop.pv_range, pv];
  return el('div', {}, facts([[texts.acting.tag, loop.tag],
    [t.move, fill(plan.manual ? t.output : t.setPoint, {size: number(size, range), from: number(plan.from, range), unit, kind: t.moves[plan.move] ?? plan.move})],
    [t.lasts, duration(plan.duration_s)],
    [t.worst, fill(t.swings, {pv: `${significant(plan.pv_swing)} ${pv}`, co: `${significant(plan.output_swing)} ${co}`})],
    [t.ends, fill(t.limits, {pv: within(plan.pv_limits, loop.pv_range, pv), co: within(plan.co_limits, loop.co_range, co)})],
    [t.after, plan.manual ? t.backManual : t.back],
    [t.chance, fill(t.chances, {right: percent(100 * plan.probability_right), wrong: percent(100 * plan.probability_wrong)})],
    [t.planned, wall().dateTime(plan.planned_ms)]]),
  el('h3', {}, t.outcomes),
  facts([...plan.outcomes.map(({name, probability, remedy}) => [fill(t.outcome, {name, now: percent(100 * probability)}), remedy]), [t.undecided, t.stays]]));
}

function read(loop, plan, after) {
  ask({title: fill(t.title, {tag: loop.tag}), label: texts.goOn, long: true, body: about(loop, plan), accept: async () => { setTimeout(() => confirm(loop, plan, after)); }});
}

function confirm(loop, plan, after) {
  const tag = el('input', {name: 'tag', autocomplete: 'off', autocapitalize: 'off', spellcheck: 'false', required: true});
  ask({
    title: texts.acting.confirmTitle, grave: true, label: fill(t.start, {tag: loop.tag}),
    body: [el('p', {}, t.confirm), field(fill(t.type, {tag: loop.tag}), tag)],
    accept: async (data) => {
      if (String(data.get('tag')).trim() !== loop.tag) throw new Error(t.otherTag);
      await post(loopPath(loop.tag, 'test'), {action: 'start', confirm: {tag: loop.tag, plan: plan.id}});
      toast(fill(t.begun, {tag: loop.tag}));
      after();
    },
  });
}

function resultOf(test) {
  const said = test.ended_early ? fill(t.endedEarly, {why: test.ended_early}) : test.sentence ?? '';
  return `${said} ${test.restored ? t.restored : t.notRestored}`;
}

// {node}: the proposed test with its button, and the state of the newest one.
export function testPart(loop, scope) {
  const progress = el('p', {class: 'test-now', role: 'status', hidden: true}), trouble = el('p', {class: 'trouble', role: 'alert', hidden: true});
  const offer = el('div', {class: 'hands', hidden: true}), stop = el('button', {type: 'button', class: 'grave', hidden: true, click: async () => {
    try {
      await post(loopPath(loop.tag, 'test'), {action: 'stop'});
    } catch (error) {
      toast(fill(texts.acting.refused, {why: error.message}));
    }
    await look();
  }}, t.stop);
  const node = el('div', {class: 'planned-test'}, progress, trouble, offer, stop);
  let offered = '';
  const look = async () => {
    try {
      const {plan, test} = await get(loopPath(loop.tag, 'test'), scope.signal), busy = UNDER_WAY.includes(test?.phase);
      progress.hidden = !test;
      if (test) setText(progress, busy ? fill(t.phases[test.phase], {time: duration(test.time_s), whole: duration(test.duration_s), who: test.by}) : resultOf(test));
      stop.hidden = !(test?.phase === 'moving' && operator());
      offer.hidden = busy || !plan;
      const key = plan?.id ?? '';
      if (key !== offered) {
        offered = key;
        const why = whyNot();
        offer.replaceChildren(!plan ? '' : why ? el('p', {class: 'soft small'}, why) : el('button', {type: 'button', click: () => read(loop, plan, look)}, t.carryOut));
      }
      trouble.hidden = true;
    } catch (error) {
      if (error.name === 'AbortError') return;
      trouble.hidden = false;
      setText(trouble, fill(texts.failed, {why: error.message}));
    }
  };
  scope.every(2000, look);
  return {node};
}
