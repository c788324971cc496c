// SPDX-License-Identifier: Apache-2.0
// Title and icon of the browser's tab: number of waiting alarms, and whether values are missing. Pure.
import {texts} from '../texts.js';

export function tabTitle(text, waiting, stale) {
  const before = stale ? `${texts.stale.title}: ` : waiting ? `(${waiting}) ` : '';
  return `${before}${text} – ${texts.brand}`;
}

const VALVE = '<rect width="32" height="32" rx="6" fill="#1d2227"/><path d="M5 13v14l11-7zM27 13v14l-11-7z" fill="none" stroke="#dfe3e6" stroke-width="2.4" stroke-linejoin="round"/>';
const MARKS = {high: ['#f2564b', '#14171a'], low: ['#efb83f', '#14171a'], stale: ['#dfe3e6', '#14171a']};

// Returns an address for <link rel=icon>: the valve with the number on it, a cross if no values arrive.
export function tabIcon(waiting, grave, stale) {
  if (!waiting && !stale) return '/icon.svg';
  const [ground, ink] = MARKS[stale ? 'stale' : grave], text = stale ? '×' : waiting > 9 ? '9+' : String(waiting);
  const mark = `<circle cx="20" cy="12" r="12" fill="${ground}"/><text x="20" y="18" text-anchor="middle" font-family="sans-serif" font-weight="700" font-size="${text.length > 1 ? 14 : 18}" fill="${ink}">${text}</text>`;
  return `data:image/svg+xml,${encodeURIComponent(`<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32">${VALVE}${mark}</svg>`)}`;
}
