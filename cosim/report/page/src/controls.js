// User controls: play, time slider, speed, cameras, vehicles, layers and selection of signals.
import { marksOf } from "./marks.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8];
const PLAY = '<svg viewBox="0 0 16 16"><path d="M4 2.5v11l9-5.5z"/></svg>';
const PAUSE = '<svg viewBox="0 0 16 16"><path d="M4 2.5h3v11H4zM9 2.5h3v11H9z"/></svg>';

const PAGE = `
<div class="stage"><canvas aria-label="3-D replay"></canvas>
  <div class="overlay"><div class="chips" role="group" aria-label="Vehicles"></div>
  <div class="cameras segmented" role="group" aria-label="Camera"></div></div></div>
<div class="bar">
  <button type="button" class="play" aria-label="Play or pause (space)"></button>
  <output class="clock"></output>
  <div class="track"><div class="spans"></div><input type="range" class="scrubber" aria-label="Time" min="0" max="1" step="any"></div>
  <select class="speed" aria-label="Speed">${SPEEDS.map((s) => `<option value="${s}"${s === 1 ? " selected" : ""}>${s}×</option>`).join("")}</select>
  <div class="layers segmented" role="group" aria-label="Layers">
    <button type="button" data-layer="trails" aria-pressed="true">Trails</button>
    <button type="button" data-layer="ghosts" aria-pressed="false">Ghosts</button></div></div>
<div class="signals">
  <form class="add"><input list="signal-names" placeholder="Add a signal, * matches any text" aria-label="Add a signal" spellcheck="false">
  <datalist id="signal-names"></datalist></form><div class="plots"></div></div>`;

export function build(root) {
  root.innerHTML = PAGE;
  const find = (selector) => root.querySelector(selector);
  return {
    root, stage: find(".stage"), canvas: find("canvas"), chips: find(".chips"), cameras: find(".cameras"), play: find(".play"),
    clock: find(".clock"), spans: find(".spans"), scrubber: find(".scrubber"), speed: find(".speed"), layers: find(".layers"),
    add: find(".add"), names: find("datalist"), plots: find(".plots"),
  };
}

export function connectTime(page, player) {
  Object.assign(page.scrubber, { min: player.first, max: player.last, value: player.time });
  page.scrubber.addEventListener("input", () => player.seek(Number(page.scrubber.value)));
  page.play.addEventListener("click", () => player.toggle());
  page.speed.addEventListener("change", () => player.setSpeed(Number(page.speed.value)));
  page.root.addEventListener("keydown", (event) => key(event, player));
  page.root.tabIndex = -1;
  let shown;
  player.onReading(() => {
    const digits = player.last < 1000 ? 2 : 1;
    page.scrubber.max = player.last;
    const sign = player.playing ? PAUSE : PLAY;
    if (sign !== shown) page.play.innerHTML = shown = sign;
    page.scrubber.value = player.time;
    page.clock.innerHTML = `<b>${player.time.toFixed(digits)}</b> / ${player.last.toFixed(digits)} s`;
    page.scrubber.style.setProperty("--done", `${(100 * (player.time - player.first)) / (player.last - player.first || 1)}%`);
  });
}

function key(event, player) {
  if (/^(input|select)$/i.test(event.target.tagName) && event.target.type !== "range") return;
  const step = { ArrowLeft: -0.1, ArrowRight: 0.1 }[event.key];
  if (event.key === " " && event.target.tagName !== "BUTTON") player.toggle();
  else if (step) player.seek(player.time + step * (event.shiftKey ? 10 : 1));
  else return;
  event.preventDefault();
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
  return (value) => buttons.forEach((button) => button.setAttribute("aria-pressed", button.dataset.value === value));
}

export function connectView(page, view, scene, first) {
  const labels = { orbit: "Orbit", chase: "Chase", top: "Top", ...Object.fromEntries(scene.views.map(({ name }) => [name, name])) };
  const choose = (mode) => {
    view.choose(mode);
    mark(mode);
  };
  const mark = choice(page.cameras, labels, choose);
  for (const actor of view.own) page.chips.append(chip(actor, () => (view.follow(actor), mark("chase"))));
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

/** Intervals in which Boolean signals are true, and marks, along the time slider. */
export function showSpans(page, run, { spans, marks }) {
  const length = run.last - run.first || 1;
  page.spans.replaceChildren();
  for (const { signal, label, colour } of spans.filter(({ signal }) => run.has(signal))) {
    for (const [first, last] of run.spans(signal)) {
      const mark = page.spans.appendChild(document.createElement("i"));
      mark.title = `${label} ${first.toFixed(2)} to ${last.toFixed(2)} s`;
      mark.style.cssText = `left:${(100 * (first - run.first)) / length}%;width:${(100 * (last - first)) / length}%;background:${colour}`;
    }
  }
  for (const { time, label, colour } of marksOf(run, marks)) {
    const mark = page.spans.appendChild(document.createElement("b"));
    mark.textContent = "×";
    mark.title = `${label} at ${time.toFixed(2)} s`;
    mark.style.cssText = `left:${(100 * (time - run.first)) / length}%;background:${colour}`;
  }
}

export function connectSignals(page, run, plots) {
  for (const name of run.signals) page.names.append(new Option(name, name));
  const input = page.add.querySelector("input");
  const submit = (event) => {
    event?.preventDefault();
    if (plots.add([input.value.trim()])) input.value = "";
    else input.setCustomValidity("no such signal"), input.reportValidity(), input.setCustomValidity("");
  };
  page.add.addEventListener("submit", submit);
  input.addEventListener("change", () => run.has(input.value) && submit());
}
