// Signals over time, with a cursor at the time of the replay; press or drag in a plot to change it.
import uPlot from "uplot";
import { marksOf } from "./marks.js";
import { theme } from "./theme.js";

const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
const HEIGHT = 148;

/** Four significant digits, without an exponent if that is short. */
export const shown = (value) => (Number.isFinite(value) ? String(Number(value.toPrecision(4))) : "–");

/** Tick labels with all digits; all have exponents if that is shorter. */
function written(_, values) {
  const plain = values.map(String);
  const powers = values.map((value) => (value ? value.toExponential() : "0"));
  return longest(plain) > 8 && longest(powers) < longest(plain) ? powers : plain;
}

const longest = (texts) => Math.max(...texts.map((text) => text.length));

function axis(unit) {
  const { ink, rule } = theme();
  const lines = { stroke: ink, grid: { stroke: rule, width: 1 }, ticks: { show: false } };
  const style = { ...lines, font: "11px system-ui, sans-serif", values: written };
  return unit === undefined ? { ...style, size: 26, space: 70 } : { ...style, size: room, space: 28 };
}

/** The width of an axis: equal in all plots with short tick labels, so that their time axes are aligned. */
function room(chart, texts, number) {
  [chart.ctx.font] = chart.axes[number].font;
  const widest = Math.max(0, ...(texts ?? []).map((text) => chart.ctx.measureText(text).width / uPlot.pxRatio));
  return Math.max(54, widest + 12);
}

class Plot {
  constructor(parent, signals, runs, player, marks, remove) {
    Object.assign(this, { signals, runs, player, marks });
    this.element = parent.appendChild(document.createElement("figure"));
    this.element.className = "plot";
    this.legend = this.element.appendChild(document.createElement("figcaption"));
    this.values = signals.map((name, i) => this.#entry(name, COLOURS[i % COLOURS.length]));
    const close = this.legend.appendChild(document.createElement("button"));
    Object.assign(close, { type: "button", className: "close", textContent: "×", title: "Remove this plot", onclick: () => remove(this) });
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
      this.runs.filter((run) => run.has(name)).map((run) => ({
        run, name,
        label: name, stroke: COLOURS[i % COLOURS.length], width: run === this.runs[0] ? 1.6 : 1.3,
        dash: run === this.runs[0] ? undefined : [5, 4], points: { show: false },
      })));
  }

  #draw() {
    const series = this.#series();
    const sorted = this.runs.flatMap((run) => series.filter((s) => s.run === run)).map((s) => ({ ...s, spanGaps: true }));
    const unit = this.runs[0].units[this.signals[0]] ?? "";
    const options = {
      width: Math.max(this.element.clientWidth, 120), height: HEIGHT, legend: { show: false }, padding: [8, 10, 0, 0],
      scales: { x: { time: false }, y: { range: (_, low, high) => padded(low, high) } },
      axes: [axis(), axis(unit)], series: [{}, ...sorted],
      cursor: { drag: { x: false, y: false, setScale: false }, points: { show: false }, y: false, x: false },
    };
    this.chart?.destroy();
    this.chart = new uPlot(options, this.#data(series), this.element);
    this.element.dataset.unit = unit;
    this.line = this.chart.over.appendChild(document.createElement("div"));
    this.line.className = "now";
    this.#scrub(this.chart.over);
    this.#mark();
    this.update();
  }

  /** Draw a line at each mark. */
  #mark() {
    for (const line of this.chart.over.querySelectorAll(".mark")) line.remove();
    for (const { time, label, colour } of marksOf(this.runs[0], this.marks)) {
      const line = this.chart.over.appendChild(document.createElement("div"));
      line.className = "mark";
      line.title = `${label} at ${time.toFixed(2)} s`;
      line.style.cssText = `border-color:${colour};transform:translateX(${this.chart.valToPos(time, "x")}px)`;
    }
  }

  #data(series) {
    const tables = this.runs.map((run) => [run.time, ...series.filter((s) => s.run === run).map((s) => run.values(s.name))]);
    return tables.length === 1 ? tables[0] : uPlot.join(tables.filter((table) => table.length > 1));
  }

  /** Update after the runs have received more rows. */
  grow() {
    this.chart.setData(this.#data(this.#series()));
    this.#mark();
    this.update();
  }

  #scrub(over) {
    const seek = (event) => this.player.seek(this.chart.posToVal(event.clientX - over.getBoundingClientRect().left, "x"));
    over.addEventListener("pointerdown", (event) => {
      over.setPointerCapture(event.pointerId);
      seek(event);
    });
    over.addEventListener("pointermove", (event) => event.buttons & 1 && seek(event));
  }

  update() {
    this.move();
    this.read();
  }

  move() {
    this.line.style.transform = `translateX(${this.chart.valToPos(this.player.time, "x")}px)`;
  }

  read() {
    const unit = this.element.dataset.unit;
    for (const { name, value } of this.values) {
      const texts = this.runs.filter((run) => run.has(name)).map((run) => shown(run.value(name, this.player.time)));
      value.textContent = `${texts.join(" | ")} ${this.runs[0].units[name] ?? unit}`;
    }
  }

  resize() {
    this.chart.setSize({ width: Math.max(this.element.clientWidth, 120), height: HEIGHT });
    this.#mark();
    this.update();
  }

  recolour() {
    this.#draw();
  }
}

function padded(low, high) {
  if (low == null || high == null) return [0, 1];
  const room = high > low ? 0.07 * (high - low) : Math.max(1e-3, 0.1 * Math.abs(high));
  return [low - room, high + room];
}

export class Plots {
  constructor(parent, runs, player, marks) {
    Object.assign(this, { parent, runs, player, marks, list: [] });
    new ResizeObserver(() => this.list.forEach((plot) => plot.resize())).observe(parent);
    player.onChange(() => this.list.forEach((plot) => plot.move()));
    player.onReading(() => this.list.forEach((plot) => plot.read()));
  }

  /** Add a plot of the signals that match any of the patterns ("*" matches any text); return false if there are none. */
  add(patterns) {
    const tests = patterns.map((pattern) => new RegExp(`^${pattern.split("*").map((s) => s.replace(/[.[\]()+?^$|{}\\]/g, "\\$&")).join(".*")}$`));
    const signals = this.runs[0].signals.filter((name) => tests.some((test) => test.test(name)));
    if (!signals.length) return false;
    this.list.push(new Plot(this.parent, signals.slice(0, 12), this.runs, this.player, this.marks, (plot) => this.#remove(plot)));
    return true;
  }

  #remove(plot) {
    plot.chart.destroy();
    plot.element.remove();
    this.list.splice(this.list.indexOf(plot), 1);
  }

  grow() {
    this.list.forEach((plot) => plot.grow());
  }

  recolour() {
    this.list.forEach((plot) => plot.recolour());
  }
}
