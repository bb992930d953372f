// Controls of a running simulation, beside those of the replay: single step, state, tunable
// parameters and unconnected inputs.
import { offerSpeeds } from "./controls.js";

const STATE = `<button type="button" class="step">Step</button>
  <button type="button" class="state" title="Show the newest row"></button>`;
const ADJUST = `<output class="answer" role="alert"></output>
  <details class="adjust"><summary>Parameters and inputs</summary>
  <input class="filter" placeholder="Filter" aria-label="Filter parameters and inputs"
    spellcheck="false"><div class="fields"></div></details>`;

/**
 * Return a function that sends a command, shows why it was refused, and returns true if it was
 * carried out.
 */
export function commander(page, live) {
  return async (message) => {
    const { error } = await live.command(message);
    page.root.querySelector(".answer").textContent = error ?? "";
    return !error;
  };
}

/** Add the controls; return a function to be called when the state of the run has changed. */
export function steer(page, live, player, command) {
  page.play.insertAdjacentHTML("afterend", STATE);
  page.bar.insertAdjacentHTML("afterend", `<div class="live">${ADJUST}</div>`);
  const [step, state] = [".step", ".state"].map((selector) => page.bar.querySelector(selector));
  step.addEventListener("click", () => command({ command: "step" }));
  state.addEventListener("click", () => player.seek(player.last));
  const fields = live.adjustable.map((about) =>
    field(about, (value) => command({ command: "set", name: about.name, value })),
  );
  page.root.querySelector(".fields").append(...fields);
  filtering(page.root.querySelector(".filter"), fields);
  const show = () => {
    const { paused, ended, speed } = live.state;
    state.textContent = ended ? "Finished" : paused ? "Paused" : "Live";
    state.dataset.state = state.textContent;
    page.pace.textContent = page.speed.ariaLabel = ended ? "Replay speed" : "Run speed";
    offerSpeeds(page.speed, ended ? player.speed : speed, !ended);
    if (ended)
      for (const control of [step, ...page.root.querySelectorAll(".fields input")])
        control.disabled = true;
  };
  show();
  return show;
}

function filtering(input, fields) {
  input.addEventListener("input", () => {
    const wanted = input.value.trim().toLowerCase();
    for (const each of fields) each.hidden = !each.dataset.name.toLowerCase().includes(wanted);
  });
}

/**
 * Field of one value: a check box, a slider with a number if there are bounds, a number, or a
 * text (lists as JSON).
 */
function field(about, set) {
  const label = document.createElement("label");
  label.dataset.name = about.name;
  label.title = about.description;
  label.append(
    Object.assign(document.createElement("span"), {
      textContent: about.name + (about.unit ? ` (${about.unit})` : ""),
    }),
  );
  const inputs = kindsOf(about).map((type) => label.appendChild(inputOf(about, type)));
  let last = about.value;
  const show = (value) => inputs.forEach((input) => put(input, value));
  for (const input of inputs) {
    input.addEventListener("change", async () => {
      const value = taken(input, about);
      const accepted = value !== undefined && (await set(value));
      if (accepted) last = value;
      show(last);
    });
  }
  show(last);
  return label;
}

function kindsOf({ type, value, minimum, maximum }) {
  if (Array.isArray(value) || type === "String" || type === "Binary") return ["text"];
  if (type === "Boolean") return ["checkbox"];
  return minimum !== null && maximum !== null ? ["range", "number"] : ["number"];
}

function inputOf({ name, type: kind, minimum, maximum }, type) {
  const whole = !kind.startsWith("Float");
  const input = Object.assign(document.createElement("input"), { type, ariaLabel: name });
  if (type !== "range" && type !== "number") return input;
  if (minimum !== null) input.min = minimum;
  if (maximum !== null) input.max = maximum;
  input.step = whole ? 1 : "any";
  return input;
}

function put(input, value) {
  if (input.type === "checkbox") input.checked = Boolean(value);
  else input.value = Array.isArray(value) ? JSON.stringify(value) : value;
}

/** The value of a field, or undefined if it is invalid. */
function taken(input, { value }) {
  if (input.type === "checkbox") return input.checked;
  if (input.type !== "text")
    return Number.isFinite(input.valueAsNumber) ? input.valueAsNumber : undefined;
  if (!Array.isArray(value)) return input.value;
  try {
    return JSON.parse(input.value);
  } catch {
    return undefined;
  }
}
