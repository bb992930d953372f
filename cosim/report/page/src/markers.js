// Waypoints: circles of acceptance on the water, merged into one draw call, with numbers above
// them.
import {
  CanvasTexture,
  DoubleSide,
  Group,
  Mesh,
  MeshBasicMaterial,
  RingGeometry,
  Sprite,
  SpriteMaterial,
} from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";

/** A disk with a text, of the same size at every distance. */
export function label(text, colour = "rgba(20, 30, 40, 0.78)") {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 96;
  const pen = canvas.getContext("2d");
  pen.fillStyle = colour;
  pen.beginPath();
  pen.arc(48, 48, 42, 0, 2 * Math.PI);
  pen.fill();
  pen.fillStyle = "#ffffff";
  pen.font = `600 ${text.length > 2 ? 34 : 46}px system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, 48, 51);
  const map = new CanvasTexture(canvas);
  const sprite = new Sprite(
    new SpriteMaterial({ map, sizeAttenuation: false, depthTest: false, transparent: true }),
  );
  sprite.scale.setScalar(0.026);
  return sprite;
}

function ring({ position: [x, y, z], radius }) {
  const width = Math.max(0.035, 0.05 * radius);
  return new RingGeometry(radius - width, radius, 64).translate(x, y, z + 0.02);
}

function sign({ position: [x, y, z], label: text }) {
  const sprite = label(text);
  sprite.position.set(x, y, z + 0.4);
  return sprite;
}

export function markersOf(places) {
  if (!places.length) return new Group();
  const material = new MeshBasicMaterial({
    color: "#ffb020",
    transparent: true,
    opacity: 0.9,
    side: DoubleSide,
    forceSinglePass: true,
  });
  return new Group().add(
    new Mesh(mergeGeometries(places.map(ring)), material),
    ...places.map(sign),
  );
}
