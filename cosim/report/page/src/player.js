// The clock of the replay: one moment that everything shows, moved by the user or by playing.

const READING = 100; // ms

export class Player {
  constructor(first, last) {
    Object.assign(this, { first, last, time: first, speed: 1, playing: false, listeners: [], readers: [], toldReaders: 0 });
  }

  /** Call `listener` at every change. */
  onChange(listener) {
    this.listeners.push(listener);
  }

  /** Call `reader` as often as people can read, and at the end of every change. */
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

  /** There is more to see, until `last`; who stands at the end stays there. */
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

  /** Let wall time (s) pass. */
  advance(seconds) {
    if (!this.playing) return;
    this.time = Math.min(this.time + Math.max(seconds, 0) * this.speed, this.last);
    if (this.time >= this.last) this.playing = false;
    this.tell();
  }
}
