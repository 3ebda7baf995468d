"use strict";
// What both pages do: jump into closed details, open them for paper, copy text, sort tables.

function openAround(id) {
  const target = id && document.getElementById(decodeURIComponent(id));
  for (let node = target; node; node = node.parentElement) if (node.tagName === "DETAILS") node.open = true;
  return target;
}

function follow() {
  const target = openAround(location.hash.slice(1));
  if (target) target.scrollIntoView({ block: "center" });
}

addEventListener("hashchange", follow);
addEventListener("DOMContentLoaded", follow);
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((d) => (d.open = true)));

async function copyFrom(area, note) {
  try {
    await navigator.clipboard.writeText(area.value);
  } catch {
    // A page opened as a file may not use the clipboard in every browser.
    openAround(area.id);
    area.select();
    document.execCommand("copy");
  }
  note.textContent = "copied";
  setTimeout(() => (note.textContent = ""), 4000);
}

function valueOf(row, column) {
  const cell = row.cells[column];
  const key = cell.dataset.sort ?? cell.textContent.trim();
  const number = Number(key);
  return key !== "" && !Number.isNaN(number) ? number : key.toLowerCase();
}

function sortBy(table, column, ascending) {
  const sign = ascending ? 1 : -1;
  const rows = [...table.tBodies[0].rows];
  rows.sort((a, b) => {
    const [x, y] = [valueOf(a, column), valueOf(b, column)];
    if (typeof x !== typeof y) return typeof x === "number" ? -sign : sign;
    return x < y ? -sign : x > y ? sign : 0;
  });
  table.tBodies[0].append(...rows);
  [...table.tHead.rows[0].cells].forEach((head, i) => {
    if (i === column) head.setAttribute("aria-sort", ascending ? "ascending" : "descending");
    else head.removeAttribute("aria-sort");
  });
}
