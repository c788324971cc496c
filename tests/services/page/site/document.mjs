// SPDX-License-Identifier: Apache-2.0
// The part of a document that the page's modules need, without a browser.

export class Node extends EventTarget {
  attributes = {};
  children = [];
  dataset = {};
  clientWidth = 100;
  constructor(name) { super(); this.name = name; }
  setAttribute(name, value) { this.attributes[name] = value; }
  getAttribute(name) { return this.attributes[name] ?? null; }
  hasAttribute(name) { return name in this.attributes; }
  removeAttribute(name) { delete this.attributes[name]; }
  append(...nodes) { this.children.push(...nodes); }
  replaceChildren(...nodes) { this.children = nodes; }
}

Object.assign(globalThis, {
  devicePixelRatio: 1,
  getComputedStyle: () => ({getPropertyValue: (name) => `the colour ${name}`}),
  document: Object.assign(new EventTarget(), {hidden: false, documentElement: new Node('html'), createElement: (name) => new Node(name), createElementNS: (_, name) => new Node(name)}),
});
