// Narrow pages: a table that is wider than the page shows each row as a block, with its headings; long names in titles break at points.
const NARROW = 600; // px

function stackWideTables() {
  for (const table of document.querySelectorAll(".md-typeset table:not([class])")) {
    delete table.dataset.stacked;
    const heads = [...table.querySelectorAll("thead th")].map((cell) => cell.textContent.trim());
    const wrapper = table.closest(".md-typeset__scrollwrap") ?? table.parentElement; // the theme scrolls tables sideways in it
    if (innerWidth > NARROW || !heads.length || wrapper.scrollWidth <= wrapper.clientWidth) continue;
    table.dataset.stacked = "";
    for (const row of table.tBodies[0].rows) [...row.cells].forEach((cell, i) => i && (cell.dataset.label = heads[i]));
  }
}

function breakNames() {
  for (const title of document.querySelectorAll(".md-typeset :is(h1, h2, h3, h4)")) {
    const texts = document.createTreeWalker(title, NodeFilter.SHOW_TEXT), found = [];
    while (texts.nextNode()) if (/[._]\w/.test(texts.currentNode.data)) found.push(texts.currentNode);
    for (const text of found) text.replaceWith(...text.data.split(/(?<=[._])(?=\w)/).flatMap((part, i) => (i ? [document.createElement("wbr"), part] : [part])));
  }
}

addEventListener("load", () => {
  breakNames();
  stackWideTables();
  addEventListener("resize", stackWideTables);
});
