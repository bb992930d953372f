// Bodies made of coloured parts; parts of the same opacity are merged into one geometry, so that
// they need one draw call.
import {
  BoxGeometry,
  BufferGeometry,
  Color,
  CylinderGeometry,
  DoubleSide,
  Float32BufferAttribute,
  Group,
  Matrix4,
  Mesh,
  MeshLambertMaterial,
  Quaternion,
  SphereGeometry,
  TorusGeometry,
  Vector3,
} from "three";
import { mergeGeometries, mergeVertices } from "three/addons/utils/BufferGeometryUtils.js";
import { RoundedBoxGeometry } from "three/addons/geometries/RoundedBoxGeometry.js";
import { detailed } from "./quality.js";

// turns a cylinder's axis from y to z
const UP = new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), Math.PI / 2);

const SHAPES = {
  box: ([x, y, z], fine) => {
    const bevel = Math.min(0.12 * Math.min(x, y, z), 0.015);
    return fine && bevel > 5e-4
      ? new RoundedBoxGeometry(x, y, z, 1, bevel)
      : new BoxGeometry(x, y, z);
  },
  cylinder: ([radius, length], fine) => {
    const sides = radius > 0.05 ? (fine ? 40 : 24) : fine ? 14 : 7;
    return new CylinderGeometry(radius, radius, length, sides).applyQuaternion(UP);
  },
  cone: ([low, high, length], fine) =>
    new CylinderGeometry(high, low, length, fine ? 20 : 10).applyQuaternion(UP),
  sphere: ([radius], fine) => new SphereGeometry(radius, ...(fine ? [20, 14] : [12, 8])),
  mesh: (corners) => {
    const triangles = new BufferGeometry().setAttribute(
      "position",
      new Float32BufferAttribute(corners, 3),
    );
    triangles.computeVertexNormals();
    return triangles;
  },
  ring: ([radius, thickness], fine) =>
    new TorusGeometry(radius, thickness, ...(fine ? [8, 56] : [5, 32])),
};

/** One geometry of all parts, with vertex colours. */
function geometryOf(parts, fine) {
  return mergeGeometries(
    parts.map((part) => {
      const shape = SHAPES[part.shape](part.size, fine).deleteAttribute("uv");
      const piece = shape.index ? shape : mergeVertices(shape);
      const [x, y, z, w] = part.orientation;
      piece.applyMatrix4(
        new Matrix4().compose(
          new Vector3(...part.position),
          new Quaternion(x, y, z, w),
          new Vector3(1, 1, 1),
        ),
      );
      const colour = new Color().setRGB(...part.colour);
      const colours = new Float32Array(piece.attributes.position.count * 3);
      for (let i = 0; i < colours.length; i += 3) colour.toArray(colours, i);
      return piece.setAttribute("color", new Float32BufferAttribute(colours, 3));
    }),
  );
}

function meshOf(parts, look) {
  const material = new MeshLambertMaterial({ vertexColors: true, ...look });
  return detailed(new Mesh(undefined, material), geometryOf(parts, true), geometryOf(parts, false));
}

/**
 * A group of opaque and translucent parts; `solid` is the mesh of the opaque ones, if there are
 * any.
 */
export function bodyOf(parts) {
  const group = new Group();
  const opaque = parts.filter((part) => part.opacity === 1);
  if (opaque.length) {
    group.solid = meshOf(opaque, {});
    group.solid.castShadow = group.solid.receiveShadow = true;
    group.add(group.solid);
  }
  for (const opacity of new Set(parts.map((part) => part.opacity).filter((value) => value < 1))) {
    const look = {
      transparent: true,
      opacity,
      depthWrite: false,
      side: DoubleSide,
      forceSinglePass: true,
    };
    group.add(
      meshOf(
        parts.filter((part) => part.opacity === opacity),
        look,
      ),
    );
  }
  return group;
}

/** Largest distance of a body's parts from its origin (m). */
export function reachOf(parts) {
  return Math.max(
    0.1,
    ...parts.map(
      (part) => Math.hypot(...part.position) + part.size.reduce((a, b) => Math.max(a, b), 0) / 2,
    ),
  );
}
