// The replay page. Its data is in the element #replay-data, written by `cosim/report/replay.py`.
import "uplot/dist/uPlot.min.css";
import "./style.css";
import { build, connectSignals, connectTime, connectView } from "./controls.js";
import { Live } from "./live.js";
import { LivePlayer, Player } from "./player.js";
import { marksOf } from "./marks.js";
import { Plots } from "./plots.js";
import { Run } from "./run.js";
import { showSpans } from "./spans.js";
import { commander, steer } from "./steering.js";
import { onThemeChange } from "./theme.js";
import { themeButtons } from "./theme_button.js";
import { TopView } from "./top_view.js";
import { View } from "./view.js";

const REDRAW = 500; // ms between two updates of a growing run
const SAME = 0.1; // s between the mark of a scene and a failure that it marks

async function start(root, data) {
  const live = data.live && new Live(data.live);
  const runs = live ? [await live.begin()] : await Promise.all(data.runs.map(Run.decoded));
  const page = build(root);
  if (data.failure) markFailure(data.scene.marks, data.failure, runs[0]);
  const command = live && commander(page, live);
  const player = live
    ? new LivePlayer(live, command)
    : new Player(runs[0].first, Math.max(...runs.map((run) => run.last)));
  connectTime(page, player);
  const view = sceneView(page, data.scene, runs);
  if (view) {
    player.onChange(() => view.update(player.time));
    connectView(page, view, data.scene, "group");
  }
  showSpans(page, runs[0], data.scene);
  const plots = new Plots(page.plots, runs, player, data.scene.marks);
  for (const patterns of data.scene.plots) plots.add(patterns);
  const above = new TopView(page.plots, data.scene, runs, player);
  connectSignals(page, runs[0], plots);
  onThemeChange(() => (view?.recolour(), plots.recolour()));
  player.seek(data.failure ? data.failure.opens : player.time);
  animate(player, view, page.stage);
  if (live) {
    player.seek(player.last);
    watch(live, page, command, { player, view, plots, above, scene: data.scene });
  }
  return { player, view, plots, above, runs, live };
}

/** Add a mark for the failure of a run, unless the scene marks it already. */
function markFailure(marks, { time, label }, run) {
  if (!marksOf(run, marks).some((mark) => Math.abs(mark.time - time) < SAME))
    marks.push({ time, label, colour: "#c62828" });
}

/** Show new rows until the run has ended; then the page is an ordinary replay. */
function watch(live, page, command, { player, view, plots, above, scene }) {
  const show = steer(page, live, player, command);
  let drawn = 0;
  live.follow(() => {
    player.grow(live.run.last);
    show();
    if (performance.now() - drawn < REDRAW && !live.state.complete) return;
    drawn = performance.now();
    plots.grow();
    above.grow();
    view?.grow();
    if (view) showSpans(page, live.run, scene);
  });
}

function sceneView(page, scene, runs) {
  if (scene.bodies.some((body) => runs[0].knows(body))) {
    try {
      return new View(page.canvas, scene, runs);
    } catch (error) {
      console.warn(`no 3-D view: ${error.message}`);
    }
  }
  page.stage.remove();
  page.layers.remove();
  return null;
}

/** Draw every frame; the first one, which may take seconds, replaces the text in the stage. */
function animate(player, view, stage) {
  let former;
  const frame = (now) => {
    player.advance(former === undefined ? 0 : (now - former) / 1000);
    view?.draw(now, player.playing ? now - former : 0);
    if (former === undefined) stage.dataset.drawn = "true";
    former = now;
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}

themeButtons(document);
const root = document.getElementById("replay");
if (root) {
  start(root, JSON.parse(document.getElementById("replay-data").textContent)).then((replay) => {
    window.cosimReplay = replay;
    root.dataset.ready = "true";
  });
}
