// The clock of the replay: one moment that everything shows, moved by the user or by playing.

export class Player {
  constructor(first, last) {
    Object.assign(this, { first, last, time: first, speed: 1, playing: false, listeners: [] });
  }

  onChange(listener) {
    this.listeners.push(listener);
  }

  tell() {
    for (const listener of this.listeners) listener(this);
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
