// A running simulation: rows come from the server of this page, and commands are sent to it
// (cosim/report/live/server.py).
import { Run } from "./run.js";

const REST = 60; // ms between requests

/** A run that receives more rows while it is shown. */
export class GrowingRun extends Run {
  constructor({ name, units, columns, capacity }) {
    const table = new Map(columns.map((column) => [column, new Float32Array(capacity)]));
    super({ name, units, constants: {} }, table);
    Object.assign(this, { table, rows: 0 });
  }

  /** Append `count` rows, stored column by column in `values`. */
  append(values, count) {
    let place = 0;
    for (const column of this.table.values()) {
      column.set(values.subarray(place, place + count), this.rows);
      place += count;
    }
    this.rows += count;
    this.columns = new Map(
      [...this.table].map(([name, column]) => [name, column.subarray(0, this.rows)]),
    );
    this.time = this.columns.get("time");
    this.first = this.time[0];
    this.last = this.time[this.rows - 1];
  }
}

export class Live {
  constructor(about) {
    this.adjustable = about.adjustable;
    this.run = new GrowingRun(about);
    this.state = { version: -1, complete: false };
  }

  /** Fetch new rows and the state of the run; the server waits until there are any. */
  async look() {
    const response = await fetch(`rows?first=${this.run.rows}&version=${this.state.version}`);
    if (!response.ok) throw new Error(response.statusText);
    const bytes = new Uint8Array(await response.arrayBuffer());
    const end = bytes.indexOf(10);
    this.state = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
    if (this.state.count)
      this.run.append(new Float32Array(bytes.slice(end + 1).buffer), this.state.count);
  }

  async begin() {
    while (!this.run.rows) await this.look();
    return this.run;
  }

  /**
   * Fetch until the run ends and call `listener` after every response. The run has ended too if
   * the server is gone.
   */
  async follow(listener) {
    while (!this.state.complete) {
      await new Promise((resume) => setTimeout(resume, REST));
      try {
        await this.look();
      } catch {
        Object.assign(this.state, { ended: true, complete: true });
      }
      listener();
    }
  }

  /** Send a command and return the reply, with `error` if it was refused. */
  async command(message) {
    try {
      const headers = { "Content-Type": "application/json" };
      const response = await fetch("command", {
        method: "POST",
        headers,
        body: JSON.stringify(message),
      });
      return await response.json();
    } catch {
      return { error: "the run has ended" };
    }
  }
}
