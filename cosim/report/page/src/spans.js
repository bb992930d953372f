// Intervals and marks along the time slider, and a legend of them.
import { marksOf } from "./marks.js";

/**
 * Intervals in which Boolean signals are true, and marks, along the time slider; a legend names
 * those that are there.
 */
export function showSpans(page, run, { spans, marks }) {
  const length = run.last - run.first || 1;
  page.spans.replaceChildren();
  showLegend(page.legend, [
    ...spans
      .filter(({ signal }) => run.has(signal) && run.spans(signal).length)
      .map((span) => ({ ...span, sign: "" })),
    ...marksOf(run, marks).map((mark) => ({ ...mark, sign: "×" })),
  ]);
  for (const { signal, label, colour } of spans.filter(({ signal }) => run.has(signal))) {
    for (const [first, last] of run.spans(signal)) {
      const mark = page.spans.appendChild(document.createElement("i"));
      mark.title = `${label} ${first.toFixed(2)} to ${last.toFixed(2)} s`;
      const [left, width] = [first - run.first, last - first].map((time) => (100 * time) / length);
      mark.style.cssText = `left:${left}%;width:${width}%;background:${colour}`;
    }
  }
  for (const { time, label, colour } of marksOf(run, marks)) {
    const mark = page.spans.appendChild(document.createElement("b"));
    mark.textContent = "×";
    mark.title = `${label} at ${time.toFixed(2)} s`;
    mark.style.cssText = `left:${(100 * (time - run.first)) / length}%;background:${colour}`;
  }
}

function showLegend(legend, entries) {
  legend.replaceChildren(...(entries.length ? ["On the slider:"] : []));
  for (const { sign, label, colour } of entries) {
    const key = document.createElement(sign ? "b" : "i");
    key.textContent = sign;
    key.style.background = colour;
    const entry = legend.appendChild(document.createElement("span"));
    entry.append(key, label);
  }
}
