// The scene: light, sky, water, bodies with their trails, and the camera; drawn only when something has changed.
import {
  BasicShadowMap, Color, ColorManagement, DirectionalLight, Euler, Group, HemisphereLight, LinearSRGBColorSpace, MeshLambertMaterial,
  PCFShadowMap, Scene, Vector3, WebGLRenderer,
} from "three";
import { bodyOf, reachOf } from "./bodies.js";
import { boxAround, Cameras } from "./cameras.js";
import { markerOf } from "./markers.js";
import { theme } from "./theme.js";
import { Ghosts, Trail } from "./trails.js";
import { Water } from "./water.js";

const SLOW = 42; // ms between frames from which on the picture is made coarser
const COARSEST = 0.5; // pixels of the picture per pixel of the page
const SUN = new Vector3(-0.45, -0.6, 0.66).normalize();
const OTHER = "#c2185b";

ColorManagement.enabled = false; // colours are mixed as they are shown: powers for each pixel take a processor long

/** Whether the processor has to draw, because there is no graphics card to do it. */
function drawnBySoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const about = gl?.getExtension("WEBGL_debug_renderer_info");
  return about ? /swiftshader|llvmpipe|software|basic render/i.test(gl.getParameter(about.UNMASKED_RENDERER_WEBGL)) : false;
}

export class View {
  constructor(canvas, scene, runs) {
    Object.assign(this, { runs, time: runs[0].first });
    this.scene = new Scene();
    const software = drawnBySoftware();
    this.renderer = new WebGLRenderer({ canvas, antialias: !software });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = software ? BasicShadowMap : PCFShadowMap;
    this.ratio = software ? 0.8 : Math.min(devicePixelRatio, 1.5);
    this.#surroundings(scene);
    this.actors = runs.flatMap((run, i) => scene.bodies.filter((body) => run.knows(body)).map((body) => this.#actor(run, body, i > 0)));
    this.own = this.actors.filter((actor) => actor.run === runs[0]);
    this.subject = this.own[0];
    this.cameras = new Cameras(canvas, this.#box(), Object.fromEntries(scene.views.map((view) => [view.name, view])));
    this.cameras.controls.addEventListener("change", () => this.request());
    this.recolour();
    new ResizeObserver(() => this.#resize()).observe(canvas.parentElement);
    this.#resize();
  }

  #surroundings(scene) {
    this.light = new DirectionalLight("#fff6e8", 2);
    this.light.castShadow = true;
    this.light.shadow.mapSize.setScalar(1024);
    Object.assign(this.light.shadow.camera, { left: -2.5, right: 2.5, top: 2.5, bottom: -2.5, near: 0.1, far: 24 });
    this.light.shadow.bias = -1e-3;
    this.light.shadow.normalBias = 0.01;
    this.around = new HemisphereLight("#ffffff", "#8fb0b8", 1.5);
    this.scene.add(this.light, this.light.target, this.around);
    this.water = scene.water && new Water(scene.water);
    if (this.water) this.scene.add(this.water.mesh);
    this.scene.add(bodyOf(scene.fixed), ...scene.markers.map(markerOf));
  }

  #actor(run, body, isOther) {
    const object = new Group().add(bodyOf(body.parts));
    if (isOther) this.#veil(object);
    const reach = reachOf(body.parts);
    this.scene.add(object);
    return { run, body, object, ...this.#past(run, body, isOther), reach, get position() { return object.position; } };
  }

  #past(run, body, isOther) {
    const trail = new Trail(run, body, isOther ? OTHER : body.colour, isOther);
    const ghosts = isOther || !body.parts.some((part) => part.opacity === 1) ? null : new Ghosts(run, body);
    this.scene.add(...trail.lines, ...(ghosts ? [ghosts.mesh] : []));
    return { trail, ghosts };
  }

  #box() {
    const places = this.own.flatMap(({ run, body }) => Array.from({ length: 60 }, (_, i) => run.position(body, Math.floor((i * run.time.length) / 60))));
    return boxAround(places.filter((place) => place.toArray().every(Number.isFinite)));
  }

  /** The runs have more rows. */
  grow() {
    for (const actor of this.actors) {
      const { run, body, trail, ghosts } = actor;
      this.scene.remove(...trail.lines, ...(ghosts ? [ghosts.mesh] : []));
      Object.assign(actor, this.#past(run, body, run !== this.runs[0]));
      for (const line of actor.trail.lines) line.visible = trail.whole.visible;
      if (ghosts) actor.ghosts.mesh.visible = ghosts.mesh.visible;
      trail.dispose();
      ghosts?.dispose();
    }
    this.cameras.cover(this.#box());
    this.update(this.time);
  }

  /** The second run's bodies are tinted and translucent. */
  #veil(object) {
    object.traverse((mesh) => {
      if (!mesh.isMesh) return;
      mesh.castShadow = false;
      mesh.material = new MeshLambertMaterial({ color: OTHER, transparent: true, opacity: 0.5, depthWrite: false });
    });
  }

  recolour() {
    const colours = theme();
    this.light.intensity = colours.sun;
    this.around.intensity = colours.sky;
    this.around.groundColor.set(colours.ground);
    this.scene.background = new Color(colours.horizon);
    this.water?.colour(colours);
    this.request();
  }

  show(what, visible) {
    for (const { trail, ghosts } of this.actors) {
      if (what === "trails") for (const line of trail.lines) line.visible = visible;
      if (what === "ghosts" && ghosts) ghosts.mesh.visible = visible;
    }
    this.update(this.time);
  }

  follow(actor) {
    this.subject = actor;
    this.choose("chase");
  }

  choose(mode) {
    this.cameras.choose(mode, this.subject);
    this.update(this.time);
  }

  /** Put everything where it is at a moment. */
  update(time) {
    this.time = time;
    for (const { run, body, object, trail, ghosts } of this.actors) {
      const { position, orientation } = run.pose(body, time);
      object.position.copy(position);
      object.quaternion.copy(orientation);
      trail.update(run.place(time).row);
      ghosts?.update(time);
    }
    this.light.target.position.copy(this.subject.position);
    this.light.position.copy(this.subject.position).addScaledVector(SUN, 10);
    this.cameras.update(this.subject, this.#mounted());
    this.#moveWater(time);
    this.request();
  }

  #mounted() {
    const view = this.cameras.views[this.cameras.mode];
    const actor = view && this.own.find(({ body }) => body.name === view.on);
    return actor && { position: actor.position, yaw: new Euler().setFromQuaternion(actor.object.quaternion, "ZYX").z };
  }

  #moveWater(time) {
    if (!this.water) return;
    const gain = this.runs[0].has(this.water.gain) ? this.runs[0].value(this.water.gain, time) : 1;
    this.water.update(time, gain, this.cameras.controls.target, this.own);
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.renderer.domElement.parentElement;
    if (!width || !height) return;
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.setSize(width, height, false);
    this.cameras.resize(width, height);
    this.request();
  }

  request() {
    this.stale = true;
  }

  /** Draw if anything has changed; `elapsed` (ms) since the frame before. */
  draw(elapsed) {
    if (!this.stale) return;
    this.stale = false;
    this.renderer.render(this.scene, this.cameras.camera);
    this.#adapt(elapsed);
  }

  /** Fewer pixels where frames take too long, as without a graphics card. */
  #adapt(elapsed) {
    this.pace = elapsed > 0 && elapsed < 1000 ? 0.9 * (this.pace ?? 16) + 0.1 * elapsed : this.pace;
    if (this.pace < SLOW || this.ratio <= COARSEST) return;
    this.ratio = Math.max(COARSEST, 0.8 * this.ratio);
    this.pace = 16;
    this.#resize();
  }
}
