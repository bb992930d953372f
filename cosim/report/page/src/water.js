// Water as one plane, displaced by the waves of the run, with ripples, a mirror image and soft
// shadows of vehicles.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  CustomBlending,
  Group,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  Mesh,
  PlaneGeometry,
  ShaderMaterial,
  Vector2,
  Vector4,
} from "three";
import { Reflector } from "three/addons/objects/Reflector.js";
import { detailed } from "./quality.js";
import { SUN } from "./theme.js";
import { FINE, MOST_WAVES, SHADE, WATER } from "./water_shaders.js";

const MOST_SHADES = 16;
const REACH = 600; // m from the centre
const IMAGE = { textureWidth: 1024, textureHeight: 512, multisample: 0 }; // of the mirror image
// number of cells along each side, fine and coarse
const CELLS = { calm: [64, 32], waves: [160, 60] };

/** A square mesh that is finer in its middle. */
function mesh(count) {
  const line = Array.from({ length: count + 1 }, (_, i) => {
    const s = (2 * i) / count - 1;
    return Math.sign(s) * (1.6 * FINE * Math.abs(s) + (REACH - 1.6 * FINE) * Math.abs(s) ** 7);
  });
  const places = new Float32Array(line.flatMap((y) => line.flatMap((x) => [x, y, 0])));
  const cells = [];
  for (let j = 0; j < count; j++) {
    for (let i = 0; i < count; i++) {
      const a = j * (count + 1) + i;
      cells.push(a, a + 1, a + count + 2, a, a + count + 2, a + count + 1);
    }
  }
  const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(places, 3));
  return geometry.setIndex(cells);
}

/** Soft shadows of vehicles: patches that are drawn on the water before everything else. */
function shades(uniforms) {
  const patch = new PlaneGeometry(2, 2, 4, 4);
  const geometry = new InstancedBufferGeometry()
    .setIndex(patch.index)
    .setAttribute("position", patch.attributes.position);
  geometry.setAttribute(
    "shade",
    new InstancedBufferAttribute(new Float32Array(4 * MOST_SHADES), 4),
  );
  // not `transparent`, which would be drawn last
  const blended = { blending: CustomBlending, depthTest: false, depthWrite: false };
  return new Mesh(geometry, new ShaderMaterial({ uniforms, ...SHADE, ...blended }));
}

export class Water {
  constructor(spec) {
    this.waves = spec.waves;
    this.gain = spec.gain;
    this.uniforms = {
      waves: { value: Array.from({ length: MOST_WAVES }, () => new Vector4()) },
      count: { value: 0 },
      centre: { value: new Vector2() },
      time: { value: 0 },
      sun: { value: SUN },
      strength: { value: 0 },
      deep: { value: new Color() },
      zenith: { value: new Color() },
      horizon: { value: new Color() },
    };
    const [fine, coarse] = spec.waves.length ? CELLS.waves : CELLS.calm;
    this.surface = detailed(this.#mirror(), mesh(fine), mesh(coarse));
    this.shades = shades(this.uniforms);
    this.object = new Group().add(this.surface, this.shades);
    this.object.children.forEach((child, i) =>
      Object.assign(child, { frustumCulled: false, renderOrder: i - 2 }),
    );
  }

  /**
   * A surface that draws the mirror image of layer 0 before it is drawn itself; it shares the
   * uniforms of the shadows.
   */
  #mirror() {
    const images = {
      color: { value: null },
      tDiffuse: { value: null },
      textureMatrix: { value: null },
    };
    const surface = new Reflector(undefined, { ...IMAGE, shader: { uniforms: images, ...WATER } });
    Object.assign(surface.material.uniforms, this.uniforms);
    this.reflect = surface.onBeforeRender;
    const imageCamera = surface.getReflectionCamera;
    surface.getReflectionCamera = (camera) => {
      const image = imageCamera.call(surface, camera);
      image.layers.set(0);
      return image;
    };
    return surface;
  }

  /** True if the water is lit per vertex, without a mirror image. */
  light(coarse) {
    this.surface.onBeforeRender = coarse ? () => {} : this.reflect;
    this.surface.material.defines = coarse ? { COARSE: "" } : {};
    this.surface.material.needsUpdate = true;
  }

  colour({ deep, zenith, horizon, shade }) {
    this.uniforms.deep.value.set(deep);
    this.uniforms.zenith.value.set(zenith);
    this.uniforms.horizon.value.set(horizon);
    this.uniforms.strength.value = shade;
  }

  /** The elevation is gain * sum a cos(k (x cos d + y sin d) - w t + phase). */
  update(time, gain, centre, bodies) {
    const list = this.uniforms.waves.value;
    this.waves.forEach((wave, i) => {
      const phase = (wave.phase - wave.frequency * time) % (2 * Math.PI);
      list[i].set(
        gain * wave.amplitude,
        wave.number * Math.cos(wave.direction),
        wave.number * Math.sin(wave.direction),
        phase,
      );
    });
    this.uniforms.count.value = gain ? Math.min(this.waves.length, MOST_WAVES) : 0;
    this.uniforms.time.value = time % 1000;
    this.uniforms.centre.value.copy(centre);
    this.#shade(bodies.slice(0, MOST_SHADES));
  }

  /** Shadows of bodies; they are softer at greater heights. */
  #shade(bodies) {
    const { shade } = this.shades.geometry.attributes;
    bodies.forEach(({ position, reach }, i) => {
      const height = Math.max(position.z, 0);
      const [x, y] = ["x", "y"].map((axis) => position[axis] - (SUN[axis] / SUN.z) * height);
      shade.setXYZW(i, x, y, 0.62 * reach * (1 + 0.15 * height), 1 / (1 + 0.5 * height));
    });
    shade.needsUpdate = true;
    this.shades.geometry.instanceCount = bodies.length;
  }

  /** Height of the water at a position (m). */
  height(x, y) {
    const { waves, count } = this.uniforms;
    return waves.value
      .slice(0, count.value)
      .reduce((sum, w) => sum + w.x * Math.cos(w.y * x + w.z * y + w.w), 0);
  }
}
