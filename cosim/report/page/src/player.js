// The clock of the replay: the time that is shown, changed by the user or by playing.

const READING = 100; // ms between two updates of texts

export class Player {
  constructor(first, last) {
    Object.assign(this, {
      first,
      last,
      time: first,
      speed: 1,
      playing: false,
      listeners: [],
      readers: [],
      toldReaders: 0,
    });
  }

  /** True if the button shows that time advances. */
  get running() {
    return this.playing;
  }

  /** Call `listener` at every change. */
  onChange(listener) {
    this.listeners.push(listener);
  }

  /** Call `reader` at every change, but at most once per READING, and at the end of a change. */
  onReading(reader) {
    this.readers.push(reader);
  }

  tell() {
    for (const listener of this.listeners) listener(this);
    const now = performance.now();
    if (this.playing && now - this.toldReaders < READING) return;
    this.toldReaders = now;
    for (const reader of this.readers) reader(this);
  }

  seek(time) {
    this.time = Math.min(Math.max(time, this.first), this.last);
    this.tell();
  }

  toggle() {
    if (this.playing) {
      this.playing = false;
    } else {
      if (this.time >= this.last) this.time = this.first;
      this.playing = true;
    }
    this.tell();
  }

  /** Set the speed, a number as text. */
  setSpeed(speed) {
    this.speed = Number(speed);
    this.tell();
  }

  /** Advance by an elapsed wall time (s). */
  advance(seconds) {
    if (!this.playing) return;
    this.time = Math.min(this.time + Math.max(seconds, 0) * this.speed, this.last);
    if (this.time >= this.last) this.playing = false;
    this.tell();
  }
}

/**
 * The clock of a running simulation, which it pauses and speeds up; after its end the clock of
 * an ordinary replay.
 */
export class LivePlayer extends Player {
  /** `command` sends a message to the simulation. */
  constructor(live, command) {
    super(live.run.first, live.run.last);
    Object.assign(this, { live, command });
  }

  get running() {
    return this.live.state.ended ? this.playing : !this.live.state.paused;
  }

  toggle() {
    if (this.live.state.ended) super.toggle();
    else this.command({ command: this.running ? "pause" : "resume" });
  }

  /** Set the speed, a number as text, or "" for as fast as possible. */
  setSpeed(speed) {
    if (this.live.state.ended) super.setSpeed(speed);
    else this.command({ command: "speed", factor: speed ? Number(speed) : null });
  }

  /** Extend the replay to the time `last`; a replay at its end stays at the end. */
  grow(last) {
    if (this.time >= this.last) this.time = last;
    this.last = last;
    this.tell();
  }
}
