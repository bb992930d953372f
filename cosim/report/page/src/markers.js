// Waypoints: a ring of acceptance on the water and a number above it.
import { CanvasTexture, DoubleSide, Group, Mesh, MeshBasicMaterial, RingGeometry, Sprite, SpriteMaterial } from "three";

function label(text) {
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 96;
  const pen = canvas.getContext("2d");
  pen.fillStyle = "rgba(20, 30, 40, 0.78)";
  pen.beginPath();
  pen.arc(48, 48, 42, 0, 2 * Math.PI);
  pen.fill();
  pen.fillStyle = "#ffffff";
  pen.font = `600 ${text.length > 2 ? 34 : 46}px system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, 48, 51);
  const map = new CanvasTexture(canvas);
  const sprite = new Sprite(new SpriteMaterial({ map, sizeAttenuation: false, depthTest: false, transparent: true }));
  sprite.scale.setScalar(0.026);
  return sprite;
}

export function markerOf({ position: [x, y, z], radius, label: text }) {
  const group = new Group();
  group.position.set(x, y, z);
  const width = Math.max(0.035, 0.05 * radius);
  const material = new MeshBasicMaterial({ color: "#ffb020", transparent: true, opacity: 0.9, side: DoubleSide });
  const ring = new Mesh(new RingGeometry(radius - width, radius, 64), material);
  ring.position.z = 0.02;
  const sign = label(text);
  sign.position.z = 0.4;
  group.add(ring, sign);
  return group;
}
