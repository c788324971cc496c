// SPDX-License-Identifier: Apache-2.0
// Before the first paint: the theme that was chosen here, else the system's.
'use strict';
(() => {
  let wish = null;
  try {
    wish = localStorage.getItem('theme');
  } catch {
    // Storage may be closed to the page; then the system decides.
  }
  if (wish === 'dark' || wish === 'light') document.documentElement.dataset.theme = wish;
})();
