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
  slope = ripple(at, vec2(1.7, 0.8), 1.1 * time) + ripple(at, vec2(-0.9, 2.1), -1.4 * time)
    + ripple(at, vec2(2.3, -1.9), 1.8 * time);
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
  haze = 1.0 - exp(-range * range / 160000.0);
  gl_Position = projectionMatrix * viewMatrix * vec4(place, 1.0);
}`;

const LIT = `
uniform vec3 deep, zenith, horizon, sun;
float mirrored(vec3 ray, vec3 normal) {
  float grazing = 1.0 - max(dot(ray, normal), 0.0);
  return 0.04 + 0.9 * grazing * grazing * grazing;
}
vec3 lit(vec3 place, vec3 normal, vec3 reflection, float share) {
  vec3 ray = normalize(cameraPosition - place);
  float glint = max(dot(reflect(-sun, normal), ray), 0.0);
  glint *= glint; glint *= glint; glint *= glint; glint *= glint;
  return mix(deep + 0.25 * deep * dot(normal.xy, sun.xy), reflection, share) + 0.10 * glint * glint;
}
vec3 sky(vec3 ray, vec3 normal) {
  float height = max(reflect(-ray, normal).z, 0.0);
  return mix(horizon, zenith, sqrt(height));
}`;

// COARSE: the water is lit per vertex and mirrors the sky alone. Otherwise it is lit per pixel, has
// finer ripples and mirrors the scene (three's Reflector draws it into tDiffuse).
export const WATER = {
  vertexShader: `${SURFACE}
uniform mat4 textureMatrix;
#ifdef COARSE
${LIT}
varying vec3 colour;
#else
varying vec3 place;
varying vec2 slope;
varying vec4 image;
#endif
void main() {
  vec2 tilt;
  vec3 at = surface(position.xy + centre, tilt);
#ifdef COARSE
  vec3 normal = normalize(vec3(tilt, 1.0)), ray = normalize(cameraPosition - at);
  project(at);
  colour = mix(lit(at, normal, sky(ray, normal), mirrored(ray, normal)), horizon, haze);
#else
  place = at;
  slope = tilt;
  image = textureMatrix * vec4(at.xy, 0.0, 1.0);
  project(at);
#endif
}`,
  fragmentShader: `
#ifdef COARSE
varying vec3 colour;
void main() {
  gl_FragColor = vec4(colour, 1.0);
}
#else
varying vec3 place;
varying float haze;
uniform sampler2D tDiffuse;
uniform float time;
varying vec2 slope;
varying vec4 image;
${LIT}
vec2 ripple(vec2 number, float angle) {
  return number * (0.012 * cos(dot(number, place.xy) + angle) / length(number));
}
vec2 ripples() {
  return ripple(vec2(4.1, 2.3), 2.1 * time) + ripple(vec2(-3.3, 5.6), -2.6 * time)
    + ripple(vec2(7.9, -6.1), 3.3 * time)
    + ripple(vec2(-9.7, -8.8), 3.9 * time) + ripple(vec2(1.3, 11.9), -3.6 * time);
}
void main() {
  vec3 ray = cameraPosition - place;
  float range = length(ray);
  ray /= range;
  vec3 normal = normalize(vec3(slope + ripples() / (1.0 + 0.0015 * range * range), 1.0));
  vec2 at = image.xy / image.w + normal.xy * vec2(0.5, 1.0) * min(0.6, 6.0 / range);
  vec3 colour = lit(place, normal, texture2D(tDiffuse, at).rgb, mirrored(ray, normal));
  gl_FragColor = vec4(mix(colour, horizon, haze), 1.0);
}
#endif`,
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
