// The backdrop: sky, hills and a wooded shore, in unlit colours, merged into one geometry.
import {
  BufferGeometry,
  CircleGeometry,
  Color,
  DoubleSide,
  Float32BufferAttribute,
  IcosahedronGeometry,
  MathUtils,
  Mesh,
  ShaderMaterial,
  Vector3,
} from "three";
import { mergeGeometries, mergeVertices } from "three/addons/utils/BufferGeometryUtils.js";
import { detailed } from "./quality.js";
import { SUN } from "./theme.js";

const SKY = 2600; // m, radius
const HILLS = [
  [2300, 120, 5],
  [1700, 62, 2],
]; // distance and mean height (m), and a number that shapes the ridge
// angles of its ends; m to the mission
const SHORE = { first: 0.42 * Math.PI, last: 0.86 * Math.PI, clearance: 45 };
const TREES = 56;
const RIDGE = Math.PI / 40; // angle between two points of hills and shore
const RISE = [0, 0.03, 0.12, 0.4, 1]; // heights of the rings of the sky, relative to its radius
const UNLIT = {
  vertexColors: true,
  side: DoubleSide,
  vertexShader:
    "varying vec3 tint; void main() { tint = color; " +
    "gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }",
  fragmentShader: "varying vec3 tint; void main() { gl_FragColor = vec4(tint, 1.0); }",
};

/** Repeatable numbers between 0 and 1 (Park and Miller 1988). */
function numbers(seed) {
  return () => (seed = (16807 * seed) % 2147483647) / 2147483647;
}

/** A strip between two lines of points of the same number. */
function strip(low, high, lowColour, highColour) {
  const places = [...low, ...high].flatMap((point) => point.toArray());
  const colours = [...low.map(() => lowColour), ...high.map(() => highColour)].flatMap((colour) =>
    colour.toArray(),
  );
  const cells = low
    .slice(1)
    .flatMap((_, i) => [i, i + 1, low.length + i, low.length + i, i + 1, low.length + i + 1]);
  const geometry = new BufferGeometry()
    .setIndex(cells)
    .setAttribute("position", new Float32BufferAttribute(places, 3));
  return geometry.setAttribute("color", new Float32BufferAttribute(colours, 3));
}

/**
 * An arc of points around the middle; `radius` and `height` (m) are functions of the angle
 * (rad).
 */
function arc(first, last, radius, height, step = RIDGE) {
  const count = Math.ceil((last - first) / step);
  return Array.from({ length: count + 1 }, (_, i) => {
    const angle = first + ((last - first) * i) / count;
    return new Vector3(
      radius(angle) * Math.cos(angle),
      radius(angle) * Math.sin(angle),
      height(angle),
    );
  });
}

const circle = (radius, height, step) => arc(0, 2 * Math.PI, () => radius, height, step);

function sky({ horizon, zenith }) {
  const [low, high] = [new Color(horizon), new Color(zenith)];
  const rings = RISE.map((rise) => ({
    colour: low.clone().lerp(high, rise ** 0.45),
    points: circle(SKY * Math.sqrt(1.01 - rise * rise), () => SKY * rise, Math.PI / 10),
  }));
  return rings
    .slice(1)
    .map((ring, i) => strip(rings[i].points, ring.points, rings[i].colour, ring.colour));
}

function hills({ horizon, hill }) {
  return HILLS.map(([distance, height, shape], i) => {
    const ridge = (angle) =>
      height * (1 + 0.35 * Math.sin(shape * angle) + 0.22 * Math.sin((2 * shape + 1) * angle + 1));
    const colour = new Color(horizon).lerp(new Color(hill), 0.35 + 0.4 * i);
    const foot = colour.clone().lerp(new Color(horizon), 0.5);
    return strip(
      circle(distance, () => 0),
      circle(distance, ridge),
      foot,
      colour,
    );
  });
}

/** Beach and meadow, which end in a point at both ends of the shore. */
function shore(near, { beach, meadow, hill }) {
  const { first, last } = SHORE;
  const bulge = (angle) => Math.sin((Math.PI * (angle - first)) / (last - first));
  const line = (angle) => near * (1.05 + 0.04 * Math.sin(9 * angle) - 0.05 * bulge(angle));
  const at = (away, height) =>
    arc(
      first,
      last,
      (angle) => line(angle) + away * bulge(angle),
      (angle) => height * bulge(angle),
    );
  const lines = [
    [at(0, 0), beach],
    [at(2.5, 0.5), beach],
    [at(3, 0.6), meadow],
    [at(0.5 * near, 7), hill],
  ];
  return {
    strips: lines
      .slice(1)
      .map(([points, colour], i) =>
        strip(lines[i][0], points, new Color(lines[i][1]), new Color(colour)),
      ),
    line,
    bulge,
  };
}

/** A ball, or a disk that faces the middle. */
function round(angle, fine) {
  const geometry = fine
    ? new IcosahedronGeometry(1, 2)
    : new CircleGeometry(1, 10).rotateX(Math.PI / 2).rotateZ(angle - Math.PI / 2);
  return mergeVertices(geometry.deleteAttribute("uv").deleteAttribute("normal"));
}

/** Leaves, brighter towards the sun. */
function leaves(radius, place, colour, fine) {
  const ball = round(Math.atan2(place[1], place[0]), fine);
  const places = ball.attributes.position;
  const light = new Vector3(0.5 * SUN.x, 0.5 * SUN.y, 1).normalize();
  const colours = Array.from({ length: places.count }, (_, i) => {
    const towards = new Vector3().fromBufferAttribute(places, i).dot(light);
    return new Color(colour).multiplyScalar(0.82 + 0.3 * towards).toArray();
  });
  ball.setAttribute("color", new Float32BufferAttribute(colours.flat(), 3));
  return ball.scale(radius, radius, radius).translate(...place);
}

function trees({ line, bulge }, { trees: greens }, fine) {
  const number = numbers(7);
  return Array.from({ length: TREES }, () => {
    const angle = MathUtils.lerp(
      SHORE.first,
      SHORE.last,
      0.06 + 0.88 * (0.5 + 0.5 * Math.sin(2.7 * Math.PI * (number() - 0.5))),
    );
    const away = line(angle) + 4 + 12 * number() * bulge(angle);
    const [size, green] = [2 + 1.6 * number(), greens[Math.floor(greens.length * number())]];
    const place = new Vector3(away * Math.cos(angle), away * Math.sin(angle), 0.8 + 1.15 * size);
    const balls = [
      [1, 0, 0, 0],
      [0.72, 0.75, 0.1, -0.25],
      [0.66, -0.7, -0.2, -0.3],
    ].slice(0, fine ? 3 : 1);
    return balls.map(([scale, x, y, z]) =>
      leaves(
        size * scale,
        place
          .clone()
          .addScaledVector(new Vector3(x, y, z), size)
          .toArray(),
        green,
        fine,
      ),
    );
  }).flat();
}

export class Backdrop {
  /** `reach`: largest distance of the mission from its middle (m). */
  constructor(centre, reach) {
    this.near = reach + SHORE.clearance;
    this.object = detailed(new Mesh(undefined, new ShaderMaterial(UNLIT)), null, null);
    this.object.position.set(centre.x, centre.y, 0);
    this.object.frustumCulled = false;
  }

  colour(palette) {
    this.object.userData.fine?.dispose();
    this.object.userData.coarse?.dispose();
    const land = shore(this.near, palette);
    // what is near comes first, so that nothing is drawn over
    const make = (fine) =>
      mergeGeometries([
        ...trees(land, palette, fine),
        ...land.strips,
        ...hills(palette).reverse(),
        ...sky(palette),
      ]);
    detailed(this.object, make(true), make(false));
  }
}
