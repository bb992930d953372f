// Marks: moments at which a Boolean signal first becomes true, such as a crash, and the moment of a
// failure.
import { label } from "./markers.js";

/** The marks of a scene that a run has reached: {time, label, colour, on}. */
export function marksOf(run, marks) {
  return marks.flatMap((mark) => {
    if (mark.time !== undefined) return [mark];
    if (!run.has(mark.signal)) return [];
    const row = run.values(mark.signal).findIndex(Boolean);
    return row < 0 ? [] : [{ ...mark, row, time: run.time[row] }];
  });
}

/** A cross at the place of a marked body, visible from the moment of the mark on. */
export class Cross {
  constructor(mark, position) {
    this.time = mark.time;
    this.object = label("×", mark.colour);
    this.object.position.copy(position);
  }

  update(time) {
    this.object.visible = time >= this.time;
  }

  dispose() {
    this.object.material.map.dispose();
    this.object.material.dispose();
  }
}
