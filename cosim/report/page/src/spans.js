// Intervals and marks along the time slider.
import { marksOf } from "./marks.js";

/** Intervals in which Boolean signals are true, and marks, along the time slider. */
export function showSpans(page, run, { spans, marks }) {
  const length = run.last - run.first || 1;
  page.spans.replaceChildren();
  for (const { signal, label, colour } of spans.filter(({ signal }) => run.has(signal))) {
    for (const [first, last] of run.spans(signal)) {
      const mark = page.spans.appendChild(document.createElement("i"));
      mark.title = `${label} ${first.toFixed(2)} to ${last.toFixed(2)} s`;
      mark.style.cssText = `left:${(100 * (first - run.first)) / length}%;width:${(100 * (last - first)) / length}%;background:${colour}`;
    }
  }
  for (const { time, label, colour } of marksOf(run, marks)) {
    const mark = page.spans.appendChild(document.createElement("b"));
    mark.textContent = "×";
    mark.title = `${label} at ${time.toFixed(2)} s`;
    mark.style.cssText = `left:${(100 * (time - run.first)) / length}%;background:${colour}`;
  }
}
