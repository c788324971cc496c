// SPDX-License-Identifier: Apache-2.0
// The list: sort by a column, filter by words and by what to do. Without scripts it stands worst first.
(() => {
  const table = document.querySelector('table.loops'), body = table.tBodies[0], rows = [...body.rows];
  const words = document.querySelector('.filter input'), next = document.querySelector('.filter select');
  const shown = document.querySelector('.shown');
  const value = (row, k) => {
    const cell = row.cells[k], text = cell.dataset.v ?? cell.textContent.trim();
    const n = Number(text);
    return text === '' ? null : Number.isNaN(n) ? text.toLowerCase() : n;
  };
  [...table.tHead.rows[0].cells].forEach((head, k) => {
    head.querySelector('button')?.addEventListener('click', () => {
      const down = head.getAttribute('aria-sort') === 'ascending';
      for (const other of table.tHead.rows[0].cells) other.removeAttribute('aria-sort');
      head.setAttribute('aria-sort', down ? 'descending' : 'ascending');
      // What is not known stands last either way.
      rows.sort((a, b) => {
        const x = value(a, k), y = value(b, k);
        if (x === null || y === null) return (x === null) - (y === null);
        const order = typeof x === 'number' && typeof y === 'number' ? x - y : String(x).localeCompare(String(y));
        return down ? -order : order;
      });
      body.append(...rows);
    });
  });
  const filter = () => {
    const wanted = words.value.toLowerCase().split(/\s+/).filter(Boolean);
    let n = 0;
    for (const row of rows) {
      const text = row.textContent.toLowerCase();
      row.hidden = !(wanted.every((w) => text.includes(w)) && (next.value === '' || row.dataset.next === next.value));
      n += row.hidden ? 0 : 1;
    }
    shown.textContent = n === rows.length ? '' : `${n} of ${rows.length} shown`;
  };
  words.addEventListener('input', filter);
  next.addEventListener('change', filter);
})();
