// Bodies made of coloured parts: each becomes one geometry, so that it is one draw call.
import {
  BoxGeometry, Color, CylinderGeometry, DoubleSide, Float32BufferAttribute, Group, Matrix4, Mesh, MeshLambertMaterial,
  Quaternion, SphereGeometry, TorusGeometry, Vector3,
} from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import { RoundedBoxGeometry } from "three/addons/geometries/RoundedBoxGeometry.js";

const UP = new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), Math.PI / 2); // a cylinder's axis from y to z

const SHAPES = {
  box: ([x, y, z]) => {
    const bevel = Math.min(0.12 * Math.min(x, y, z), 0.015);
    return bevel > 5e-4 ? new RoundedBoxGeometry(x, y, z, 1, bevel) : new BoxGeometry(x, y, z);
  },
  cylinder: ([radius, length]) => new CylinderGeometry(radius, radius, length, radius > 0.05 ? 40 : 14).applyQuaternion(UP),
  cone: ([low, high, length]) => new CylinderGeometry(high, low, length, 20).applyQuaternion(UP),
  sphere: ([radius]) => new SphereGeometry(radius, 20, 14),
  ring: ([radius, thickness]) => new TorusGeometry(radius, thickness, 8, 56),
};

/** One geometry with vertex colours of all parts; null where there are none. */
export function geometryOf(parts) {
  const pieces = parts.map((part) => {
    const shape = SHAPES[part.shape](part.size);
    const piece = shape.index ? shape.toNonIndexed() : shape;
    const [x, y, z, w] = part.orientation;
    piece.applyMatrix4(new Matrix4().compose(new Vector3(...part.position), new Quaternion(x, y, z, w), new Vector3(1, 1, 1)));
    piece.deleteAttribute("uv");
    const colour = new Color().setRGB(...part.colour);
    const colours = new Float32Array(piece.attributes.position.count * 3);
    for (let i = 0; i < colours.length; i += 3) colour.toArray(colours, i);
    piece.setAttribute("color", new Float32BufferAttribute(colours, 3));
    return piece;
  });
  return pieces.length ? mergeGeometries(pieces) : null;
}

/** A group of solid and of translucent parts. */
export function bodyOf(parts) {
  const group = new Group();
  const solid = geometryOf(parts.filter((part) => part.opacity === 1));
  if (solid) {
    const mesh = new Mesh(solid, new MeshLambertMaterial({ vertexColors: true }));
    mesh.castShadow = mesh.receiveShadow = true;
    group.add(mesh);
  }
  for (const opacity of new Set(parts.map((part) => part.opacity).filter((value) => value < 1))) {
    const geometry = geometryOf(parts.filter((part) => part.opacity === opacity));
    const material = new MeshLambertMaterial({ vertexColors: true, transparent: true, opacity, depthWrite: false, side: DoubleSide });
    group.add(new Mesh(geometry, material));
  }
  return group;
}

/** Largest distance of a body's parts from its origin (m). */
export function reachOf(parts) {
  return Math.max(0.1, ...parts.map((part) => Math.hypot(...part.position) + Math.max(...part.size) / 2));
}
