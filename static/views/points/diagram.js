/** Which corner is which: a small box with the four corners and the three edges between them. */

import { html } from "../../lib/view.js";

/** The corners of the drawing, P0 to P3 and the four others. @type {[number, number][]} */
const CORNERS = [[20, 66], [20, 30], [62, 40], [92, 22]];
const HIDDEN = "M20 66L50 48L92 58M50 48L50 12";
const SEEN = "M20 66L62 76L92 58L92 22L50 12L20 30M62 40L62 76";
/** @type {[string, string, number, number][]} which axis runs from which corner, and where its name stands */
const EDGES = [["z", "--z", 11, 50], ["x", "--x", 41, 48], ["y", "--y", 83, 38]];

/** @param {{current: number, done: readonly boolean[]}} props */
export function Diagram({ current, done }) {
  return html`<svg class="points-diagram" viewBox="0 0 112 88" width="112" height="88" role="img"
    aria-label="P0 is a lower corner, P1 the one above it, P2 the next upper corner along x, P3 the one after that along y."
  >
    <path class="hidden-edge" d=${HIDDEN} />
    <path class="edge" d=${SEEN} />
    ${EDGES.map(([name, color, x, y], i) => {
      const [[x0, y0], [x1, y1]] = [CORNERS[i], CORNERS[i + 1]];
      return html`<path class="axis" d=${`M${x0} ${y0}L${x1} ${y1}`} style=${{ stroke: `var(${color})` }} />
        <text x=${x} y=${y} style=${{ fill: `var(${color})` }}>${name}</text>`;
    })}
    ${CORNERS.map(
      ([x, y], i) => html`<circle class=${i === current ? "corner now" : done[i] ? "corner done" : "corner"} cx=${x} cy=${y} r=${i === current ? 5.5 : 4} />
        <text class=${i === current ? "name now" : "name"} x=${x + (i === 0 ? -2 : 1)} y=${y + (i === 0 ? 17 : -9)}>P${i}</text>`,
    )}
  </svg>`;
}
