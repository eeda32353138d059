/** "Fit to masks": the box is moved to where what would be exported fits its masks best; how well it does, frame by frame. */

import { intoSight } from "../../lib/in_sight.js";
import { html, signal } from "../../lib/view.js";
import * as store from "../../store.js";
import { openView } from "./panes.js";
import { options } from "./subject.js";

/** @typedef {import("../../store.js").Refinement} Refinement */

/** Of a box: what fitting it gave, by its revision then; or why it could not be. */
const fits = signal(/** @type {ReadonlyMap<number, Refinement | {problem: string}>} */ (new Map()));
const fitting = signal(/** @type {number | null} */ (null));

/** @param {number} id @param {"upright" | "free"} orientation */
async function fit(id, orientation) {
  fitting.value = id;
  try {
    fits.value = new Map(fits.value).set(id, await store.actions.refineBox(id, orientation));
  } catch (error) {
    fits.value = new Map(fits.value).set(id, { problem: /** @type {Error} */ (error).message });
  }
  fitting.value = null;
}

/** @param {number} id */
function dismiss(id) {
  const next = new Map(fits.value);
  next.delete(id);
  fits.value = next;
}

/** @param {number} frame */
function show(frame) {
  if (store.mode.value === "masks") openView(frame);
  else store.actions.enterFrame(frame);
}

/** @param {{box: import("../../store.js").Box | null}} props */
export function FitButton({ box }) {
  if (box === null) return null;
  const count = store.masksOfSelected.value.filter((mask) => mask.accepted).length;
  const orientation = options.value.orientation === "free" ? "free" : "upright";
  return html`<button
    class="button small" disabled=${count === 0 || box.locked || fitting.value !== null} onClick=${() => void fit(box.id, orientation)}
    title=${`Move, turn and size the box so that its labels fit the masks best, ${orientation === "free" ? "turned any way" : "standing upright"}`}
  >Fit to masks</button>`;
}

/** @param {{box: import("../../store.js").Box | null}} props */
export function Fit({ box }) {
  const told = box === null ? undefined : fits.value.get(box.id);
  if (box === null || told === undefined) return null;
  const away = html`<button class="button link" onClick=${() => dismiss(box.id)}>Dismiss</button>`;
  if ("problem" in told) return html`<p class="problem dismissible" ref=${intoSight} role="alert">${told.problem} ${away}</p>`;
  // Once the box is changed again, what was said of it is no more so.
  if (told.box.revision !== box.revision) return null;
  const outliers = told.residuals.filter(({ outlier }) => outlier).length;
  return html`<div class="fit" ref=${intoSight} role="group" aria-label="How well the box fits its masks">
    <p class="row"><span role="status">Moved by ${told.moved_mm.toFixed(1)} mm; ${told.rms_px.toFixed(1)} px off on average${outliers > 0 ? `, ${outliers === 1 ? "one mask stands out" : `${outliers} masks stand out`}` : ""}.</span>${away}</p>
    ${told.warnings.map((text) => html`<p key=${text} class="problem">${text}</p>`)}
    <ul class="residuals">
      ${told.residuals.map(
        ({ frame, rms_px, outlier }) => html`<li key=${frame}>
          <button class="button link" onClick=${() => show(frame)}>Frame ${frame}</button>
          <span class=${outlier ? "narrow" : "muted"}>${rms_px.toFixed(1)} px${outlier ? ", stands out" : ""}</span>
        </li>`,
      )}
    </ul>
  </div>`;
}
