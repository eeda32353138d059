/** Outlines as rings of corners in image coordinates: picked, mended, compared. All of it leaves its input as it is. */

/** @typedef {[number, number]} Corner */
/** What is inside is told by the even-odd rule, over all rings of a mask together. @typedef {{outer: Corner[], holes: Corner[][]}} Polygon */
/** @typedef {readonly Polygon[]} Polygons */
/** A corner: of which polygon, of which of its rings (0: outer), which. @typedef {{polygon: number, ring: number, corner: number}} Spot */
/** @typedef {{x: number, y: number}} Place */

/** Corners a ring has at least. */
export const LEAST = 3;

/** @param {Polygon} polygon @returns {Corner[][]} */
export const ringsOf = ({ outer, holes }) => [outer, ...holes];

/** @param {Polygons} polygons */
export const allRings = (polygons) => polygons.flatMap(ringsOf);

/** A place as a corner, to hundredths of a pixel: finer than anybody draws. @param {Place} at @returns {Corner} */
export const cornerAt = ({ x, y }) => [Math.round(x * 100) / 100, Math.round(y * 100) / 100];

/** @param {readonly Corner[]} outer @returns {Polygon} */
export const polygonOf = (outer) => ({ outer: [...outer], holes: [] });

/** @param {Corner} a @param {Corner} b */
export const away = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

/**
 * With one ring changed; left out where it has too few corners, and with its holes where it is an outer one.
 * @param {Polygons} polygons @param {{polygon: number, ring: number}} which @param {(ring: Corner[]) => Corner[]} change
 * @returns {Polygon[]}
 */
function withRing(polygons, which, change) {
  return polygons.flatMap((polygon, p) => {
    if (p !== which.polygon) return [polygon];
    const rings = ringsOf(polygon).map((ring, r) => (r === which.ring ? change(ring) : ring));
    const [outer, ...holes] = rings;
    return outer.length < LEAST ? [] : [{ outer, holes: holes.filter((hole) => hole.length >= LEAST) }];
  });
}

/** @param {Polygons} polygons @param {Spot} spot @param {Corner} to */
export const withMoved = (polygons, spot, to) => withRing(polygons, spot, (ring) => ring.map((corner, i) => (i === spot.corner ? to : corner)));

/** @param {Polygons} polygons @param {Spot} spot that the new corner gets @param {Corner} at */
export const withInserted = (polygons, spot, at) => withRing(polygons, spot, (ring) => [...ring.slice(0, spot.corner), at, ...ring.slice(spot.corner)]);

/** @param {Polygons} polygons @param {Spot} spot */
export const withoutCorner = (polygons, spot) => withRing(polygons, spot, (ring) => ring.filter((_, i) => i !== spot.corner));

/** @param {Polygons} polygons @param {{polygon: number, ring: number}} which */
export const withoutRing = (polygons, which) => withRing(polygons, which, () => []);

/** One polygon shifted. @param {Polygons} polygons @param {number} which @param {number} dx @param {number} dy @returns {Polygon[]} */
export function withShifted(polygons, which, dx, dy) {
  /** @param {Corner[]} ring */
  const shifted = (ring) => ring.map(([x, y]) => cornerAt({ x: x + dx, y: y + dy }));
  return polygons.map((polygon, p) => (p === which ? { outer: shifted(polygon.outer), holes: polygon.holes.map(shifted) } : polygon));
}

/** @param {Polygons} polygons @param {Spot} spot @returns {Corner | undefined} */
export function cornerOf(polygons, { polygon, ring, corner }) {
  return polygons[polygon] === undefined ? undefined : ringsOf(polygons[polygon])[ring]?.[corner];
}

/** Every corner in turn. @param {Polygons} polygons @returns {Spot[]} */
export function spotsOf(polygons) {
  return polygons.flatMap((one, polygon) => ringsOf(one).flatMap((corners, ring) => corners.map((_, corner) => ({ polygon, ring, corner }))));
}

/**
 * The edge that passes nearest, if within reach: where on it, and the place that a corner put there would get.
 * @param {Polygons} polygons @param {Place} at @param {number} reach pixels
 * @returns {{spot: Spot, at: Corner} | null}
 */
export function nearestEdge(polygons, at, reach) {
  let found = null;
  for (const spot of spotsOf(polygons)) {
    const ring = ringsOf(polygons[spot.polygon])[spot.ring];
    const foot = nearestOn(ring[spot.corner], ring[(spot.corner + 1) % ring.length], [at.x, at.y]);
    const distance = away(foot, [at.x, at.y]);
    if (distance <= reach) [found, reach] = [{ spot: { ...spot, corner: spot.corner + 1 }, at: cornerAt({ x: foot[0], y: foot[1] }) }, distance];
  }
  return found;
}

/** @param {Corner} a @param {Corner} b @param {Corner} at @returns {Corner} of the edge from a to b */
function nearestOn(a, b, at) {
  const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
  const length = dx * dx + dy * dy;
  const along = length === 0 ? 0 : Math.max(0, Math.min(1, ((at[0] - a[0]) * dx + (at[1] - a[1]) * dy) / length));
  return [a[0] + along * dx, a[1] + along * dy];
}

/** The polygon that a place is inside of, the topmost; -1: none. @param {Polygons} polygons @param {Place} at */
export function polygonAt(polygons, at) {
  return polygons.findLastIndex((polygon) => ringsOf(polygon).filter((ring) => isInside(ring, at)).length % 2 === 1);
}

/** By the even-odd rule. @param {readonly Corner[]} ring @param {Place} at */
function isInside(ring, { x, y }) {
  let inside = false;
  ring.forEach(([ax, ay], i) => {
    const [bx, by] = ring[(i + 1) % ring.length];
    if (ay > y !== by > y && x < ax + ((y - ay) / (by - ay)) * (bx - ax)) inside = !inside;
  });
  return inside;
}

/**
 * A path without the corners that it can do without: none of those left out is farther from it than the tolerance.
 * Douglas and Peucker, 1973.
 * @param {readonly Corner[]} path @param {number} tolerance pixels
 * @returns {Corner[]}
 */
export function simplified(path, tolerance) {
  const kept = new Set([0, path.length - 1]);
  const spans = [[0, path.length - 1]];
  for (let span = spans.pop(); span !== undefined; span = spans.pop()) {
    const [from, to] = span;
    let [most, at] = [tolerance, -1];
    for (let i = from + 1; i < to; i += 1) {
      const distance = away(nearestOn(path[from], path[to], path[i]), path[i]);
      if (distance > most) [most, at] = [distance, i];
    }
    if (at < 0) continue;
    kept.add(at);
    spans.push([from, at], [at, to]);
  }
  return path.filter((_, i) => kept.has(i));
}

/** Whether they are alike corner by corner, to a thousandth of a pixel. @param {Polygons} a @param {Polygons} b */
export function same(a, b) {
  const [mine, theirs] = [a.map(ringsOf), b.map(ringsOf)];
  return (
    mine.length === theirs.length &&
    mine.every((rings, p) => rings.length === theirs[p].length && rings.every((ring, r) => ring.length === theirs[p][r].length && ring.every((corner, c) => away(corner, theirs[p][r][c]) < 2e-3)))
  );
}
