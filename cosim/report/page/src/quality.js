// How much work goes into a picture: while something moves as much as the machine does at a smooth pace, all of it at rest.

const SMOOTH = 38; // ms: frames that take longer are seen to stutter
const EASY = 20; // ms: frames that come so fast leave room for more
const PATIENCE = 120; // easy frames before more is tried
const LONGEST = 100; // ms that one frame counts for at most, since a single hiccup is no slow machine
const USUAL = 16; // ms

// ratio: pixels of the picture per pixel of the page, at most; coarse: few triangles, and water lit at their corners;
// shadows: drawn again every so many frames
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

/** A mesh that has a fine and a coarse geometry. */
export function detailed(mesh, fine, coarse) {
  return Object.assign(mesh, { geometry: fine, userData: { fine, coarse } });
}

/** Give all of a scene that has both its fine or its coarse geometry. */
export function setDetail(scene, coarse) {
  scene.traverse((mesh) => {
    if (mesh.userData.fine) mesh.geometry = coarse ? mesh.userData.coarse : mesh.userData.fine;
  });
}

/** Whether the processor has to draw, because there is no graphics card to do it. */
export function drawnBySoftware(gl) {
  const about = gl?.getExtension("WEBGL_debug_renderer_info");
  return about ? /swiftshader|llvmpipe|software|basic render/i.test(gl.getParameter(about.UNMASKED_RENDERER_WEBGL)) : false;
}

/** The rung of the ladder for a moving picture. */
export class Quality {
  constructor(software) {
    Object.assign(this, { rung: software ? FIRST_OF_SOFTWARE : 0, best: 0, pace: USUAL, easy: 0 });
  }

  get moving() {
    return LADDER[this.rung];
  }

  /** A frame of a moving picture came `elapsed` ms after the one before: go down where that is slow, up where there is room. */
  took(elapsed) {
    this.pace += 0.1 * (Math.min(elapsed, LONGEST) - this.pace);
    this.easy = this.pace < EASY ? this.easy + 1 : 0;
    if (this.pace > SMOOTH && this.rung < LADDER.length - 1) {
      this.best = this.rung + 1; // what was too much once is not tried again
      this.#go(this.best);
    } else if (this.easy > PATIENCE && this.rung > this.best) {
      this.#go(this.rung - 1);
    }
  }

  #go(rung) {
    Object.assign(this, { rung, pace: USUAL, easy: 0 });
  }
}
