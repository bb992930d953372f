// Signals over time, with a cursor at the time of the replay; see window.js for the pointer.
import uPlot from "uplot";
import { marksOf } from "./marks.js";
import { theme } from "./theme.js";
import { connectPointer, scaled, shifted, within } from "./window.js";

const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
const HEIGHT = 162;

/** Four significant digits, without an exponent if that is short. */
export const shown = (value) =>
  Number.isFinite(value) ? String(Number(value.toPrecision(4))) : "–";

/** Tick labels with all digits; all have exponents if that is shorter. */
function written(_, values) {
  const plain = values.map(String);
  const powers = values.map((value) => (value ? value.toExponential() : "0"));
  return longest(plain) > 8 && longest(powers) < longest(plain) ? powers : plain;
}

const longest = (texts) => Math.max(...texts.map((text) => text.length));

const FONT = "11px system-ui, sans-serif";
const AXIS = {
  stroke: () => theme().ink,
  grid: { stroke: () => theme().rule, width: 1 },
  ticks: { show: false },
  values: written,
  font: FONT,
  labelFont: FONT,
  labelSize: 14,
  labelGap: 0,
};

/** The axes of time and of values with a unit, "" without a label. */
function axes(unit) {
  return [
    { ...AXIS, size: 24, space: 70, label: "time (s)" },
    { ...AXIS, size: room, space: 28, label: unit },
  ];
}

const JUMP = 5; // rad: larger differences of successive angles are turns

/** Angles without the jumps by whole turns of those that are kept between two limits. */
function unwrapped(angles) {
  const values = Float32Array.from(angles);
  let turns = 0;
  for (let i = 1; i < values.length; i++) {
    const step = angles[i] - angles[i - 1];
    if (Math.abs(step) > JUMP) turns += Math.round(step / (2 * Math.PI));
    values[i] -= 2 * Math.PI * turns;
  }
  return values;
}

/** The values of a signal as drawn. */
function valuesOf(run, name) {
  return run.units[name] === "rad" ? unwrapped(run.values(name)) : run.values(name);
}

/**
 * The width of an axis: equal in all plots with short tick labels, so that their time axes are
 * aligned.
 */
function room(chart, texts, number) {
  [chart.ctx.font] = chart.axes[number].font;
  const widest = Math.max(
    0,
    ...(texts ?? []).map((text) => chart.ctx.measureText(text).width / uPlot.pxRatio),
  );
  return Math.max(54, widest + 12);
}

class Plot {
  constructor(parent, signals, runs, plots) {
    Object.assign(this, { signals, runs, plots, player: plots.player, marks: plots.marks });
    this.element = parent.appendChild(document.createElement("figure"));
    this.element.className = "plot";
    this.legend = this.element.appendChild(document.createElement("figcaption"));
    this.values = signals.map((name, i) => this.#entry(name, COLOURS[i % COLOURS.length]));
    const close = this.legend.appendChild(document.createElement("button"));
    Object.assign(close, {
      type: "button",
      className: "close",
      textContent: "×",
      title: "Remove this plot",
      ariaLabel: "Remove this plot",
    });
    close.addEventListener("click", () => plots.remove(this));
    this.#draw();
  }

  #entry(name, colour) {
    const entry = this.legend.appendChild(document.createElement("span"));
    const key = entry.appendChild(document.createElement("i"));
    key.style.background = colour;
    entry.append(name);
    const value = entry.appendChild(document.createElement("b"));
    return { name, value };
  }

  #series() {
    return this.signals.flatMap((name, i) =>
      this.runs
        .filter((run) => run.has(name))
        .map((run) => ({
          run,
          name,
          label: name,
          stroke: COLOURS[i % COLOURS.length],
          width: run === this.runs[0] ? 1.6 : 1.3,
          dash: run === this.runs[0] ? undefined : [5, 4],
          points: { show: false },
        })),
    );
  }

  #draw() {
    const series = this.#series();
    const sorted = this.runs
      .flatMap((run) => series.filter((s) => s.run === run))
      .map((s) => ({ ...s, spanGaps: true }));
    const unit = this.runs[0].units[this.signals[0]] ?? "";
    const options = {
      width: Math.max(this.element.clientWidth, 120),
      height: HEIGHT,
      legend: { show: false },
      padding: [8, 10, 0, 0],
      scales: {
        x: { time: false, range: () => this.plots.present },
        y: { range: (_, low, high) => padded(low, high) },
      },
      axes: axes(unit),
      series: [{}, ...sorted],
      hooks: { draw: [() => (this.#mark(), this.move())] },
      cursor: {
        drag: { x: false, y: false, setScale: false },
        points: { show: false },
        y: false,
        x: false,
      },
    };
    this.chart = new uPlot(options, this.#data(series), this.element);
    this.element.dataset.unit = unit;
    this.line = this.chart.over.appendChild(document.createElement("div"));
    this.line.className = "now";
    connectPointer(this.chart, this.plots);
    this.read();
  }

  /** Draw a line at each mark. */
  #mark() {
    for (const line of this.chart.over.querySelectorAll(".mark")) line.remove();
    for (const { time, label, colour } of marksOf(this.runs[0], this.marks)) {
      const line = this.chart.over.appendChild(document.createElement("div"));
      line.className = "mark";
      line.title = `${label} at ${time.toFixed(2)} s`;
      const x = this.chart.valToPos(time, "x");
      line.style.cssText = `border-color:${colour};transform:translateX(${x}px)`;
    }
  }

  #data(series) {
    this.drawn = series.map(({ run, name }) => ({ run, name, values: valuesOf(run, name) }));
    const tables = this.runs.map((run) => [
      run.time,
      ...this.drawn.filter((each) => each.run === run).map(({ values }) => values),
    ]);
    return tables.length === 1 ? tables[0] : uPlot.join(tables.filter((table) => table.length > 1));
  }

  /** Update after the runs have received more rows. */
  grow() {
    this.chart.setData(this.#data(this.#series()));
    this.read();
  }

  move() {
    this.line.style.transform = `translateX(${this.chart.valToPos(this.player.time, "x")}px)`;
  }

  read() {
    const unit = this.element.dataset.unit;
    for (const { name, value } of this.values) {
      const drawn = this.drawn.filter((each) => each.name === name);
      const texts = drawn.map(({ run, values }) => shown(values[run.place(this.player.time).row]));
      value.textContent = `${texts.join(" | ")} ${this.runs[0].units[name] ?? unit}`;
    }
  }

  resize() {
    this.chart.setSize({ width: Math.max(this.element.clientWidth, 120), height: HEIGHT });
    this.look();
  }

  /** Show the window of all plots. */
  look() {
    const [min, max] = this.plots.present;
    this.chart.setScale("x", { min, max });
  }
}

function padded(low, high) {
  if (low == null || high == null) return [0, 1];
  const room = high > low ? 0.07 * (high - low) : Math.max(1e-3, 0.1 * Math.abs(high));
  return [low - room, high + room];
}

export class Plots {
  constructor(parent, runs, player, marks) {
    Object.assign(this, { parent, runs, player, marks, list: [], window: null });
    this.seek = (time) => player.seek(time);
    this.look = this.look.bind(this);
    new ResizeObserver(() => this.list.forEach((plot) => plot.resize())).observe(parent);
    player.onChange(() => this.list.forEach((plot) => plot.move()));
    player.onReading(() => this.list.forEach((plot) => plot.read()));
  }

  get present() {
    return this.window ?? [this.player.first, this.player.last];
  }

  /** Show an interval of time in all plots, or null for all. */
  look(window) {
    const least = 1e-3 * (this.player.last - this.player.first);
    if (window && window[1] - window[0] < least) return;
    this.window = window && within(window, [this.player.first, this.player.last]);
    this.list.forEach((plot) => plot.look());
  }

  /** Scale the interval by a factor, around the time of the replay if that is in it. */
  zoom(factor) {
    const [low, high] = this.present;
    const { time } = this.player;
    this.look(scaled([low, high], factor, time >= low && time <= high ? time : (low + high) / 2));
  }

  /** Move the interval by a share of its length. */
  pan(share) {
    const [low, high] = this.present;
    this.look(shifted([low, high], share * (high - low)));
  }

  /**
   * Add a plot of the signals that match any of the patterns ("*" matches any text); return
   * false if there are none.
   */
  add(patterns) {
    const tests = patterns.map(
      (pattern) =>
        new RegExp(
          `^${pattern
            .split("*")
            .map((s) => s.replace(/[.[\]()+?^$|{}\\]/g, "\\$&"))
            .join(".*")}$`,
        ),
    );
    const signals = this.runs[0].signals.filter((name) => tests.some((test) => test.test(name)));
    if (!signals.length) return false;
    this.list.push(new Plot(this.parent, signals.slice(0, 12), this.runs, this));
    return true;
  }

  remove(plot) {
    plot.chart.destroy();
    plot.element.remove();
    this.list.splice(this.list.indexOf(plot), 1);
  }

  grow() {
    this.list.forEach((plot) => plot.grow());
  }

  recolour() {
    this.list.forEach((plot) => plot.chart.redraw(false));
  }
}
