// Paths of the bodies seen from above, with the waypoints and the present positions; one scale
// along both axes.
const LEAST = 0.2; // m: no view if no body moves farther
const POINTS = 1500; // of a path
const EDGE = { left: 46, right: 10, top: 8, bottom: 36 };
const HEIGHTS = [190, 400];
const TALL = 220; // pixels: higher views fill two rows of plots
const TICKS = 45; // pixels between two grid lines

function draw(parent, name, attributes, text = "") {
  const element = parent.appendChild(document.createElementNS("http://www.w3.org/2000/svg", name));
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.textContent = text;
  return element;
}

/** Horizontal positions [x, y] of a body (m), at most POINTS and the last one. */
function pathOf(run, { position: [x, y] }) {
  const last = run.time.length - 1;
  const step = Math.ceil((last + 1) / POINTS);
  const rows = [...Array(Math.floor(last / step) + 1).keys()].map((i) => i * step);
  return [...rows, last]
    .map((row) => [run.at(x, row), run.at(y, row)])
    .filter((point) => point.every(Number.isFinite));
}

const extent = (values) => [Math.min(...values), Math.max(...values)];
const span = (points, axis) => {
  const [low, high] = extent(points.map((point) => point[axis]));
  return high - low;
};

/** Multiples of 1, 2 or 5 times a power of ten between two values, at least `least` apart. */
function ticks(low, high, least) {
  const power = 10 ** Math.floor(Math.log10(least));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= least);
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.floor(high / step) - first + 1 }, (_, i) =>
    Number(((first + i) * step).toPrecision(10)),
  );
}

/** Waypoints in the order of their numbers; each mission begins with number 1. */
function missions(markers) {
  const found = [];
  for (const { position, label } of markers) {
    if (label === "1" || !found.length) found.push([]);
    found.at(-1).push(position);
  }
  return found;
}

export class TopView {
  constructor(parent, scene, runs, player) {
    Object.assign(this, { scene, runs, player });
    this.bodies = scene.bodies.filter((body) => runs[0].knows(body));
    this.element = document.createElement("figure");
    this.element.className = "above";
    const caption = this.element.appendChild(document.createElement("figcaption"));
    caption.append("Seen from above");
    for (const { title, colour } of this.bodies) caption.append(entry(title, colour));
    if (scene.markers.length) caption.append(entry("waypoints", ""));
    this.parent = parent;
    new ResizeObserver(() => this.draw()).observe(this.element);
    player.onChange(() => this.move());
    this.grow();
  }

  /** Update after the runs have received more rows. */
  grow() {
    this.paths = this.runs.flatMap((run, number) =>
      this.bodies
        .filter((body) => run.knows(body))
        .map((body) => ({ run, body, number, points: pathOf(run, body) })),
    );
    const moves = this.paths.some(
      ({ points }) => points.length > 1 && Math.max(span(points, 0), span(points, 1)) > LEAST,
    );
    if (moves && !this.element.isConnected) this.parent.prepend(this.element);
    this.draw();
  }

  draw() {
    if (!this.element.isConnected) return;
    this.element.querySelector("svg")?.remove();
    this.#fit(Math.max(this.element.clientWidth, 200));
    this.element.classList.toggle("tall", this.height > TALL);
    const svg = draw(this.element, "svg", {
      role: "img",
      "aria-label": "Paths seen from above",
      width: this.width,
      height: this.height,
    });
    this.#grid(svg);
    this.#waypoints(svg);
    for (const { body, number, points } of this.paths)
      draw(svg, "polyline", {
        class: "path",
        points: this.#line(points),
        stroke: body.colour,
        "stroke-dasharray": number ? "5 4" : "none",
      });
    this.dots = this.paths.map(({ body }) =>
      draw(svg, "circle", { class: "present", r: 5, fill: body.colour }),
    );
    this.move();
  }

  /** Choose the scale (pixels per metre), the height and the middle (m). */
  #fit(width) {
    const around = this.scene.markers.flatMap(({ position: [x, y], radius }) => [
      [x - radius, y - radius],
      [x + radius, y + radius],
    ]);
    const points = [...this.paths.flatMap(({ points }) => points), ...around];
    const [[west, east], [south, north]] = [0, 1].map((axis) =>
      extent(points.map((point) => point[axis])),
    );
    const [inner, room] = [width - EDGE.left - EDGE.right, EDGE.top + EDGE.bottom];
    const [across, along] = [1.08 * (east - west) || 1, 1.08 * (north - south)];
    this.height = Math.min(Math.max(room + (inner * along) / across, HEIGHTS[0]), HEIGHTS[1]);
    this.scale = Math.min(inner / across, (this.height - room) / (along || 1e-9));
    Object.assign(this, { width, middle: [(west + east) / 2, (south + north) / 2] });
    this.centre = [EDGE.left + inner / 2, EDGE.top + (this.height - room) / 2];
  }

  /** Pixels of a place (m). */
  #place([x, y]) {
    return [
      this.centre[0] + this.scale * (x - this.middle[0]),
      this.centre[1] - this.scale * (y - this.middle[1]),
    ];
  }

  #line(points) {
    return points
      .map((point) =>
        this.#place(point)
          .map((value) => value.toFixed(1))
          .join(","),
      )
      .join(" ");
  }

  #grid(svg) {
    const { width, height, scale } = this;
    const [bottom, right] = [height - EDGE.bottom, width - EDGE.right];
    const low = [
      this.middle[0] - (this.centre[0] - EDGE.left) / scale,
      this.middle[1] - (bottom - this.centre[1]) / scale,
    ];
    const high = [
      this.middle[0] + (right - this.centre[0]) / scale,
      this.middle[1] + (this.centre[1] - EDGE.top) / scale,
    ];
    for (const x of ticks(low[0], high[0], TICKS / scale)) {
      const [at] = this.#place([x, 0]);
      draw(svg, "line", { x1: at, x2: at, y1: EDGE.top, y2: bottom });
      draw(svg, "text", { x: at, y: bottom + 15, "text-anchor": "middle" }, String(x));
    }
    for (const y of ticks(low[1], high[1], TICKS / scale)) {
      const [, at] = this.#place([0, y]);
      draw(svg, "line", { x1: EDGE.left, x2: right, y1: at, y2: at });
      draw(svg, "text", { x: EDGE.left - 6, y: at + 4, "text-anchor": "end" }, String(y));
    }
    draw(
      svg,
      "text",
      { x: (EDGE.left + right) / 2, y: height - 4, "text-anchor": "middle" },
      "x, east (m)",
    );
    draw(
      svg,
      "text",
      {
        "text-anchor": "middle",
        transform: `translate(11 ${(EDGE.top + bottom) / 2}) rotate(-90)`,
      },
      "y, north (m)",
    );
  }

  #waypoints(svg) {
    for (const places of missions(this.scene.markers))
      draw(svg, "polyline", { class: "mission", points: this.#line(places) });
    for (const { position, radius, label } of this.scene.markers) {
      const [cx, cy] = this.#place(position);
      const r = Math.max(2, this.scale * radius);
      draw(svg, "circle", { class: "waypoint", cx, cy, r });
      draw(svg, "text", { x: cx + 0.75 * r + 3, y: cy - 0.75 * r - 1 }, label);
    }
  }

  /** Put the dots to the present positions. */
  move() {
    if (!this.dots) return;
    this.paths.forEach(({ run, body }, i) => {
      const { row } = run.place(this.player.time);
      const [cx, cy] = this.#place([run.at(body.position[0], row), run.at(body.position[1], row)]);
      this.dots[i].setAttribute("transform", `translate(${cx} ${cy})`);
    });
  }
}

function entry(text, colour) {
  const element = document.createElement("span");
  const key = element.appendChild(document.createElement("i"));
  if (colour) key.style.background = colour;
  else key.className = "ring";
  element.append(text);
  return element;
}
