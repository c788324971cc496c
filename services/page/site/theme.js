// SPDX-License-Identifier: Apache-2.0
// Sets the theme before the first paint: the one chosen in this browser, otherwise the system's.
'use strict';
(() => {
  let wish = null;
  try {
    wish = localStorage.getItem('theme');
  } catch {
    // If storage is closed to the page, the system decides.
  }
  if (wish === 'dark' || wish === 'light') document.documentElement.dataset.theme = wish;
})();
