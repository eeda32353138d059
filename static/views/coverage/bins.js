/** The bins and cells of a coverage as the map draws them and as people say them. */

/** @typedef {import("../../store.js").Coverage} Coverage */
/** @typedef {import("../../store.js").Direction} Direction */

/**
 * A place of the map. Angles are degrees: azimuth from -180 to 180, 0 along the box's x, and down from the box's z.
 * @typedef {object} Bin
 * @property {number} index as in a Direction
 * @property {number} left
 * @property {number} right
 * @property {number} top
 * @property {number} bottom
 * @property {number} count views
 * @property {boolean} reachable false: a symmetry counts all of its views elsewhere
 * @property {number} area share of all directions
 */

const DEGREES = 180 / Math.PI;

/** Row by row from the top, each by azimuth. @param {Coverage} coverage @param {Direction["by"]} by @returns {Bin[][]} */
export function rowsOf(coverage, by) {
  return by === "area" ? cellRows(coverage) : angleRows(coverage);
}

/** @param {Coverage} coverage @returns {Bin[][]} */
function angleRows({ azimuth_edges, polar_edges, counts, reachable }) {
  const down = polar_edges.length - 1;
  return Array.from({ length: down }, (_, polar) =>
    counts.map((column, azimuth) => ({
      index: azimuth * down + polar,
      left: azimuth_edges[azimuth] * DEGREES,
      right: azimuth_edges[azimuth + 1] * DEGREES,
      top: polar_edges[polar] * DEGREES,
      bottom: polar_edges[polar + 1] * DEGREES,
      count: column[polar],
      reachable: reachable[azimuth][polar],
      area: (Math.cos(polar_edges[polar]) - Math.cos(polar_edges[polar + 1])) / 2 / counts.length,
    })),
  );
}

/** @param {Coverage} coverage @returns {Bin[][]} */
function cellRows({ equal_area: { bands, band_edges, counts, reachable } }) {
  let index = 0;
  return bands.map((cells, band) =>
    Array.from({ length: cells }, (_, place) => {
      const at = index++;
      const [top, bottom] = [band, band + 1].map((edge) => Math.acos(Math.max(-1, Math.min(1, band_edges[edge]))) * DEGREES);
      const width = 360 / cells;
      return {
        index: at,
        left: -180 + place * width,
        right: -180 + (place + 1) * width,
        top,
        bottom,
        count: counts[at],
        reachable: reachable[at],
        area: 1 / counts.length,
      };
    }),
  );
}

/** "azimuth −20° to 0°, 40° to 60° from top". @param {Bin} bin */
export function placeWords({ left, right, top, bottom }) {
  const around = right - left > 359.9 ? "all round" : `azimuth ${angle(left)} to ${angle(right)}`;
  return `${around}, ${angle(top)} to ${angle(bottom)} from top`;
}

/** "3 views", or why there are none. @param {Bin} bin */
export function countWords({ count, reachable }) {
  if (!reachable) return "it looks the same from elsewhere: views count there";
  return count === 0 ? "no view" : `${count.toLocaleString("en")} ${count === 1 ? "view" : "views"}`;
}

/** "1.2% of the sphere". @param {Bin} bin */
export function areaWords({ area }) {
  return `${(100 * area).toFixed(area < 0.0995 ? 1 : 0)}% of the sphere`;
}

/** @param {number} degrees */
function angle(degrees) {
  return `${String(Math.round(degrees)).replace("-", "−").replace(/^−0$/, "0")}°`;
}

/** Of the page's tokens --heat-1 to --heat-7. */
const STOPS = 7;

/** Its colour among bins of up to `most` views; as in scene/coverage_sphere.py. @param {number} count at least 1 @param {number} most */
export function heat(count, most) {
  const at = most > 1 ? (Math.log(count) / Math.log(most)) * (STOPS - 1) : STOPS - 1;
  const below = Math.min(STOPS - 2, Math.floor(at));
  return `color-mix(in srgb, var(--heat-${below + 2}) ${(100 * (at - below)).toFixed(1)}%, var(--heat-${below + 1}))`;
}
