// Names in titles and tables break only at points, underscores, slashes and colons. On narrow pages
// a table that is wider than the page shows each row as a block, with its headings.
const NARROW = 600; // px
const BREAK = /(?<=[._/:])(?=[A-Za-z])/;

function stackWideTables() {
  for (const table of document.querySelectorAll(".md-typeset table:not([class])")) {
    delete table.dataset.stacked;
    const heads = [...table.querySelectorAll("thead th")].map((cell) => cell.textContent.trim());
    // the theme scrolls tables sideways in it
    const wrapper = table.closest(".md-typeset__scrollwrap") ?? table.parentElement;
    if (innerWidth > NARROW || !heads.length || wrapper.scrollWidth <= wrapper.clientWidth)
      continue;
    table.dataset.stacked = "";
    for (const row of table.tBodies[0].rows)
      [...row.cells].forEach((cell, i) => i && (cell.dataset.label = heads[i]));
  }
}

function breakNames() {
  for (const element of document.querySelectorAll(".md-typeset :is(h1, h2, h3, h4, td code)")) {
    const texts = document.createTreeWalker(element, NodeFilter.SHOW_TEXT),
      found = [];
    while (texts.nextNode()) if (BREAK.test(texts.currentNode.data)) found.push(texts.currentNode);
    for (const text of found)
      text.replaceWith(
        ...text.data
          .split(BREAK)
          .flatMap((part, i) => (i ? [document.createElement("wbr"), part] : [part])),
      );
  }
}

addEventListener("load", () => {
  breakNames();
  stackWideTables();
  addEventListener("resize", stackWideTables);
});
