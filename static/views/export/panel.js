/** The export panel: which dataset, how, and what would be in it. */

import { html, useEffect, useSignal } from "../../lib/view.js";
import { actions } from "../../store.js";

/** @typedef {import("../../store.js").Schemas} Schemas */

export function ExportPanel() {
  const formats = useSignal(/** @type {Schemas["FormatsJson"] | null} */ (null));
  const problem = useSignal(/** @type {string | null} */ (null));
  useEffect(() => {
    actions.formats().then(
      (found) => (formats.value = found),
      (error) => (problem.value = error.message),
    );
  }, []);
  if (problem.value !== null) return html`<p class="problem" role="alert">${problem.value}</p>`;
  return html`<section class="export-panel" aria-label="Export">
    <ul>${formats.value?.writers.map((writer) => html`<li key=${writer.format}><strong>${writer.title}</strong> ${writer.description}</li>`)}</ul>
  </section>`;
}
