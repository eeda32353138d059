/** What an export would write, counted by the server as the options change. */

import { html, signal, useSignalEffect } from "../../lib/view.js";
import { actions, classes, revision } from "../../store.js";
import { asked, format, isSound, refusals, refuse } from "./draft.js";
import { Advice } from "./advice.js";
import { ChoiceView } from "./choice.js";
import { figure, imagesWords, many, REASONS, size, SPLITS } from "./words.js";

/** @typedef {import("../../store.js").Schemas["Forecast"]} Forecast */
/** @typedef {Error & {status?: number, errors?: readonly {where: string, message: string}[]}} Refusal what actions reject with */

/** Milliseconds without a change before the server is asked. */
const PAUSE = 250;

/** The newest figures; they stay, dimmed, while others are counted. */
export const forecast = signal(/** @type {Forecast | null} */ (null));
/** Whether the figures are those of the options as they are now. */
export const isCurrent = signal(false);
const counting = signal(false);
const problem = signal(/** @type {string | null} */ (null));
/** Whether asking once more, without any change, may help. */
const fleeting = signal(false);
const again = signal(0);

/** Ask whenever the options or the session change, one question at a time. */
export function useForecast() {
  useSignalEffect(() => {
    const [kind, options] = [format.value, asked.value];
    const sound = isSound.value;
    void revision.value;
    void again.value;
    isCurrent.value = false;
    if (kind === "" || !sound) return void (counting.value = false);
    counting.value = true;
    const stop = new AbortController();
    const timer = setTimeout(() => void ask(kind, options, stop.signal), PAUSE);
    return () => {
      clearTimeout(timer);
      stop.abort();
    };
  });
}

/** @param {string} kind @param {object} options @param {AbortSignal} stop */
async function ask(kind, options, stop) {
  try {
    const found = await actions.previewExport(kind, options, stop);
    if (stop.aborted) return;
    forecast.value = found;
    isCurrent.value = true;
    problem.value = null;
    refusals.value = new Map();
  } catch (error) {
    if (stop.aborted) return;
    refused(/** @type {Refusal} */ (error));
  }
  counting.value = false;
}

/**
 * Show what is wrong at the options that it names, and here where it names none.
 * @param {Refusal} error
 */
export function refused(error) {
  refuse(error.errors ?? []);
  const known = refusals.value.size > 0 && !refusals.value.has("");
  problem.value = known ? null : error.message;
  fleeting.value = error.status === 0 || Number(error.status) >= 500;
}

export function ForecastView() {
  const found = forecast.value;
  const held = !isSound.value || refusals.value.size > 0;
  return html`<section class="forecast" aria-label="What would be written" aria-busy=${counting.value}>
    <header>
      <h2 class="heading">What would be written</h2>
      <span class="muted" role="status">${counting.value ? "Counting…" : held ? "Not counted: an option cannot be as it is" : ""}</span>
    </header>
    ${problem.value !== null &&
    html`<div class="row">
      <p class="problem" role="alert">${problem.value}</p>
      ${fleeting.value && html`<button class="button" onClick=${() => again.value++}>Try again</button>`}
    </div>`}
    ${found !== null &&
    html`<div class="figures" data-stale=${!isCurrent.value}>
      <${Totals} found=${found} />
      <${ChoiceView} found=${found} />
      <${Advice} found=${found} />
      <${Counts} found=${found} />
      <${Dropped} found=${found} />
    </div>`}
  </section>`;
}

/** @param {{found: Forecast}} props */
function Totals({ found }) {
  const labels = Object.values(found.splits).reduce((sum, { labels }) => sum + labels, 0);
  return html`<dl class="totals">
    <div><dt>Frames</dt><dd data-count="frames">${figure(found.frames)}</dd></div>
    <div><dt>Labels</dt><dd data-count="labels">${figure(labels)}</dd></div>
    <div title="Of all images, linked ones too"><dt>Download, about</dt><dd data-count="image_bytes">${size(found.image_bytes)}</dd></div>
    <div title="Room on the disk for the images that are not linked"><dt>New image data</dt><dd data-count="new_bytes">${found.new_bytes === 0 ? "none" : size(found.new_bytes)}</dd></div>
    <p class="muted">Images: <span data-count="images">${imagesWords(found.images)}</span></p>
  </dl>`;
}

/** Images and labels per class and split. @param {{found: Forecast}} props */
function Counts({ found }) {
  const splits = Object.entries(found.splits);
  const most = Math.max(1, ...splits.flatMap(([, counts]) => Object.values(counts.classes)));
  const colors = new Map([...classes.value.values()].map(({ name, color }) => [name, color]));
  return html`<table class="counts">
    <thead>
      <tr><th scope="col"><span class="visually-hidden">What</span></th>
        ${splits.map(([split]) => html`<th key=${split} scope="col">${SPLITS[split] ?? split}</th>`)}</tr>
    </thead>
    <tbody>
      <tr class="images"><th scope="row">Images</th>
        ${splits.map(([split, counts]) => html`<td key=${split} data-split=${split} data-count="images"><span>${figure(counts.images)}</span></td>`)}</tr>
      <tr class="negatives"><th scope="row">without a label</th>
        ${splits.map(([split, counts]) => html`<td key=${split} data-split=${split} data-count="negatives"><span>${figure(counts.negatives)}</span></td>`)}</tr>
    </tbody>
    <tbody>
      ${found.classes.map(
        ({ name }) => html`<tr key=${name} data-class=${name}>
          <th scope="row"><span class="class-name"><span class="swatch" style=${{ background: colors.get(name) ?? "var(--muted)" }}></span><span title=${name}>${name}</span></span></th>
          ${splits.map(([split, counts]) => {
            const count = counts.classes[name] ?? 0;
            return html`<td key=${split} data-split=${split} data-count="labels">
              <div class="cell">
                <span>${figure(count)}</span>
                <span class="track"><span class="bar" style=${{ width: `${(100 * count) / most}%`, background: colors.get(name) ?? "var(--muted)" }}></span></span>
              </div>
            </td>`;
          })}
        </tr>`,
      )}
    </tbody>
    <tfoot>
      <tr title="An object seen from one of 648 equal parts of the sphere round it is one"><th scope="row">Directions seen</th>
        ${splits.map(([split]) => html`<td key=${split} data-split=${split} data-count="directions"><span>${figure(found.directions.splits[split] ?? 0)}</span></td>`)}</tr>
      <tr><th scope="row">Labels</th>
        ${splits.map(([split, counts]) => html`<td key=${split} data-split=${split} data-count="all"><span>${figure(counts.labels)}</span></td>`)}</tr>
    </tfoot>
  </table>`;
}

/** @param {{found: Forecast}} props */
function Dropped({ found }) {
  const reasons = Object.entries(found.dropped).filter(([, count]) => count > 0);
  if (reasons.length === 0) return null;
  return html`<div class="dropped">
    <h3 class="muted">Boxes that get no label</h3>
    <ul>
      ${reasons.map(
        ([reason, count]) => html`<li key=${reason} data-reason=${reason}><span>${figure(count)}</span> ${REASONS[reason]?.words ?? reason}</li>`,
      )}
    </ul>
    <p class="visually-hidden">${many(reasons.reduce((sum, [, count]) => sum + count, 0), "box", "boxes")} of frames in all</p>
  </div>`;
}
