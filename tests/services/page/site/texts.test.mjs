// SPDX-License-Identifier: Apache-2.0
import assert from 'node:assert/strict';
import test from 'node:test';
import {readFileSync, readdirSync} from 'node:fs';
import {ALARM_KINDS, ALARM_STATES, CONDITIONS, FAULTS, MODES, NE107} from '../../../../services/page/site/lib/codes.js';
import {fill, texts} from '../../../../services/page/site/texts.js';

const SITE = new URL('../../../../services/page/site/', import.meta.url);
const sources = ['', 'lib/', 'views/'].flatMap((folder) => readdirSync(new URL(folder, SITE)).filter((name) => name.endsWith('.js') && name !== 'texts.js')
  .map((name) => [folder + name, readFileSync(new URL(folder + name, SITE), 'utf8')]));

test('every name of the daemon has a text', () => {
  for (const name of ALARM_KINDS) assert.ok(texts.alarms[name], name);
  for (const name of ALARM_STATES) assert.ok(texts.alarmStates[name], name);
  for (const name of FAULTS) assert.ok(texts.faults[name], name);
  for (const name of MODES) assert.ok(texts.modes[name] && texts.modesLong[name], name);
  for (const name of NE107) assert.equal(texts.ne107[name].length, 2, name);
  for (const name of CONDITIONS) assert.equal(texts.conditions[name].length, 3, name);
});

test('values replace their names, and are not read as patterns', () => {
  assert.equal(fill('{tag}: {value} {unit}', {tag: '{value}', value: '$&'}), '{value}: $& {unit}');
});

// Tags, reasons and names can be hostile. The page's policy forbids other scripts and styles.
test('the page writes no markup and has no inline scripts or styles', () => {
  for (const [name, text] of sources) {
    assert.doesNotMatch(text, /innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function/, name);
    assert.doesNotMatch(text, /\bstyle: /, `${name}: a style attribute`);
  }
  const page = readFileSync(new URL('index.html', SITE), 'utf8');
  assert.doesNotMatch(page, / style=| on\w+=|<style|<script>/);
});

test('every requested file is in the program', () => {
  const list = readFileSync(new URL('CMakeLists.txt', SITE), 'utf8');
  const files = ['', 'lib/', 'views/', 'style/'].flatMap((folder) => readdirSync(new URL(folder, SITE)).filter((name) => /\.(js|css|html|svg)$/.test(name)).map((name) => folder + name));
  for (const name of files) assert.ok(list.includes(name), `${name} is not in services/page/site/CMakeLists.txt`);
});

// Groups with members that are looked up by names from the daemon. The page lists these names or
// accepts any name.
const BY_NAME = new Set(['roles', 'stale', 'modes', 'modesLong', 'faults', 'quality', 'ne107', 'acts', 'alarms', 'causes', 'alarmStates', 'haste', 'priorities', 'filters', 'sorts', 'kinds', 'spans',
  'conditions', 'verdicts', 'judged', 'moves', 'phases', 'valueNames', 'changes', 'states', 'judges', 'rules', 'means']);

// Returns the paths of texts used in a source, as "texts.a.b" or by its name for a group. A group
// used with brackets ends in "[".
function namedIn(source) {
  const short = [['texts', '']], found = new Set();
  for (const [, name, path] of source.matchAll(/\b(\w+) = texts((?:\.\w+)+)(?=[,;])/g)) short.push([name, path]);
  for (const [, name, rest, looked] of source.matchAll(/(?<![\w.])(\w+)((?:\??\.\w+)+)(\[)?/g)) {
    for (const [, path] of short.filter(([one]) => one === name)) found.add(`${path}${rest.replaceAll('?', '')}${looked ?? ''}`);
  }
  for (const [, name] of source.matchAll(/(?<![\w.])(\w+)\[/g)) for (const [, path] of short.filter(([one]) => one === name)) found.add(`${path}[`);
  return found;
}

// Returns whether a name is used as a key: in quotes, or in an object.
const quoted = (all, key) => new RegExp(`['\`]${key}['\`]|\\b${key}:`).test(all);

function leftOver(object, modules) {
  const all = modules.join('\n'), found = new Set(modules.flatMap((source) => [...namedIn(source)])), left = [];
  const used = (path) => [...found].some((one) => one === path || one.startsWith(`${path}.`) || one.startsWith(`${path}[`));
  const walk = (group, path) => {
    for (const [key, value] of Object.entries(group)) {
      const here = `${path}.${key}`, looked = found.has(`${path}[`) && quoted(all, key);
      if (typeof value === 'object' && !Array.isArray(value)) {
        if (!used(here) && !looked) left.push(here);
        else if (!BY_NAME.has(key)) walk(value, here);
      } else if (!used(here) && !looked) left.push(here);
    }
  };
  walk(object, '');
  return left;
}

test('every text is used', () => {
  assert.deepEqual(leftOver(texts, [...sources.map(([, text]) => text), readFileSync(new URL('texts.js', SITE), 'utf8').split('export const texts')[1]]), []);
});

test('a text counts as unused if only another text of the same name, or other names of its group, are used', () => {
  const mine = {a: {title: '1', up: '2', down: '3'}, b: {title: '4'}};
  assert.deepEqual(leftOver(mine, ["const t = texts.a;\nt.title; t[name];\nconst names = ['up'];"]), ['.a.down', '.b']);
  assert.deepEqual(leftOver(mine, ["const t = texts.a, u = texts.b;\nt.title + t.up + t.down + u.title"]), []);
});

test('every used text exists', () => {
  for (const [name, source] of sources) {
    const short = {texts}; // a module's names for groups of texts
    for (const [, key, path] of source.matchAll(/^const (\w+) = texts\.(\w+);/gm)) short[key] = texts[path];
    for (const [whole, object, first, second] of source.matchAll(/(?<![\w./])(texts|tt|ta|t)\.(?!js\b)(\w+)(?:\.(\w+))?/g)) {
      const group = short[object]?.[first];
      if (!short[object]) continue;
      assert.notEqual(group, undefined, `${name}: ${whole}`);
      if (second && !Array.isArray(group) && typeof group === 'object') assert.notEqual(group[second], undefined, `${name}: ${whole}`);
    }
  }
});
