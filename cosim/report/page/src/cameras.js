// Cameras: one orbiting camera, which follows a vehicle or all of them in some of its modes.
import { Box3, MathUtils, PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

// layer of what is drawn into the scene, but is no part of it: trails, marks and waypoints
export const SIGNS = 1;

const FROM = new Vector3(0.45, -0.86, 0.21).normalize();

export class Cameras {
  constructor(canvas, box, views) {
    this.camera = new PerspectiveCamera(34, 1, 0.08, 3000);
    this.camera.up.set(0, 0, 1);
    this.camera.layers.enable(SIGNS);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = 0.496 * Math.PI;
    this.controls.minDistance = 0.5;
    this.controls.maxDistance = 400;
    this.cover(box);
    this.views = views;
    this.mode = "orbit";
    this.carried = new Vector3();
    this.spread = 1;
  }

  /** Set the box that contains all bodies so far. */
  cover(box) {
    this.centre = box.getCenter(new Vector3());
    this.size = box.getSize(new Vector3()).length();
  }

  /**
   * Select a camera: "group" (follows all vehicles), "orbit" (shows the whole mission), "chase"
   * (follows the subject), "top", or a view that is fixed to a body. `subject` is the followed
   * body, `group` the sphere around all vehicles.
   */
  choose(mode, subject, group) {
    this.mode = mode;
    this.controls.enabled = !(mode in this.views);
    this.controls.enableRotate = mode !== "top";
    const place = { chase: subject.position, group: group.center }[mode] ?? this.centre;
    this.carried.copy(place);
    this.spread = group.radius;
    this.controls.target.copy(place);
    const distance =
      { chase: 2.2 + 2.6 * subject.reach, group: this.#around(group) }[mode] ?? this.#fitting();
    const away = mode === "top" ? new Vector3(0, -1e-3, 1) : FROM;
    this.camera.position.copy(place).addScaledVector(away, distance);
    this.update(subject, group);
  }

  /** Distance from which all bodies are visible. */
  #fitting() {
    return MathUtils.clamp((0.36 * this.size) / this.#tangent / this.#width, 2.5, 350);
  }

  /**
   * Distance from which a sphere of vehicles, which lie beside each other rather than above,
   * fills the picture.
   */
  #around({ radius }) {
    return MathUtils.clamp((1.15 * radius) / this.#tangent / this.#width, 2, 350);
  }

  /** The part of the picture's width over its height that counts for the distance in this mode. */
  get #width() {
    const { aspect } = this.camera;
    return (
      {
        group: MathUtils.clamp(aspect, 0.5, 1.7),
        orbit: Math.min(1, aspect),
        top: Math.min(1, aspect),
      }[this.mode] ?? 1
    );
  }

  get #tangent() {
    return Math.tan(MathUtils.degToRad(this.camera.fov / 2));
  }

  /** Set the size of the picture; the camera keeps as much of the scene in it. */
  resize(width, height) {
    const before = this.#width;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    const { target } = this.controls;
    this.camera.position
      .sub(target)
      .multiplyScalar(before / this.#width)
      .add(target);
  }

  /** Move with the subject or the group, or with the body that the camera is mounted on. */
  update(subject, group, mounted) {
    const view = this.views[this.mode];
    if (view && mounted) {
      const turned = ([x, y, z]) =>
        new Vector3(x, y, z).applyAxisAngle(this.camera.up, mounted.yaw).add(mounted.position);
      this.camera.position.copy(turned(view.eye));
      this.camera.lookAt(turned(view.target));
      return;
    }
    if (this.mode === "chase") this.#carry(subject.position);
    if (this.mode === "group") {
      this.#carry(group.center);
      const away = this.camera.position
        .sub(this.controls.target)
        .multiplyScalar(group.radius / this.spread);
      away.add(this.controls.target);
      this.spread = group.radius;
    }
    this.controls.update();
  }

  #carry(place) {
    const step = place.clone().sub(this.carried);
    this.carried.copy(place);
    this.controls.target.add(step);
    this.camera.position.add(step);
  }
}

const FAR = 8; // distance of an outlier over the median distance

/** The positions without those that are far from the median position, compared with the others. */
export function withoutOutliers(places) {
  const median = (values) => values.sort((a, b) => a - b)[values.length >> 1] ?? 0;
  const middle = new Vector3(
    ...["x", "y", "z"].map((axis) => median(places.map((place) => place[axis]))),
  );
  const limit = FAR * Math.max(1, median(places.map((place) => place.distanceTo(middle))));
  return places.filter((place) => place.distanceTo(middle) <= limit);
}

/** The bounding box of positions, enlarged by half a metre. */
export function boxAround(places) {
  return new Box3().setFromPoints(places).expandByScalar(0.5);
}
