// Adaptive quality: as high as possible at a smooth frame rate while something moves, and the
// highest when nothing moves.

const SMOOTH = 38; // ms: longer frames are visible as stutter
const EASY = 20; // ms: shorter frames allow a higher quality
const PATIENCE = 120; // number of short frames before a higher quality is tried
// ms: upper limit of a frame time, because one slow frame does not mean a slow machine
const LONGEST = 100;
const USUAL = 16; // ms: initial frame time

// ratio: largest number of image pixels per page pixel; coarse: few triangles, and lighting of the
// water per vertex; shadows: number of frames between two updates of the shadows
export const LADDER = [
  { ratio: 1.5, coarse: false, shadows: 1 },
  { ratio: 1, coarse: false, shadows: 1 },
  { ratio: 0.85, coarse: true, shadows: 2 },
  { ratio: 0.7, coarse: true, shadows: 2 },
  { ratio: 0.6, coarse: true, shadows: 3 },
  { ratio: 0.5, coarse: true, shadows: 4 },
];
export const FINEST = LADDER[0];
const FIRST_OF_SOFTWARE = 3;

/** A mesh with a fine and a coarse geometry. */
export function detailed(mesh, fine, coarse) {
  return Object.assign(mesh, { geometry: fine, userData: { fine, coarse } });
}

/** Select the fine or the coarse geometry of all meshes that have both. */
export function setDetail(scene, coarse) {
  scene.traverse((mesh) => {
    if (mesh.userData.fine) mesh.geometry = coarse ? mesh.userData.coarse : mesh.userData.fine;
  });
}

/** True if there is no graphics card and the processor renders. */
export function drawnBySoftware(gl) {
  const about = gl?.getExtension("WEBGL_debug_renderer_info");
  return about
    ? /swiftshader|llvmpipe|software|basic render/i.test(
        gl.getParameter(about.UNMASKED_RENDERER_WEBGL),
      )
    : false;
}

/** The quality level for a moving picture, an index of LADDER. */
export class Quality {
  constructor(software) {
    Object.assign(this, { rung: software ? FIRST_OF_SOFTWARE : 0, best: 0, pace: USUAL, easy: 0 });
  }

  get moving() {
    return LADDER[this.rung];
  }

  /** Adapt the level to the time `elapsed` (ms) since the previous frame of a moving picture. */
  took(elapsed) {
    this.pace += 0.1 * (Math.min(elapsed, LONGEST) - this.pace);
    this.easy = this.pace < EASY ? this.easy + 1 : 0;
    if (this.pace > SMOOTH && this.rung < LADDER.length - 1) {
      this.best = this.rung + 1; // a level that was too slow is not tried again
      this.#go(this.best);
    } else if (this.easy > PATIENCE && this.rung > this.best) {
      this.#go(this.rung - 1);
    }
  }

  #go(rung) {
    Object.assign(this, { rung, pace: USUAL, easy: 0 });
  }
}
