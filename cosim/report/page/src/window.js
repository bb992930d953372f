// The part of the time axis that the plots show, and how the pointer changes it.

const CLICK = 4; // pixels: shorter movements of the pointer are clicks

/**
 * The interval [low, high] moved into [first, last], and not longer than that; null if it is all
 * of it.
 */
export function within([low, high], [first, last]) {
  const length = Math.min(high - low, last - first);
  const begin = Math.min(Math.max(low, first), last - length);
  return length < last - first ? [begin, begin + length] : null;
}

/** The interval scaled by a factor around a time. */
export function scaled([low, high], factor, around) {
  return [around - (around - low) * factor, around + (high - around) * factor];
}

/**
 * Let the pointer change the time and the window of a plot. Press: the time; drag: zoom to what was
 * passed over; drag with Shift, or turn the wheel sideways: pan; turn the wheel with Ctrl: zoom;
 * double-click: show all.
 */
export function connectPointer(chart, plots) {
  const { over } = chart;
  const place = (event) => event.clientX - over.getBoundingClientRect().left;
  const time = (at) => chart.posToVal(at, "x");
  let start = null;
  over.addEventListener("pointerdown", (event) => {
    if (event.button) return;
    over.setPointerCapture(event.pointerId);
    start = { at: place(event), window: plots.present, pan: event.shiftKey };
  });
  over.addEventListener("pointermove", (event) => {
    if (!start || Math.abs(place(event) - start.at) < CLICK) return;
    const [left, right] = [start.at, place(event)].sort((a, b) => a - b);
    if (start.pan)
      plots.look(
        shifted(
          start.window,
          ((start.at - place(event)) / over.clientWidth) * (start.window[1] - start.window[0]),
        ),
      );
    else chart.setSelect({ left, width: right - left, top: 0, height: over.clientHeight }, false);
  });
  over.addEventListener("pointerup", (event) => {
    if (!start) return;
    const [left, right] = [start.at, place(event)].sort((a, b) => a - b);
    const { pan } = start;
    start = null;
    chart.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
    if (right - left < CLICK) plots.seek(time(left));
    else if (!pan) plots.look([time(left), time(right)]);
  });
  over.addEventListener("pointercancel", () => (start = null));
  over.addEventListener("dblclick", () => plots.look(null));
  over.addEventListener(
    "wheel",
    (event) => {
      const window = plots.present;
      if (event.ctrlKey)
        plots.look(scaled(window, Math.exp(0.002 * event.deltaY), time(place(event))));
      else if (event.deltaX)
        plots.look(shifted(window, (event.deltaX / over.clientWidth) * (window[1] - window[0])));
      else return;
      event.preventDefault();
    },
    { passive: false },
  );
}

export const shifted = ([low, high], by) => [low + by, high + by];
