// Cameras: one orbiting camera, which follows a vehicle in some of its modes.
import { Box3, MathUtils, PerspectiveCamera, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

const FROM = new Vector3(0.45, -0.86, 0.42).normalize();

export class Cameras {
  constructor(canvas, box, views) {
    this.camera = new PerspectiveCamera(34, 1, 0.08, 2500);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = 0.496 * Math.PI;
    this.controls.minDistance = 0.5;
    this.controls.maxDistance = 400;
    this.cover(box);
    this.views = views;
    this.mode = "orbit";
    this.carried = new Vector3();
  }

  /** Set the box that contains all bodies so far. */
  cover(box) {
    this.centre = box.getCenter(new Vector3());
    this.size = box.getSize(new Vector3()).length();
  }

  /** Select a camera: "orbit", "chase", "top", or a view that is fixed to a body. `subject` is the followed body. */
  choose(mode, subject) {
    this.mode = mode;
    this.controls.enabled = !(mode in this.views);
    this.controls.enableRotate = mode !== "top";
    const place = mode === "chase" ? subject.position : this.centre;
    this.carried.copy(place);
    this.controls.target.copy(place);
    const distance = mode === "chase" ? 2.2 + 2.6 * subject.reach : this.#fitting();
    const away = mode === "top" ? new Vector3(0, -1e-3, 1) : FROM;
    this.camera.position.copy(place).addScaledVector(away, distance);
    this.update(subject);
  }

  /** Distance from which all bodies are visible. */
  #fitting() {
    const half = MathUtils.degToRad(this.camera.fov / 2);
    const narrow = Math.min(1, this.camera.aspect);
    return MathUtils.clamp((0.36 * this.size) / Math.tan(half) / narrow, 2.5, 350);
  }

  resize(width, height) {
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
  }

  /** Move with the subject, or with the body that the camera is mounted on. */
  update(subject, mounted) {
    const view = this.views[this.mode];
    if (view && mounted) {
      const turned = ([x, y, z]) => new Vector3(x, y, z).applyAxisAngle(this.camera.up, mounted.yaw).add(mounted.position);
      this.camera.position.copy(turned(view.eye));
      this.camera.lookAt(turned(view.target));
      return;
    }
    if (this.mode === "chase") {
      const step = subject.position.clone().sub(this.carried);
      this.carried.copy(subject.position);
      this.controls.target.add(step);
      this.camera.position.add(step);
    }
    this.controls.update();
  }
}

const FAR = 8; // distance of an outlier over the median distance

/** The positions without those that are far from the median position, compared with the others. */
export function withoutOutliers(places) {
  const median = (values) => values.sort((a, b) => a - b)[values.length >> 1] ?? 0;
  const middle = new Vector3(...["x", "y", "z"].map((axis) => median(places.map((place) => place[axis]))));
  const limit = FAR * Math.max(1, median(places.map((place) => place.distanceTo(middle))));
  return places.filter((place) => place.distanceTo(middle) <= limit);
}

/** The bounding box of positions, enlarged by half a metre. */
export function boxAround(places) {
  return new Box3().setFromPoints(places).expandByScalar(0.5);
}
