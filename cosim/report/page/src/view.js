// The scene: light, sky, water, bodies with their trails, and the camera; rendered only after a
// change.
import {
  BasicShadowMap,
  Color,
  ColorManagement,
  DirectionalLight,
  Euler,
  Group,
  HemisphereLight,
  LinearSRGBColorSpace,
  MeshLambertMaterial,
  PCFShadowMap,
  Scene,
  Sphere,
  WebGLRenderer,
} from "three";
import { Backdrop } from "./backdrop.js";
import { bodyOf, reachOf } from "./bodies.js";
import { boxAround, Cameras, SIGNS, withoutOutliers } from "./cameras.js";
import { markersOf } from "./markers.js";
import { Cross, marksOf } from "./marks.js";
import { drawnBySoftware, FINEST, Quality, setDetail } from "./quality.js";
import { SUN, theme } from "./theme.js";
import { Ghosts, Trail } from "./trails.js";
import { Water } from "./water.js";

const REST = 350; // ms without a change until the picture is rendered at the highest quality
const OTHER = "#c2185b";
const LOWEST = -3; // m; what sinks below this height does not count for the camera

// blend colours without conversion, which is slow in software rendering
ColorManagement.enabled = false;

/** Create a renderer with an opaque canvas; `software` is true if the processor renders. */
function rendererOn(canvas) {
  const software = drawnBySoftware(document.createElement("canvas").getContext("webgl2"));
  const context = canvas.getContext("webgl2", { alpha: false, antialias: !software });
  const renderer = new WebGLRenderer({ canvas, context });
  renderer.outputColorSpace = LinearSRGBColorSpace;
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.autoUpdate = false;
  renderer.shadowMap.type = software ? BasicShadowMap : PCFShadowMap;
  return { renderer, software };
}

/** Let an object be drawn without a mirror image in the water. */
function asSign(object) {
  object.traverse((part) => part.layers.set(SIGNS));
  return object;
}

export class View {
  constructor(canvas, scene, runs) {
    Object.assign(this, { runs, marks: scene.marks, time: runs[0].first });
    this.scene = new Scene();
    const { renderer, software } = rendererOn(canvas);
    // smaller pixels smooth edges; a graphics card does that at a lower cost
    const most = software ? Infinity : devicePixelRatio;
    Object.assign(this, {
      renderer,
      quality: new Quality(software),
      most,
      shown: null,
      frames: 0,
      changed: 0,
    });
    this.#surroundings(scene);
    this.actors = runs.flatMap((run, i) =>
      scene.bodies.filter((body) => run.knows(body)).map((body) => this.#actor(run, body, i > 0)),
    );
    this.own = this.actors.filter((actor) => actor.run === runs[0]);
    this.subject = this.own[0];
    this.cameras = new Cameras(
      canvas,
      this.#box(),
      Object.fromEntries(scene.views.map((view) => [view.name, view])),
    );
    this.backdrop = this.water && new Backdrop(this.cameras.centre, this.cameras.size / 2);
    if (this.backdrop) this.scene.add(this.backdrop.object);
    this.cameras.controls.addEventListener("change", () => this.request());
    this.recolour();
    new ResizeObserver(() => this.#resize()).observe(canvas.parentElement);
    this.#resize();
  }

  #surroundings(scene) {
    this.light = new DirectionalLight("#fff6e8", 2);
    this.light.castShadow = true;
    this.light.shadow.mapSize.setScalar(1024);
    Object.assign(this.light.shadow.camera, {
      left: -2.5,
      right: 2.5,
      top: 2.5,
      bottom: -2.5,
      near: 0.1,
      far: 24,
    });
    this.light.shadow.bias = -1e-3;
    this.light.shadow.normalBias = 0.01;
    this.around = new HemisphereLight("#ffffff", "#8fb0b8", 1.5);
    this.scene.add(this.light, this.light.target, this.around);
    this.water = scene.water && new Water(scene.water);
    if (this.water) this.scene.add(this.water.object);
    this.scene.add(bodyOf(scene.fixed), asSign(markersOf(scene.markers)));
  }

  #actor(run, body, isOther) {
    const parts = bodyOf(body.parts);
    const object = new Group().add(parts);
    if (isOther) this.#veil(object);
    const reach = reachOf(body.parts);
    this.scene.add(object);
    const actor = {
      run,
      body,
      object,
      solid: parts.solid,
      isOther,
      reach,
      get position() {
        return object.position;
      },
    };
    return Object.assign(actor, this.#past(actor));
  }

  #past({ run, body, solid, isOther }) {
    const marks = marksOf(run, this.marks).filter(({ on }) => on === body.name);
    const end = Math.min(run.last, ...marks.map((mark) => mark.time));
    const trail = new Trail(run, body, isOther ? OTHER : body.colour, isOther, end);
    const ghosts = isOther || !solid ? null : new Ghosts(run, body, solid);
    const crosses = marks.map((mark) => new Cross(mark, run.position(body, mark.row)));
    this.scene.add(
      ...trail.lines.map(asSign),
      ...(ghosts ? [ghosts.mesh] : []),
      ...crosses.map((cross) => asSign(cross.object)),
    );
    return { trail, ghosts, crosses, end };
  }

  /**
   * The box around all bodies until they are marked (a crash), without what is far below the
   * water or far away for a short time.
   */
  #box() {
    const places = this.own.flatMap(({ run, body, end }) => {
      const rows = run.place(end).row;
      return Array.from({ length: 60 }, (_, i) => run.position(body, Math.round((i * rows) / 59)));
    });
    return boxAround(withoutOutliers(places.filter((place) => this.#counts(place))));
  }

  /** True if the camera must show a place. */
  #counts(place) {
    return place.toArray().every(Number.isFinite) && (!this.water || place.z > LOWEST);
  }

  /** The sphere around all vehicles now. */
  #group() {
    const places = withoutOutliers(
      this.own.map(({ position }) => position).filter((place) => this.#counts(place)),
    );
    const around = boxAround(places.length ? places : [this.subject.position]).getBoundingSphere(
      new Sphere(),
    );
    around.radius += Math.max(...this.own.map(({ reach }) => reach));
    return around;
  }

  /** Update after the runs have received more rows. */
  grow() {
    for (const actor of this.actors) {
      const { trail, ghosts, crosses } = actor;
      this.scene.remove(
        ...trail.lines,
        ...(ghosts ? [ghosts.mesh] : []),
        ...crosses.map((cross) => cross.object),
      );
      Object.assign(actor, this.#past(actor));
      for (const line of actor.trail.lines) line.visible = trail.whole.visible;
      if (ghosts) actor.ghosts.mesh.visible = ghosts.mesh.visible;
      trail.dispose();
      ghosts?.dispose();
      for (const cross of crosses) cross.dispose();
    }
    setDetail(this.scene, Boolean(this.shown?.coarse));
    this.cameras.cover(this.#box());
    this.update(this.time);
  }

  /** The second run's bodies are tinted and translucent. */
  #veil(object) {
    object.traverse((mesh) => {
      if (!mesh.isMesh) return;
      mesh.castShadow = false;
      mesh.material = new MeshLambertMaterial({
        color: OTHER,
        transparent: true,
        opacity: 0.5,
        depthWrite: false,
      });
    });
  }

  recolour() {
    const colours = theme();
    this.light.intensity = colours.sun;
    this.around.intensity = colours.sky;
    this.around.groundColor.set(colours.ground);
    this.scene.background = new Color(colours.horizon);
    this.water?.colour(colours);
    this.backdrop?.colour(colours);
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
    this.cameras.choose(mode, this.subject, this.#group());
    this.update(this.time);
  }

  /** Set the poses of all bodies at a time. */
  update(time) {
    this.time = time;
    for (const { run, body, object, trail, ghosts, crosses } of this.actors) {
      const { position, orientation } = run.pose(body, time);
      object.position.copy(position);
      object.quaternion.copy(orientation);
      trail.update(run.place(time).row, position);
      ghosts?.update(time);
      for (const cross of crosses) cross.update(time);
    }
    this.light.target.position.copy(this.subject.position);
    this.light.position.copy(this.subject.position).addScaledVector(SUN, 10);
    this.cameras.update(this.subject, this.#group(), this.#mounted());
    this.#moveWater(time);
    this.request();
  }

  #mounted() {
    const view = this.cameras.views[this.cameras.mode];
    const actor = view && this.own.find(({ body }) => body.name === view.on);
    return (
      actor && {
        position: actor.position,
        yaw: new Euler().setFromQuaternion(actor.object.quaternion, "ZYX").z,
      }
    );
  }

  #moveWater(time) {
    if (!this.water) return;
    const gain = this.runs[0].has(this.water.gain) ? this.runs[0].value(this.water.gain, time) : 1;
    this.water.update(time, gain, this.cameras.controls.target, this.own);
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.renderer.domElement.parentElement;
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.cameras.resize(width, height);
    this.request();
  }

  request() {
    this.stale = true;
  }

  /**
   * Render at the wall time `now` (ms) after a change; `elapsed` is the time since the last
   * frame (ms) if the replay is playing.
   */
  draw(now, elapsed) {
    if (this.stale) {
      this.stale = false;
      this.changed = now;
      if (elapsed) this.quality.took(elapsed);
      this.#render(this.quality.moving);
    } else if (this.shown !== FINEST && now - this.changed > REST) {
      this.#render(FINEST);
    }
  }

  #render(how) {
    if (this.shown !== how) this.#turn(how);
    else this.renderer.shadowMap.needsUpdate = this.frames % how.shadows === 0;
    this.frames += 1;
    this.renderer.render(this.scene, this.cameras.camera);
  }

  /** Set the quality of the following frames. */
  #turn(how) {
    this.shown = how;
    this.renderer.setPixelRatio(Math.min(this.most, how.ratio));
    this.renderer.shadowMap.needsUpdate = true;
    setDetail(this.scene, how.coarse);
    this.water?.light(how.coarse);
  }
}
