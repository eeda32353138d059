/** The choice of how objects are drawn over photos: by their boxes' edges, or as exports would hold them. */

import { html, signal, useEffect } from "../lib/view.js";
import { actions, markFunction, markShape } from "../store.js";

/** @typedef {import("../store.js").Schemas["LabelFunctionJson"]} LabelFunction */

const functions = signal(/** @type {readonly LabelFunction[]} */ ([]));
const problem = signal(/** @type {string | null} */ (null));

/** What labels can be drawn round, as the export option says. */
const SHAPES = [
  ["hull", "hulls"],
  ["box", "boxes"],
  ["mesh", "meshes"],
];

/** What was chosen last, for the key that turns it on. */
let last = "silhouette";

export function toggleAsExported() {
  if (markFunction.value !== "") last = markFunction.value;
  markFunction.value = markFunction.value === "" ? last : "";
}

export function AsExported() {
  useEffect(() => {
    if (functions.value.length > 0) return;
    actions.formats().then(
      (found) => {
        functions.value = found.label_functions;
        problem.value = null;
      },
      (error) => (problem.value = error.message),
    );
  }, []);
  const chosen = functions.value.find(({ name }) => name === markFunction.value);
  return html`<span class="row as-exported">
    <label class="row" title=${`As exports would hold it (O)${chosen === undefined ? "" : `: ${chosen.description}`}`}>
      <span class="muted">As exported</span>
      <select class="field" aria-label="As exported" value=${markFunction.value} onChange=${(/** @type {any} */ event) => (markFunction.value = event.currentTarget.value)}>
        <option value="">Off</option>
        ${functions.value.map(({ name, title }) => html`<option key=${name} value=${name}>${title}</option>`)}
      </select>
    </label>
    ${markFunction.value !== "" &&
    html`<label class="row" title="What is drawn: hulls and meshes where there are some, else boxes">
      <span class="muted">of</span>
      <select class="field" aria-label="Shapes" value=${markShape.value} onChange=${(/** @type {any} */ event) => (markShape.value = event.currentTarget.value)}>
        ${SHAPES.map(([value, words]) => html`<option key=${value} value=${value}>${words}</option>`)}
      </select>
    </label>`}
    ${problem.value !== null && html`<span class="problem" role="alert">${problem.value}</span>`}
  </span>`;
}
