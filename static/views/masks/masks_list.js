/** The outlines of the object, one a frame: open, remove, say yes or no to those that the machine proposes. */

import { Icon } from "../../lib/icon.js";
import { plural } from "../../lib/plural.js";
import { html } from "../../lib/view.js";
import * as store from "../../store.js";
import { drawing } from "./drawing.js";
import { guidance } from "./guidance.js";
import { activeFrame, addView, MOST, openView, panes } from "./panes.js";
import { place, refused } from "./saving.js";

/** @typedef {import("../../store.js").Mask} Mask */
/** @typedef {import("../../store.js").Polygon} Polygon */

/** @type {Record<import("../../store.js").MaskOrigin, string>} */
const ORIGINS = { drawn: "polygon", smart: "smart tool", proposed: "outlined" };

/** What is done with each tool. @type {Record<import("./drawing.js").ToolName, string>} */
const HOW = {
  select: "take the polygon, or another tool, at the left",
  polygon: "click round it, and close at the first point",
  lasso: "drag round it",
  rectangle: "drag from one corner of it to the other",
  brush: "paint over it",
  eraser: "take the polygon, or another tool, at the left",
  smart: "drag a rectangle round it",
};

/** @param {{subject: import("./subject.js").Subject}} props */
export function MasksList({ subject }) {
  const problem = store.problems.value.get("masks");
  const masks = store.masksOfSelected.value;
  const drawn = panes.value
    .map(({ frame }) => ({ frame, polygons: drawnIn(drawing.of(subject.key, frame)) }))
    .filter(({ frame, polygons }) => polygons.length > 0 && masks.every((mask) => mask.frame !== frame));
  const rows = [...masks.map((mask) => ({ frame: mask.frame, polygons: mask.polygons, mask: /** @type {Mask | null} */ (mask) })), ...drawn.map((one) => ({ ...one, mask: null }))].sort(
    (a, b) => a.frame - b.frame,
  );
  const doubtful = masks.filter((mask) => !mask.accepted).length;
  /** @param {() => Promise<void>} work */
  const tried = (work) => store.attempt("masks", work);
  return html`<section class="panel-section masks-section" aria-label=${`Masks of ${subject.name}`}>
    <header class="section-head">
      <h2 class="heading cut" title=${subject.name}>Masks of ${subject.name}</h2>
      <button
        class="button link" disabled=${panes.value.length >= MOST || panes.value.length >= store.frames.value} onClick=${() => addView(guidance.value?.next_view?.frame ?? null)}
        title="One more frame beside these: the one that narrows the hull most"
      >Add view</button>
    </header>
    ${rows.length === 0 && html`<p class="muted">No masks yet. Outline the object in both frames: ${HOW[drawing.tool.value]}.</p>`}
    ${rows.length > 0 &&
    html`<ul class="masks-list">
      ${rows.map((row) => html`<${Row} key=${row.frame} ...${row} color=${subject.color} refusal=${refused.value.get(place(subject.key, row.frame))} tried=${tried} />`)}
    </ul>`}
    ${doubtful > 0 && html`<p class="muted doubts">${doubtful === 1 ? "One mask waits for a yes or a no: it does" : `${doubtful} masks wait for a yes or a no: they do`} not count yet.</p>`}
    ${problem !== undefined &&
    html`<p class="problem dismissible" role="alert">${problem}
      <button class="button link" onClick=${() => store.setProblem("masks", null)}>Dismiss</button>
    </p>`}
  </section>`;
}

/** With the ring that is being drawn. @param {import("../../lib/mask_sheet.js").MaskSheet} sheet @returns {readonly Polygon[]} */
function drawnIn({ polygons, open }) {
  return open.value === null || open.value.length === 0 ? polygons.value : [...polygons.value, { outer: [...open.value], holes: [] }];
}

/**
 * @param {object} props
 * @param {number} props.frame
 * @param {readonly Polygon[]} props.polygons
 * @param {Mask | null} props.mask null: it is being drawn, and nothing of it is stored
 * @param {string} props.color
 * @param {string} [props.refusal] why what is drawn is not stored
 * @param {(work: () => Promise<void>) => void} props.tried
 */
function Row({ frame, polygons, mask, color, refusal, tried }) {
  const isDoubtful = mask !== null && !mask.accepted;
  const points = polygons.reduce((sum, { outer, holes }) => sum + outer.length + holes.reduce((all, hole) => all + hole.length, 0), 0);
  const origin = refusal !== undefined ? "not stored" : mask === null ? "drawing" : isDoubtful ? "proposed" : ORIGINS[mask.origin];
  /** @param {string} icon @param {string} label @param {() => Promise<void>} run */
  const button = (icon, label, run) => html`<button class="row-button" aria-label=${label} title=${label} onClick=${() => tried(run)}><${Icon} name=${icon} size=${14} /></button>`;
  return html`<li class="mask-row" data-current=${frame === activeFrame()} data-doubtful=${isDoubtful || mask === null}>
    <button class="open" aria-current=${frame === activeFrame() ? "true" : undefined} title=${refusal ?? `Show frame ${frame}`} onClick=${() => openView(frame)}>
      <span class="swatch" style=${{ background: color }}></span>
      <span class="name">Frame ${frame}</span>
      <span class=${refusal === undefined ? "muted" : "problem"}>${origin}, ${plural(points, "point")}</span>
    </button>
    ${isDoubtful && button("check", `Yes, the mask in frame ${frame} is right`, () => store.actions.acceptMask(mask.id))}
    ${isDoubtful
      ? button("x", `No, drop the mask in frame ${frame}`, () => store.actions.deleteMask(mask.id))
      : mask !== null && button("x", `Remove the mask in frame ${frame}`, () => store.actions.deleteMask(mask.id))}
  </li>`;
}
