/** The frames that a recording lists and that could not be used, with the reason and the place of each. */

import { Dialog } from "../../lib/dialog.js";
import { Icon } from "../../lib/icon.js";
import { plural } from "../../lib/plural.js";
import { html, useEffect, useSignal } from "../../lib/view.js";
import { actions } from "../../store.js";

/** More than anybody reads; the rest is counted. */
const MOST = 500;

/** @typedef {import("../../store.js").Schemas["SkippedFrameJson"]} Skipped */

/** @param {{session: import("../../store.js").Session, onClose: () => void}} props */
export function SkippedFrames({ session, onClose }) {
  const frames = useSignal(/** @type {Skipped[] | null} */ (null));
  const problem = useSignal(/** @type {string | null} */ (null));
  useEffect(() => {
    actions.skipped(session.id).then(
      (found) => (frames.value = found),
      (error) => (problem.value = error.message),
    );
  }, [session.id]);
  return html`<${Dialog} label=${`Skipped frames of ${session.name}`} class="wide skipped-dialog" onClose=${onClose}>
    <header>
      <h2>${plural(session.skipped, "frame")} of ${session.name} could not be used</h2>
      <button class="button quiet icon-only" aria-label="Close" onClick=${onClose}><${Icon} name="x" /></button>
    </header>
    <div class="body">
      ${problem.value !== null && html`<p class="problem" role="alert">${problem.value}</p>`}
      ${frames.value !== null && html`<${SkippedTable} frames=${frames.value.slice(0, MOST)} count=${frames.value.length} />`}
    </div>
  </${Dialog}>`;
}

/** @param {{frames: readonly Skipped[], count: number}} props `count`: all of them, told or not */
export function SkippedTable({ frames, count }) {
  return html`<table class="skipped">
      <thead><tr><th scope="col">Frame</th><th scope="col">Why</th><th scope="col">Where</th></tr></thead>
      <tbody>${frames.map(
        ({ name, reason, where }, i) => html`<tr key=${i}><th scope="row">${name}</th><td>${reason}</td><td class="muted">${where}</td></tr>`,
      )}</tbody>
    </table>
    ${count > frames.length && html`<p class="muted">and ${(count - frames.length).toLocaleString("en")} more</p>`}`;
}
