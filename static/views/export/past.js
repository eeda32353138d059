/** The session's exports, anybody's: how far they are, and what came of them. */

import { Icon } from "../../lib/icon.js";
import { ago } from "../../lib/time.js";
import { html, signal, useEffect, useRef, useSignal } from "../../lib/view.js";
import { actions } from "../../store.js";
import { writers } from "./draft.js";
import { capital, duration, figure, many, optionsWords, size, SPLITS } from "./words.js";

/** @typedef {import("../../store.js").Export} Export */
/** @typedef {import("../../store.js").Schemas["ExportReport"]} Report */

/** Milliseconds between two looks while an export runs. */
const INTERVAL = 1000;

/** The newest first; null: not known yet. */
export const exports = signal(/** @type {readonly Export[] | null} */ (null));
/** The export that was started here last: it is brought into sight. */
const newest = signal("");
const problem = signal(/** @type {string | null} */ (null));
/** When each running export was first seen to move, by its id, and how far it was then: what time is left follows. */
const begun = new Map(/** @type {[string, {at: number, done: number}][]} */ ([]));
/** @type {ReturnType<typeof setTimeout> | undefined} */
let timer;
/** How many panels are open; 0: nobody looks. */
let watchers = 0;

/** @param {Export} one */
export const isGoing = (one) => one.state === "queued" || one.state === "running";

/** Look now, and every second while an export runs. Answers how to stop. */
export function watch() {
  watchers++;
  void look();
  return () => {
    watchers--;
    clearTimeout(timer);
  };
}

/** Show an export that was just started. @param {Export} made */
export async function begin(made) {
  exports.value = [made, ...(exports.value ?? []).filter((one) => one.id !== made.id)];
  newest.value = made.id;
  await look();
}

export async function look() {
  clearTimeout(timer);
  try {
    const found = await actions.exports();
    for (const one of found) note(one);
    exports.value = found;
    problem.value = null;
  } catch (error) {
    problem.value = /** @type {Error} */ (error).message;
  }
  clearTimeout(timer);
  if (watchers > 0 && exports.value?.some(isGoing)) timer = setTimeout(() => void look(), INTERVAL);
}

/** @param {Export} one */
function note(one) {
  if (one.state !== "running") begun.delete(one.id);
  else if (!begun.has(one.id) && one.total > 0) begun.set(one.id, { at: performance.now(), done: one.done });
}

/** @param {Export} one @returns {number | null} seconds */
function timeLeft(one) {
  const start = begun.get(one.id);
  if (start === undefined || one.done <= start.done) return null;
  const passed = (performance.now() - start.at) / 1000;
  return ((one.total - one.done) * passed) / (one.done - start.done);
}

export function PastExports() {
  const all = exports.value;
  return html`<section class="past" aria-label="Exports">
    <header>
      <h2 class="heading">Exports</h2>
      <button class="button quiet icon-only" aria-label="Look for new exports" title="Look for new exports" onClick=${look}><${Icon} name="refresh-cw" size=${14} /></button>
    </header>
    ${problem.value !== null && html`<p class="problem" role="alert">${problem.value}</p>`}
    ${all !== null && all.length === 0 && html`<p class="muted">None yet. What you export stays here, to be downloaded or removed.</p>`}
    <ul>${all?.map((one) => html`<${Row} key=${one.id} one=${one} />`)}</ul>
  </section>`;
}

/** @param {{one: Export}} props */
function Row({ one }) {
  const row = useRef(/** @type {HTMLLIElement | null} */ (null));
  const asking = useSignal(false);
  /** Whether it is being cancelled or removed: workers may take seconds to stop. */
  const busy = useSignal(false);
  const wrong = useSignal(/** @type {string | null} */ (null));
  useEffect(() => {
    if (newest.value !== one.id) return;
    row.current?.scrollIntoView({ block: "nearest" });
    newest.value = "";
  }, []);
  const writer = writers.value.find(({ format }) => format === one.format);
  const title = writer?.title ?? one.format;
  const words = optionsWords(writer?.options ?? [], one.options);
  /** @param {(id: string) => Promise<unknown>} act */
  const tryTo = (act) => async () => {
    if (busy.value) return;
    busy.value = true;
    try {
      await act(one.id);
      wrong.value = null;
      await look();
    } catch (error) {
      wrong.value = /** @type {Error} */ (error).message;
    } finally {
      busy.value = false;
    }
  };
  return html`<li ref=${row} data-export=${one.id} data-state=${one.state}>
    <div class="head">
      <strong>${title}</strong>
      <span class="muted" title=${new Date(one.created).toLocaleString("en")}>${ago(new Date(one.ended ?? one.created), new Date())}</span>
      <span class="does">
        ${one.state === "done" &&
        html`<a class="button" href=${actions.downloadAddress(one.id)} download aria-label=${`Download ${title}`}><${Icon} name="download" size=${14} />${one.bytes === null ? "Download" : size(one.bytes)}</a>`}
        ${isGoing(one)
          ? html`<button class="button" aria-disabled=${busy.value} onClick=${tryTo(actions.cancelExport)} aria-label=${`Cancel ${title}`}>${busy.value ? "Cancelling…" : "Cancel"}</button>`
          : !asking.value &&
            html`<button class="button quiet icon-only" onClick=${() => (asking.value = true)} aria-label=${`Remove ${title}`} title="Remove"><${Icon} name="trash" size=${14} /></button>`}
      </span>
    </div>
    <p class="muted">${words.length > 0 ? words.join("\u00a0· ") : "All options at their defaults"}</p>
    <${State} one=${one} />
    ${asking.value &&
    html`<div class="asking" role="group" aria-label="Remove this export">
      <span>${one.state === "done" ? "Its dataset is gone for good then." : "Nothing of it is kept then."}</span>
      <button class="button bad" aria-disabled=${busy.value} onClick=${tryTo(actions.removeExport)}>${busy.value ? "Removing…" : "Remove"}</button>
      <button class="button quiet" ref=${focus} onClick=${() => (asking.value = false)}>Keep</button>
    </div>`}
    ${wrong.value !== null && html`<p class="problem" role="alert">${wrong.value}</p>`}
  </li>`;
}

/** @param {HTMLElement | null} element */
function focus(element) {
  element?.focus();
}

/** @param {{one: Export}} props */
function State({ one }) {
  if (isGoing(one)) {
    const left = timeLeft(one);
    const words =
      one.total === 0
        ? one.state === "queued" ? "Waits for its turn" : "Begins"
        : `${figure(one.done)} of ${many(one.total, "frame")}${left === null ? "" : `, about ${duration(left)} left`}`;
    return html`<div class="progress">
      <progress aria-label="Progress" max=${Math.max(1, one.total)} value=${one.total === 0 ? undefined : one.done}></progress>
      <span class="muted">${words}</span>
    </div>`;
  }
  if (one.state === "failed") return html`<p class="problem">${one.error}</p>`;
  if (one.state === "cancelled") return html`<p class="muted">Cancelled${one.total > 0 ? ` after ${figure(one.done)} of ${many(one.total, "frame")}` : ""}</p>`;
  const report = /** @type {Report | null} */ (one.report);
  // Those of older programs do not say.
  const losses = report?.losses ?? [];
  return html`<p class="counts-words">${countsWords(report)}</p>
    ${losses.length > 0 && html`<ul class="losses" aria-label="What it does not hold">${losses.map((text) => html`<li key=${text} class="problem">${capital(text)}</li>`)}</ul>`}`;
}

/** @param {Report | null} report */
function countsWords(report) {
  if (report === null) return "";
  const splits = Object.entries(report.splits);
  const labels = splits.reduce((sum, [, counts]) => sum + counts.labels, 0);
  const images = splits.filter(([, { images }]) => images > 0).map(([split, { images }]) => `${figure(images)} ${(SPLITS[split] ?? split).toLowerCase()}`);
  return `${many(labels, "label")} · ${images.join(", ")}`;
}
