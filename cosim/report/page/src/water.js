// Water as one plane: the run's waves lift it, ripples and a metre grid give it scale, vehicles darken it below them.
import { BufferAttribute, BufferGeometry, Color, Mesh, ShaderMaterial, Vector2, Vector3, Vector4 } from "three";

const MOST_WAVES = 64;
const MOST_SHADES = 16;
const REACH = 600; // m
const CELLS = { calm: 64, waves: 160 };
const FINE = 26; // m: to here the mesh is as fine as waves need it

const VERTEX = `
uniform vec4 waves[${MOST_WAVES}];
uniform int count;
uniform vec2 centre;
uniform float time;
varying vec3 place;
varying vec2 slope;
varying float haze;
vec2 ripple(vec2 at, vec2 number, float angle) {
  return 0.013 * normalize(number) * cos(dot(number, at) + angle);
}
void main() {
  place = vec3(position.xy + centre, 0.0);
  slope = ripple(place.xy, vec2(1.7, 0.8), 1.1 * time) + ripple(place.xy, vec2(-0.9, 2.1), -1.4 * time)
    + ripple(place.xy, vec2(2.3, -1.9), 1.8 * time);
  float fade = 1.0 - smoothstep(${FINE}.0, ${2 * FINE}.0, length(position.xy));
  for (int i = 0; i < count; i++) {
    float angle = dot(waves[i].yz, place.xy) + waves[i].w;
    place.z += waves[i].x * cos(angle);
    slope += waves[i].x * sin(angle) * waves[i].yz;
  }
  place.z *= fade;
  slope *= fade;
  float range = distance(cameraPosition, place);
  haze = 1.0 - exp(-range * range / 20000.0);
  gl_Position = projectionMatrix * viewMatrix * vec4(place, 1.0);
}`;

const FRAGMENT = `
uniform vec3 deep, shallow, horizon, ink, sun;
uniform float shade;
uniform vec4 shades[${MOST_SHADES}]; // x, y, reach of the shadow, how dark it is
uniform vec4 shaded; // a rectangle around all: the lowest x and y, the highest
uniform int shadeCount;
varying vec3 place;
varying vec2 slope;
varying float haze;
float lines(float pitch, vec2 width) {
  vec2 off = abs(fract(place.xy / pitch - 0.5) - 0.5) * pitch;
  vec2 line = clamp(1.4 - off / width, 0.0, 1.0);
  return max(line.x, line.y) * clamp(1.2 - 5.0 * max(width.x, width.y) / pitch, 0.0, 1.0);
}
void main() {
  vec3 ray = normalize(cameraPosition - place);
  vec3 normal = normalize(vec3(slope, 1.0));
  float grazing = 1.0 - max(dot(ray, normal), 0.0);
  vec3 colour = mix(deep, shallow, 0.12 + 0.88 * grazing * grazing * grazing) + shallow * dot(normal.xy, sun.xy);
  float glint = max(dot(reflect(-sun, normal), ray), 0.0);
  glint *= glint; glint *= glint; glint *= glint; glint *= glint;
  colour += 0.10 * glint * glint;
  vec2 width = fwidth(place.xy) + 0.003;
  colour = mix(colour, ink, 0.05 * lines(1.0, width) + 0.08 * lines(5.0, width));
  if (all(greaterThan(place.xy, shaded.xy)) && all(lessThan(place.xy, shaded.zw))) {
    float dark = 0.0;
    for (int i = 0; i < shadeCount; i++) {
      vec2 off = place.xy - shades[i].xy;
      float depth = max(1.0 - dot(off, off) / (shades[i].z * shades[i].z), 0.0);
      dark += depth * depth * shades[i].w;
    }
    colour *= 1.0 - shade * min(dark, 1.0);
  }
  gl_FragColor = vec4(mix(colour, horizon, haze), 1.0);
}`;

/** A square mesh that is fine in its middle. */
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

export class Water {
  constructor(spec) {
    this.waves = spec.waves;
    this.gain = spec.gain;
    const empty = (n) => Array.from({ length: n }, () => new Vector4());
    this.uniforms = {
      waves: { value: empty(MOST_WAVES) }, count: { value: 0 }, centre: { value: new Vector2() }, time: { value: 0 },
      deep: { value: new Color() }, shallow: { value: new Color() }, horizon: { value: new Color() }, ink: { value: new Color() },
      shade: { value: 0 }, sun: { value: new Vector3(-0.45, -0.6, 0.66).normalize() },
      shades: { value: empty(MOST_SHADES) }, shaded: { value: new Vector4() }, shadeCount: { value: 0 },
    };
    const material = new ShaderMaterial({ uniforms: this.uniforms, vertexShader: VERTEX, fragmentShader: FRAGMENT });
    this.mesh = new Mesh(mesh(spec.waves.length ? CELLS.waves : CELLS.calm), material);
    this.mesh.frustumCulled = false;
  }

  colour({ deep, shallow, horizon, line, shade }) {
    this.uniforms.deep.value.set(deep);
    this.uniforms.shallow.value.set(shallow);
    this.uniforms.horizon.value.set(horizon);
    this.uniforms.ink.value.set(line);
    this.uniforms.shade.value = shade;
  }

  /** The elevation is gain * sum a cos(k (x cos d + y sin d) - w t + phase). */
  update(time, gain, centre, bodies) {
    const list = this.uniforms.waves.value;
    this.waves.forEach((wave, i) => {
      const phase = (wave.phase - wave.frequency * time) % (2 * Math.PI);
      list[i].set(gain * wave.amplitude, wave.number * Math.cos(wave.direction), wave.number * Math.sin(wave.direction), phase);
    });
    this.uniforms.count.value = gain ? Math.min(this.waves.length, MOST_WAVES) : 0;
    this.uniforms.time.value = time % 1000;
    this.uniforms.centre.value.copy(centre);
    this.#shade(bodies.slice(0, MOST_SHADES));
  }

  /** Shadows of bodies, softer the higher they are. */
  #shade(bodies) {
    const { shades, shaded, shadeCount, sun } = this.uniforms;
    shaded.value.set(Infinity, Infinity, -Infinity, -Infinity);
    shadeCount.value = bodies.length;
    bodies.forEach(({ position, reach }, i) => {
      const height = Math.max(position.z, 0);
      const [x, y] = ["x", "y"].map((axis) => position[axis] - (sun.value[axis] / sun.value.z) * height);
      const radius = 0.62 * reach * (1 + 0.15 * height);
      shades.value[i].set(x, y, radius, 1 / (1 + 0.5 * height));
      const box = shaded.value;
      box.set(Math.min(box.x, x - radius), Math.min(box.y, y - radius), Math.max(box.z, x + radius), Math.max(box.w, y + radius));
    });
  }

  /** Height of the water at a place (m). */
  height(x, y) {
    const { waves, count } = this.uniforms;
    return waves.value.slice(0, count.value).reduce((sum, w) => sum + w.x * Math.cos(w.y * x + w.z * y + w.w), 0);
  }
}
