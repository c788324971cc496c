// SPDX-License-Identifier: Apache-2.0
// Stores settings of this browser's user. If storage is closed to the page, they last until the page is left.

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
    // Finds whether `here` has the key.
  }
}
