// Controls of a running simulation: pause, step, speed, tunable parameters and unconnected inputs.

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8];

const BAR = `
<div class="steering" role="group" aria-label="Running simulation">
  <b class="state" role="status"></b>
  <button type="button" class="pause"></button><button type="button" class="step">Step</button>
  <label>Speed <select aria-label="Speed of the simulation"></select></label><output class="answer" role="alert"></output></div>
<details class="adjust"><summary>Parameters and inputs</summary>
  <input class="filter" placeholder="Filter" aria-label="Filter parameters and inputs" spellcheck="false"><div class="fields"></div></details>`;

function speeds(select, speed) {
  const known = [...new Set([...SPEEDS, ...(speed ? [speed] : [])])].sort((a, b) => a - b);
  select.replaceChildren(...known.map((factor) => new Option(`${factor}×`, factor)), new Option("as fast as possible", ""));
  select.value = speed ?? "";
}

/** Show the controls above the signals; return a function to be called when the state of the run has changed. */
export function steer(page, live) {
  const holder = document.createElement("div");
  holder.className = "live";
  holder.innerHTML = BAR;
  page.root.querySelector(".signals").before(holder);
  const [state, pause, step, speed, answer] = [".state", ".pause", ".step", "select", ".answer"].map((s) => holder.querySelector(s));
  const tell = async (message) => {
    const { error } = await live.command(message);
    answer.textContent = error ?? "";
    return !error;
  };
  pause.addEventListener("click", () => tell({ command: live.state.paused ? "resume" : "pause" }));
  step.addEventListener("click", () => tell({ command: "step" }));
  speed.addEventListener("change", () => tell({ command: "speed", factor: speed.value ? Number(speed.value) : null }));
  const fields = live.adjustable.map((about) => field(about, (value) => tell({ command: "set", name: about.name, value })));
  holder.querySelector(".fields").append(...fields);
  filtering(holder.querySelector(".filter"), fields);
  const show = () => {
    const { paused, ended } = live.state;
    state.textContent = ended ? "Finished" : paused ? "Paused" : "Live";
    state.dataset.state = state.textContent;
    pause.textContent = paused ? "Resume" : "Pause";
    speeds(speed, live.state.speed);
    if (ended) for (const control of holder.querySelectorAll("button, select, .fields input")) control.disabled = true;
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

/** Field of one value: a check box, a slider with a number if there are bounds, a number, or a text (lists as JSON). */
function field(about, set) {
  const label = document.createElement("label");
  label.dataset.name = about.name;
  label.title = about.description;
  label.append(Object.assign(document.createElement("span"), { textContent: about.name + (about.unit ? ` (${about.unit})` : "") }));
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
  if (input.type !== "text") return Number.isFinite(input.valueAsNumber) ? input.valueAsNumber : undefined;
  if (!Array.isArray(value)) return input.value;
  try {
    return JSON.parse(input.value);
  } catch {
    return undefined;
  }
}
