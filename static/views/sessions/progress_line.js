/** How far something under way is: what it is at, counts, and the time left. */

import { size } from "../../lib/plural.js";
import { leftInWords } from "../../lib/time_left.js";
import { html } from "../../lib/view.js";

/** What an import's phases are called here. */
const PHASES = { reading: "Reading the recording", "checking images": "Checking images", storing: "Storing" };

/**
 * @param {{step: import("./draft.js").Sending | import("./draft.js").Importing, named?: boolean}} props
 *   `named`: say of what, where nothing else does
 */
export function ProgressLine({ step, named = false }) {
  const { words, counts, done, total, label } = step.at === "sending" ? ofSending(step) : ofImport(step);
  const left = step.pace.left(done, total, performance.now());
  const parts = [counts, left === null || done >= total ? "" : leftInWords(left)].filter((part) => part !== "");
  return html`<div class="progress-line">
    <p>
      <span role="status">${named && step.at === "importing" && html`<strong>${step.job.name}</strong> `}${words}</span><span class="muted">${parts.join(", ")}</span>
    </p>
    <progress aria-label=${label} max=${total || 1} value=${total > 0 ? done : undefined}></progress>
  </div>`;
}

/** @param {import("./draft.js").Sending} step */
function ofSending({ name, sent, total }) {
  const isThere = sent >= total;
  return {
    words: isThere ? `Unpacking ${name}` : `Sending ${name}`,
    counts: isThere ? "" : `${size(sent)} of ${size(total)}`,
    done: sent,
    total: isThere ? 0 : total,
    label: `Sending ${name}`,
  };
}

/** @param {import("./draft.js").Importing} step */
function ofImport({ job }) {
  const { done, total } = job;
  return {
    words: job.state === "queued" ? "Waiting for other imports" : PHASES[job.phase],
    counts: total > 0 ? `${done.toLocaleString("en")} of ${total.toLocaleString("en")} images` : "",
    done,
    total,
    label: `Importing ${job.name}`,
  };
}
