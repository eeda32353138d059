/** "Outline the rest": the server outlines the object in further frames, and tells how far it is. */

import { intoSight } from "../../lib/in_sight.js";
import { plural } from "../../lib/plural.js";
import { leftInWords } from "../../lib/time_left.js";
import { html, signal } from "../../lib/view.js";
import * as store from "../../store.js";
import { openView } from "./panes.js";

/** @typedef {import("../../store.js").OutlineJob} Job */

/** Milliseconds between two questions. */
const PAUSE = 400;

/** The newest job of each object that was begun here, or why it could not begin. */
export const jobs = signal(/** @type {ReadonlyMap<number, Job | {problem: string}>} */ (new Map()));

/** @param {number} id @param {Job | {problem: string} | null} job */
function put(id, job) {
  const next = new Map(jobs.value);
  if (job === null) next.delete(id);
  else next.set(id, job);
  jobs.value = next;
}

/** @param {Job | {problem: string} | undefined} job */
function isGoing(job) {
  return job !== undefined && "state" in job && (job.state === "queued" || job.state === "running");
}

/** @param {number} id of the object */
async function start(id) {
  try {
    let job = await store.actions.outlineRest(id);
    for (put(id, job); isGoing(job); put(id, job)) {
      await new Promise((resolve) => setTimeout(resolve, PAUSE));
      job = await store.actions.outlineState(job.id);
    }
  } catch (error) {
    put(id, { problem: /** @type {Error} */ (error).message });
  }
}

/** @param {{subject: import("./subject.js").Subject}} props */
export function OutlineRestButton({ subject }) {
  const { id, box } = subject;
  const enough = store.masksOfSelected.value.filter((mask) => mask.accepted).length >= 2;
  const going = isGoing(jobs.value.get(id ?? store.NEW));
  return html`<button
    class="button small strong" disabled=${id === null || !enough || going || (box?.locked ?? false)} onClick=${() => id !== null && void start(id)}
    title=${enough ? "Let the machine outline the object in further frames, and check its outlines against each other" : "Outline the object in two frames first"}
  >Outline the rest</button>`;
}

/** @param {{job: Job | {problem: string} | undefined, id: number | null}} props */
export function OutlineRest({ job, id }) {
  if (job === undefined || id === null) return null;
  const dismiss = html`<button class="button link" onClick=${() => put(id, null)}>Dismiss</button>`;
  if ("problem" in job) return html`<p class="problem dismissible" role="alert">${job.problem} ${dismiss}</p>`;
  if (isGoing(job)) {
    const left = job.seconds_left === null ? "" : `, ${leftInWords(job.seconds_left)}`;
    return html`<div class="outline-job">
      <progress max=${Math.max(1, job.total)} value=${job.done} aria-label="Outlining the rest"></progress>
      <div class="row"><span class="muted" role="status">${job.total === 0 ? "Choosing frames" : `${job.done} of ${plural(job.total, "step")}${left}`}</span>
        <button class="button link" onClick=${() => store.actions.cancelOutline(job.id).catch((error) => put(id, { problem: error.message }))}>Cancel</button>
      </div>
    </div>`;
  }
  if (job.state === "failed") return html`<p class="problem dismissible" role="alert">${job.error ?? "Outlining the rest failed."} ${dismiss}</p>`;
  if (job.state === "cancelled") return html`<p class="muted dismissible" role="status">Cancelled: nothing was added. ${dismiss}</p>`;
  const words = [
    `${plural(job.accepted.length, "mask")} added`,
    ...(job.doubtful.length > 0 ? [`${job.doubtful.length} to look at`] : []),
    ...(job.dropped.length > 0 ? [`${job.dropped.length} dropped`] : []),
  ];
  return html`<div class="outline-job" ref=${intoSight}>
    <p class="row"><span role="status">${words.join(", ")}.</span>${dismiss}</p>
    <${Reasons} words="Why some are to be looked at" reasons=${job.doubts} />
    <${Reasons} words="Why some were dropped" reasons=${job.dropped} />
  </div>`;
}

/** @param {{words: string, reasons: readonly {frame: number, reason: string}[]}} props */
function Reasons({ words, reasons }) {
  if (reasons.length === 0) return null;
  return html`<details><summary class="muted">${words}</summary>
    <ul>${reasons.map(({ frame, reason }) => html`<li key=${frame}><button class="button link" onClick=${() => openView(frame)}>Frame ${frame}</button> <span class="muted">${reason}</span></li>`)}</ul>
  </details>`;
}
