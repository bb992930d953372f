// User controls: play, time slider, speed, cameras, vehicles, layers and selection of signals.
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8];
const PLAY = '<svg viewBox="0 0 16 16"><path d="M4 2.5v11l9-5.5z"/></svg>';
const PAUSE = '<svg viewBox="0 0 16 16"><path d="M4 2.5h3v11H4zM9 2.5h3v11H9z"/></svg>';
const FULL =
  '<svg viewBox="0 0 16 16"><path d="M2 6V2h4v1.6H3.6V6zm8-4h4v4h-1.6V3.6H10z' +
  'M3.6 10v2.4H6V14H2v-4zm8.8 0H14v4h-4v-1.6h2.4z"/></svg>';

const PAGE = `
<div class="stage"><p class="loading">Loading the 3-D view …</p>
  <canvas aria-label="3-D replay"></canvas>
  <div class="overlay"><div class="chips" role="group" aria-label="Vehicles"></div>
  <div class="cameras segmented" role="group" aria-label="Camera"></div></div></div>
<div class="bar">
  <button type="button" class="play"></button>
  <output class="clock"></output>
  <div class="track"><div class="spans"></div>
    <input type="range" class="scrubber" aria-label="Time" min="0" max="1" step="any"></div>
  <label class="pace"><span>Replay speed</span>
    <select class="speed" aria-label="Replay speed"></select></label>
  <div class="layers segmented" role="group" aria-label="Layers">
    <button type="button" data-layer="trails" aria-pressed="true">Trails</button>
    <button type="button" data-layer="ghosts" aria-pressed="false">Ghosts</button></div>
  <button type="button" class="full icon" title="Full screen (F)"
    aria-label="Full screen (F)">${FULL}</button>
  <p class="legend"></p></div>
<div class="signals">
  <div class="tools"><form class="add">
    <input list="signal-names" placeholder="Add a signal, * matches any text"
      aria-label="Add a signal" spellcheck="false">
  <datalist id="signal-names"></datalist></form>
  <div class="window segmented" role="group" aria-label="Time axis of the plots"
    title="Drag in a plot to zoom, with Shift to pan, double-click to show all">
    <button type="button" data-zoom="0.5" aria-label="Zoom in">+</button>
    <button type="button" data-zoom="2" aria-label="Zoom out">−</button>
    <button type="button" data-pan="-0.25" aria-label="Earlier">←</button>
    <button type="button" data-pan="0.25" aria-label="Later">→</button>
    <button type="button" class="all">All</button></div></div><div class="plots"></div></div>`;

export function build(root) {
  root.innerHTML = PAGE;
  const find = (selector) => root.querySelector(selector);
  return {
    root,
    stage: find(".stage"),
    canvas: find("canvas"),
    chips: find(".chips"),
    cameras: find(".cameras"),
    bar: find(".bar"),
    play: find(".play"),
    clock: find(".clock"),
    spans: find(".spans"),
    legend: find(".legend"),
    scrubber: find(".scrubber"),
    pace: find(".pace span"),
    speed: find(".speed"),
    layers: find(".layers"),
    full: find(".full"),
    window: find(".window"),
    add: find(".add"),
    names: find("datalist"),
    plots: find(".plots"),
  };
}

/**
 * Offer speeds, and "as fast as possible" if `unlimited`; `speed` is the present one, null for
 * that.
 */
export function offerSpeeds(select, speed, unlimited) {
  const known = [...new Set([...SPEEDS, ...(speed ? [speed] : [])])].sort((a, b) => a - b);
  select.replaceChildren(...known.map((factor) => new Option(`${factor}×`, factor)));
  if (unlimited) select.append(new Option("fastest", ""));
  select.value = speed ?? "";
}

export function connectTime(page, player) {
  Object.assign(page.scrubber, { min: player.first, max: player.last, value: player.time });
  page.scrubber.addEventListener("input", () => player.seek(Number(page.scrubber.value)));
  page.play.addEventListener("click", () => player.toggle());
  page.speed.addEventListener("change", () => player.setSpeed(page.speed.value));
  offerSpeeds(page.speed, player.speed);
  connectKeys(page, player);
  let shown;
  player.onReading(() => {
    const digits = player.last < 1000 ? 2 : 1;
    page.scrubber.max = player.last;
    const sign = player.running ? PAUSE : PLAY;
    if (sign !== shown) page.play.innerHTML = shown = sign;
    page.play.title = page.play.ariaLabel = player.running ? "Pause (space)" : "Play (space)";
    page.scrubber.value = player.time;
    const [now, end] = [player.time.toFixed(digits), player.last.toFixed(digits)];
    page.clock.innerHTML = `<b>${now}</b> / ${end} s`;
    page.scrubber.style.setProperty(
      "--done",
      `${(100 * (player.time - player.first)) / (player.last - player.first || 1)}%`,
    );
  });
}

/**
 * Keys of the whole page. A button that was clicked gives up the focus, so that the space bar
 * plays and does not click again.
 */
function connectKeys(page, player) {
  page.root.addEventListener(
    "click",
    (event) => event.detail && event.target.closest("button")?.blur(),
  );
  page.full.addEventListener("click", () => fullScreen(page));
  document.addEventListener("keydown", (event) => {
    const type = event.target.matches("input, textarea") ? event.target.type : "";
    if ((type && type !== "range") || event.ctrlKey || event.metaKey || event.altKey) return;
    if (key(event, page, player)) event.preventDefault();
  });
}

function key(event, page, player) {
  const { target } = event;
  const step = { ArrowLeft: -0.1, ArrowRight: 0.1 }[event.key];
  if (event.key === " " && !target.matches("button, summary, select, a")) player.toggle();
  else if (event.key === "f") fullScreen(page);
  else if (step && (target === page.scrubber || !target.matches("select, input")))
    player.seek(player.time + step * (event.shiftKey ? 10 : 1));
  else return false;
  return true;
}

function fullScreen(page) {
  if (document.fullscreenElement) document.exitFullscreen();
  else page.root.requestFullscreen();
}

/** A group of buttons of which one is pressed. */
function choice(parent, labels, choose) {
  const buttons = Object.entries(labels).map(([value, label]) => {
    const button = parent.appendChild(document.createElement("button"));
    Object.assign(button, { type: "button", textContent: label });
    button.dataset.value = value;
    button.addEventListener("click", () => choose(value));
    return button;
  });
  return (value) =>
    buttons.forEach((button) =>
      button.setAttribute("aria-pressed", button.dataset.value === value),
    );
}

export function connectView(page, view, scene, first) {
  const labels = {
    group: "Group",
    orbit: "Orbit",
    chase: "Chase",
    top: "Top",
    ...Object.fromEntries(scene.views.map(({ name }) => [name, name])),
  };
  const choose = (mode) => {
    view.choose(mode);
    mark(mode);
  };
  const mark = choice(page.cameras, labels, choose);
  for (const actor of view.own)
    page.chips.append(chip(actor, () => (view.follow(actor), mark("chase"))));
  page.layers.addEventListener("click", ({ target }) => {
    const pressed = target.getAttribute("aria-pressed") !== "true";
    target.setAttribute("aria-pressed", pressed);
    view.show(target.dataset.layer, pressed);
  });
  choose(first);
}

function chip(actor, follow) {
  const button = document.createElement("button");
  Object.assign(button, { type: "button", className: "chip", title: "Follow", onclick: follow });
  const dot = button.appendChild(document.createElement("i"));
  dot.style.background = actor.body.colour;
  button.append(actor.body.title);
  return button;
}

export function connectSignals(page, run, plots) {
  page.window.addEventListener("click", ({ target }) => {
    if (target.dataset.zoom) plots.zoom(Number(target.dataset.zoom));
    else if (target.dataset.pan) plots.pan(Number(target.dataset.pan));
    else if (target.matches(".all")) plots.look(null);
  });
  for (const name of run.signals) page.names.append(new Option(name, name));
  const input = page.add.querySelector("input");
  const submit = (event) => {
    event?.preventDefault();
    if (plots.add([input.value.trim()])) input.value = "";
    else
      (input.setCustomValidity("no such signal"),
        input.reportValidity(),
        input.setCustomValidity(""));
  };
  page.add.addEventListener("submit", submit);
  input.addEventListener("change", () => run.has(input.value) && submit());
}
