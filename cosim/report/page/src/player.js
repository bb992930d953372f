// The clock of the replay: the time that is shown, changed by the user or by playing.

const READING = 100; // ms between two updates of texts

export class Player {
  constructor(first, last) {
    Object.assign(this, { first, last, time: first, speed: 1, playing: false, listeners: [], readers: [], toldReaders: 0 });
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

  /** Extend the replay to the time `last`; a replay at its end stays at the end. */
  grow(last) {
    if (last === this.last) return;
    if (this.time >= this.last) this.time = last;
    this.last = last;
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

  setSpeed(speed) {
    this.speed = speed;
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
