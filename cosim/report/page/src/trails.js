// Trails of bodies: the path, brighter in the past, and ghosts at earlier poses.
import {
  Box3,
  BufferGeometry,
  InstancedMesh,
  Line,
  LineBasicMaterial,
  Matrix4,
  MeshLambertMaterial,
  Vector3,
} from "three";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { detailed } from "./quality.js";
import { simplified } from "./simplified.js";

const MOST_POINTS = 2000; // before simplification
const MOST_GHOSTS = 24;
const FLAT = 1 / 6000; // tolerance of the simplification, relative to the extent of the path
// indices of a segment of a thick line without its caps, which are not visible
const QUAD = [2, 4, 3, 4, 5, 3];
const ONE = new Vector3(1, 1, 1);

/** At most `count` evenly spaced rows of a run, including the last one. */
function spread(run, count) {
  const last = run.time.length - 1;
  const stride = Math.max(1, Math.ceil(last / count));
  const rows = Array.from({ length: Math.floor(last / stride) + 1 }, (_, i) => i * stride);
  return rows[rows.length - 1] === last ? rows : [...rows, last];
}

export class Trail {
  /**
   * `end`: time after which the path does not count for the accuracy, because the body has
   * failed.
   */
  constructor(run, body, colour, isOther, end) {
    const rows = spread(run, MOST_POINTS).filter((row) =>
      run.position(body, row).toArray().every(Number.isFinite),
    );
    const places = rows.map((row) => run.position(body, row));
    const extent = new Box3().setFromPoints(places.filter((_, i) => run.time[rows[i]] <= end));
    const kept = simplified(places, FLAT * extent.getSize(new Vector3()).length());
    this.rows = kept.map((i) => rows[i]);
    this.points = kept.map((i) => places[i]);
    if (this.points.length === 1) this.points.push(this.points[0]); // a line has two ends
    const thin = new LineBasicMaterial({
      color: colour,
      transparent: true,
      opacity: 0.4,
      depthWrite: false,
    });
    this.whole = new Line(new BufferGeometry().setFromPoints(this.points), thin);
    const dashes = isOther ? { dashed: true, dashSize: 0.12, gapSize: 0.1 } : {};
    const thick = new LineMaterial({
      color: colour,
      linewidth: isOther ? 1.8 : 2.6,
      transparent: true,
      depthWrite: false,
      ...dashes,
    });
    this.past = new Line2(
      new LineGeometry().setPositions(this.points.flatMap((point) => point.toArray())),
      thick,
    );
    this.past.geometry.setIndex(QUAD);
    this.past.computeLineDistances();
    this.lines = [this.whole, this.past];
    for (const line of this.lines) line.frustumCulled = false;
  }

  dispose() {
    for (const line of this.lines) (line.geometry.dispose(), line.material.dispose());
  }

  /** Draw the path up to a row as past, up to the position of the body. */
  update(row, position) {
    let count = 0;
    while (count < this.rows.length - 2 && this.rows[count + 1] <= row) count++;
    const { geometry } = this.past;
    const ends = geometry.attributes.instanceEnd;
    ends.setXYZ(geometry.instanceCount - 1, ...this.points[geometry.instanceCount]);
    ends.setXYZ(count, ...position);
    ends.data.needsUpdate = true;
    geometry.instanceCount = count + 1;
    this.past.visible = this.whole.visible && row > this.rows[0];
  }
}

export class Ghosts {
  constructor(run, body, solid) {
    const duration = run.last - run.first;
    this.interval =
      [0.5, 1, 2, 5, 10, 20, 60, 300, 1800].find((step) => duration / step <= MOST_GHOSTS) ??
      duration / MOST_GHOSTS;
    this.first = run.first;
    const moments = Array.from(
      { length: Math.floor(duration / this.interval + 1e-6) + 1 },
      (_, i) => run.first + i * this.interval,
    );
    const material = new MeshLambertMaterial({
      vertexColors: true,
      transparent: true,
      opacity: 0.26,
      depthWrite: false,
    });
    const { fine, coarse } = solid.userData;
    this.mesh = detailed(new InstancedMesh(undefined, material, moments.length), fine, coarse);
    moments.forEach((moment, i) => {
      const { position, orientation } = run.pose(body, moment);
      this.mesh.setMatrixAt(i, new Matrix4().compose(position, orientation, ONE));
    });
    this.mesh.frustumCulled = false;
    this.mesh.visible = false;
  }

  dispose() {
    this.mesh.material.dispose();
    this.mesh.dispose();
  }

  /** Show the ghosts of the past. */
  update(time) {
    this.mesh.count = Math.floor((time - this.first) / this.interval + 1e-6) + 1;
  }
}
