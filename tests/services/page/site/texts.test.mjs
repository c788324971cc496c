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

test('values go where their names stand, and are not read as patterns', () => {
  assert.equal(fill('{tag}: {value} {unit}', {tag: '{value}', value: '$&'}), '{value}: $& {unit}');
});

// Tags, reasons and names are hostile; the policy forbids the rest anyway.
test('nothing is written as markup, and nothing is inline', () => {
  for (const [name, text] of sources) {
    assert.doesNotMatch(text, /innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function/, name);
    assert.doesNotMatch(text, /\bstyle: /, `${name}: a style attribute`);
  }
  const page = readFileSync(new URL('index.html', SITE), 'utf8');
  assert.doesNotMatch(page, / style=| on\w+=|<style|<script>/);
});

test('every file that is asked for is in the program', () => {
  const list = readFileSync(new URL('CMakeLists.txt', SITE), 'utf8');
  const files = ['', 'lib/', 'views/', 'style/'].flatMap((folder) => readdirSync(new URL(folder, SITE)).filter((name) => /\.(js|css|html|svg)$/.test(name)).map((name) => folder + name));
  for (const name of files) assert.ok(list.includes(name), `${name} is not in services/page/site/CMakeLists.txt`);
});

// Groups whose members are looked up by the daemon's names.
const BY_NAME = new Set(['roles', 'stale', 'modes', 'modesLong', 'faults', 'quality', 'ne107', 'alarms', 'causes', 'alarmStates', 'priority', 'flags', 'filters', 'sorts',
  'kinds', 'spans', 'conditions', 'verdicts', 'dialog', 'nav', 'guide', 'judged', 'valueNames', 'judges', 'changes', 'states', 'means']);

test('no text is left over', () => {
  const all = sources.map(([, text]) => text).join('\n');
  const walk = (object, path) => {
    for (const [key, value] of Object.entries(object)) {
      if (typeof value === 'object' && !Array.isArray(value)) walk(value, `${path}.${key}`);
      else if (!BY_NAME.has(path.split('.').at(-1))) assert.match(all, new RegExp(`\\.${key}\\b|'${key}'`), `${path}.${key} is used nowhere`);
    }
  };
  walk(texts, 'texts');
});

test('no text is missing', () => {
  for (const [name, source] of sources) {
    const short = {texts}; // what a module calls a group of texts
    for (const [, key, path] of source.matchAll(/^const (\w+) = texts\.(\w+);/gm)) short[key] = texts[path];
    for (const [whole, object, first, second] of source.matchAll(/(?<![\w./])(texts|tt|ta|t)\.(?!js\b)(\w+)(?:\.(\w+))?/g)) {
      const group = short[object]?.[first];
      if (!short[object]) continue;
      assert.notEqual(group, undefined, `${name}: ${whole}`);
      if (second && !Array.isArray(group) && typeof group === 'object') assert.notEqual(group[second], undefined, `${name}: ${whole}`);
    }
  }
});
