"use strict";

addEventListener("DOMContentLoaded", () => {
  for (const button of document.querySelectorAll("th button")) {
    const head = button.closest("th");
    const table = head.closest("table");
    button.addEventListener("click", () => sortBy(table, head.cellIndex, head.getAttribute("aria-sort") !== "ascending"));
  }
});
