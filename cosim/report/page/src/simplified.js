// Simplification of a path to few points.
import { Line3, Vector3 } from "three";

/**
 * Indices of the points of a simplified path with a deviation of at most `tolerance` (Douglas
 * and Peucker 1973).
 */
export function simplified(points, tolerance) {
  const kept = new Set([0, points.length - 1]);
  const spans = [[0, points.length - 1]];
  while (spans.length) {
    const [first, last] = spans.pop();
    const far = furthest(points, first, last);
    if (far.distance <= tolerance) continue;
    kept.add(far.index);
    spans.push([first, far.index], [far.index, last]);
  }
  return [...kept].filter((i) => i >= 0).sort((a, b) => a - b);
}

/** The point with the largest distance from the straight line between two others. */
function furthest(points, first, last) {
  const line = new Line3(points[first], points[last]);
  const foot = new Vector3();
  let [index, distance] = [first, 0];
  for (let i = first + 1; i < last; i++) {
    const beside = points[i].distanceTo(line.closestPointToPoint(points[i], true, foot));
    if (beside > distance) [index, distance] = [i, beside];
  }
  return { index, distance };
}
