// Shaders of the water and of the shadows of vehicles on it.

export const MOST_WAVES = 64;
export const FINE = 26; // m: distance from its middle up to which the mesh resolves the waves

const SURFACE = `
uniform vec4 waves[${MOST_WAVES}];
uniform int count;
uniform vec2 centre;
uniform float time;
varying float haze;
vec2 ripple(vec2 at, vec2 number, float angle) {
  return 0.013 * normalize(number) * cos(dot(number, at) + angle);
}
vec3 surface(vec2 at, out vec2 slope) {
  float fade = 1.0 - smoothstep(${FINE}.0, ${2 * FINE}.0, distance(at, centre));
  int felt = fade > 0.0 ? count : 0;
  float height = 0.0;
  slope = ripple(at, vec2(1.7, 0.8), 1.1 * time) + ripple(at, vec2(-0.9, 2.1), -1.4 * time) + ripple(at, vec2(2.3, -1.9), 1.8 * time);
  for (int i = 0; i < felt; i++) {
    float angle = dot(waves[i].yz, at) + waves[i].w;
    height += waves[i].x * cos(angle);
    slope += waves[i].x * sin(angle) * waves[i].yz;
  }
  slope *= fade;
  return vec3(at, height * fade);
}
void project(vec3 place) {
  float range = distance(cameraPosition, place);
  haze = 1.0 - exp(-range * range / 20000.0);
  gl_Position = projectionMatrix * viewMatrix * vec4(place, 1.0);
}`;

const LIT = `
uniform vec3 deep, shallow, sun;
vec3 lit(vec3 place, vec2 slope) {
  vec3 ray = normalize(cameraPosition - place);
  vec3 normal = normalize(vec3(slope, 1.0));
  float grazing = 1.0 - max(dot(ray, normal), 0.0);
  float glint = max(dot(reflect(-sun, normal), ray), 0.0);
  glint *= glint; glint *= glint; glint *= glint; glint *= glint;
  return mix(deep, shallow, 0.12 + 0.88 * grazing * grazing * grazing) + shallow * dot(normal.xy, sun.xy) + 0.10 * glint * glint;
}`;

// The lighting is computed per vertex if COARSE, otherwise per pixel.
export const WATER = {
  vertexShader: `${SURFACE}
varying vec3 place;
#ifdef COARSE
${LIT}
varying vec3 colour;
#else
varying vec2 slope;
#endif
void main() {
  vec2 tilt;
  place = surface(position.xy + centre, tilt);
#ifdef COARSE
  colour = lit(place, tilt);
#else
  slope = tilt;
#endif
  project(place);
}`,
  fragmentShader: `
uniform vec3 horizon, ink;
varying vec3 place;
varying float haze;
#ifdef COARSE
varying vec3 colour;
#else
${LIT}
varying vec2 slope;
#endif
float lines(float pitch, vec2 width) {
  vec2 off = abs(fract(place.xy / pitch - 0.5) - 0.5) * pitch;
  vec2 line = clamp(1.4 - off / width, 0.0, 1.0);
  return max(line.x, line.y) * clamp(1.2 - 5.0 * max(width.x, width.y) / pitch, 0.0, 1.0);
}
void main() {
#ifndef COARSE
  vec3 colour = lit(place, slope);
#endif
  vec2 width = fwidth(place.xy) + 0.003;
  vec3 ruled = mix(colour, ink, 0.05 * lines(1.0, width) + 0.08 * lines(5.0, width));
  gl_FragColor = vec4(mix(ruled, horizon, haze), 1.0);
}`,
};

export const SHADE = {
  vertexShader: `${SURFACE}
attribute vec4 shade; // x, y, radius, darkness
varying vec3 off;
void main() {
  vec2 slope;
  off = vec3(position.xy, shade.w);
  project(surface(shade.xy + shade.z * position.xy, slope));
}`,
  fragmentShader: `
uniform float strength;
varying vec3 off;
varying float haze;
void main() {
  float depth = max(1.0 - dot(off.xy, off.xy), 0.0);
  gl_FragColor = vec4(0.0, 0.0, 0.0, strength * off.z * depth * depth * (1.0 - haze));
}`,
};
