// SPDX-License-Identifier: Apache-2.0
// What this browser remembers of its reader. Storage may be closed to the page: then it lasts until he leaves.

const here = new Map();

export function recall(key) {
  try {
    return localStorage.getItem(key) ?? here.get(key) ?? null;
  } catch {
    return here.get(key) ?? null;
  }
}

export function remember(key, value) {
  here.set(key, value);
  try {
    if (value === null) localStorage.removeItem(key);
    else localStorage.setItem(key, value);
  } catch {
    // `here` has it.
  }
}
