/** Objects as they would be exported, drawn over a frame's original image. */

import { html } from "../lib/view.js";
import { classes, hidden, markFunction, selected } from "../store.js";

/** @typedef {import("./frame_marks.js").Mark} Mark */

/** Label functions whose area is tinted, too. */
const FILLED = ["outline", "silhouette", "mask"];

/**
 * @param {object} props
 * @param {readonly Mark[]} props.marks
 * @param {readonly [number, number, number, number]} props.view of the image: x, y, width, height
 * @param {number} props.pixel how long a CSS pixel is in the image
 * @param {number | null} [props.only] the id of the box that is drawn alone
 */
export function MarksDrawing({ marks, view, pixel, only = null }) {
  const chosen = selected.value;
  const seen = marks.filter(({ box_id }) => (only === null ? !hidden.value.has(box_id) : box_id === only));
  // The selected one last: over the others.
  const order = [...seen.filter(({ box_id }) => box_id !== chosen), ...seen.filter(({ box_id }) => box_id === chosen)];
  const isFilled = FILLED.includes(markFunction.value);
  return html`<svg class="marks" viewBox=${view.join(" ")} aria-hidden="true">
    ${order.map(({ box_id, class_id, rings, points }) => {
      const color = classes.value.get(class_id)?.color ?? "#ffffff";
      return html`<g key=${box_id} class=${box_id === chosen && only === null ? "selected" : ""} data-box=${box_id} style=${{ stroke: color, fill: color }}>
        ${rings.length > 0 && html`<path d=${pathOf(rings)} fill-rule="evenodd" data-filled=${isFilled} />`}
        ${points.map(
          ({ name, at, state }) =>
            at !== null && state !== "unseen" && html`<circle key=${name} cx=${at[0]} cy=${at[1]} r=${3 * pixel} data-state=${state}><title>${name}</title></circle>`,
        )}
      </g>`;
    })}
  </svg>`;
}

/** @param {readonly (readonly (readonly [number, number])[])[]} rings image coordinates */
function pathOf(rings) {
  return rings.map((ring) => `M${ring.map(([x, y]) => `${x} ${y}`).join("L")}Z`).join("");
}
