// A recorded run in the browser: its columns, and the poses of bodies at any time.
import { Quaternion, Vector3, Euler } from "three";

/** Decompress a zlib stream in base64. */
async function inflated(base64) {
  const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/**
 * Decode a column of `cosim/report/replay.py`: bytes of equal weight are grouped, and each row
 * is the difference from the last.
 */
function column(bytes, rows, index) {
  const words = new Int32Array(rows);
  const start = 4 * rows * index;
  let word = 0;
  for (let i = 0; i < rows; i++) {
    const at = start + i;
    word =
      (word +
        (bytes[at] |
          (bytes[at + rows] << 8) |
          (bytes[at + 2 * rows] << 16) |
          (bytes[at + 3 * rows] << 24))) |
      0;
    words[i] = word;
  }
  return new Float32Array(words.buffer);
}

export class Run {
  constructor(about, columns) {
    Object.assign(this, {
      name: about.name,
      units: about.units,
      constants: about.constants,
      columns,
    });
    this.time = columns.get("time");
    this.first = this.time[0];
    this.last = this.time[this.time.length - 1];
  }

  static async decoded(about) {
    const bytes = await inflated(about.samples);
    return new Run(
      about,
      new Map(about.columns.map((name, i) => [name, column(bytes, about.rows, i)])),
    );
  }

  /** Names of all signals, in recorded order. */
  get signals() {
    return Object.keys(this.units);
  }

  has(name) {
    if (typeof name === "number") return true;
    const signal = name.replace(/^-/, "");
    return this.columns.has(signal) || signal in this.constants;
  }

  /** The row at or before a time, and the fraction of the interval to the next row. */
  place(time) {
    let low = 0;
    let high = this.time.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.time[middle] <= time) low = middle;
      else high = middle - 1;
    }
    const next = Math.min(low + 1, this.time.length - 1);
    const step = this.time[next] - this.time[low];
    return {
      row: low,
      next,
      share: step > 0 ? Math.min(Math.max((time - this.time[low]) / step, 0), 1) : 0,
    };
  }

  /** Value in a row of a signal, of its negative ("-signal"), or of a constant number. */
  at(name, row) {
    if (typeof name === "number") return name;
    if (name.startsWith("-")) return -this.at(name.slice(1), row);
    const values = this.columns.get(name);
    return values ? values[row] : this.constants[name];
  }

  /** Value of a signal at a time: that of the row at or before it. */
  value(name, time) {
    return this.at(name, this.place(time).row);
  }

  values(name) {
    return this.columns.get(name) ?? new Float32Array(this.time.length).fill(this.constants[name]);
  }

  knows(body) {
    return [...body.position, ...(body.orientation ?? body.attitude)].every((name) =>
      this.has(name),
    );
  }

  position(body, row) {
    return new Vector3(...body.position.map((name) => this.at(name, row)));
  }

  orientation(body, row) {
    if (body.orientation) {
      const [w, x, y, z] = body.orientation.map((name) => this.at(name, row));
      return new Quaternion(x, y, z, w).normalize();
    }
    const [roll, pitch, yaw] = body.attitude.map((name) => this.at(name, row));
    return new Quaternion().setFromEuler(new Euler(roll, pitch, yaw, "ZYX"));
  }

  /** Pose of a body between two rows. */
  pose(body, time) {
    const { row, next, share } = this.place(time);
    return {
      position: this.position(body, row).lerp(this.position(body, next), share),
      orientation: this.orientation(body, row).slerp(this.orientation(body, next), share),
    };
  }

  /** Intervals of time [first, last] in which a Boolean signal is true. */
  spans(name) {
    const values = this.values(name);
    const spans = [];
    for (let i = 0; i < values.length; i++) {
      if (!values[i]) continue;
      const first = i;
      while (i + 1 < values.length && values[i + 1]) i++;
      spans.push([this.time[first], this.time[i]]);
    }
    return spans;
  }
}
