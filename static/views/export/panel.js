/** The export panel: which dataset and how, and beside it what would be in it. */

import { Icon } from "../../lib/icon.js";
import { html, useEffect, useSignal } from "../../lib/view.js";
import { actions } from "../../store.js";
import { asked, changes, format, isSound, mistakes, offer, options, refusals, reset } from "./draft.js";
import { forecast, ForecastView, isCurrent, refused, useForecast } from "./forecast.js";
import { Formats } from "./formats.js";
import { OptionGroup } from "./option_group.js";
import { begin, exports, isGoing, PastExports, watch } from "./past.js";
import { FormatPicture } from "./picture.js";
import { many } from "./words.js";

/** @typedef {import("./draft.js").Option} Option */

/** Options by what they are about: those of an object by its name, the others by theirs; what is new is about labels. */
const CHOOSING = ["count", "by", "near_degrees", "near_frames", "sector", "sector_box"].map((name) => `frames.${name}`);
const GROUPS = [
  { title: "Which of these frames", holder: "choosing", has: (/** @type {Option} */ { name }) => CHOOSING.includes(name) },
  { title: "Frames", holder: "frames", has: (/** @type {Option} */ { name }) => name.startsWith("frames.") || name === "sessions" },
  { title: "Images", holder: "images", has: (/** @type {Option} */ { name }) => name === "images" },
  { title: "Split", holder: "split", has: (/** @type {Option} */ { name }) => name.startsWith("split.") },
  { title: "Labels", holder: "labels", has: () => true },
];
/** Of an address; servers on the way refuse longer ones. */
const LONGEST_ADDRESS = 8000;
const ORDER = ["frames", "choosing", "images", "labels", "split"];

export function ExportPanel() {
  const problem = useSignal(/** @type {string | null} */ (null));
  const load = () => {
    problem.value = null;
    actions.formats().then(
      (found) => offer(found.writers),
      (error) => (problem.value = error.message),
    );
  };
  useEffect(load, []);
  useEffect(watch, []);
  useForecast();
  return html`<div class="export-panel">
    <div class="options-column">
      <header class="top">
        <h1>Export training set</h1>
        ${changes.value.size > 0 &&
        html`<button class="button" onClick=${() => reset([...changes.value.keys(), ...mistakes.value.keys()])}>Reset ${many(changes.value.size, "option")}</button>`}
      </header>
      ${problem.value !== null &&
      html`<div class="row"><p class="problem" role="alert">${problem.value}</p><button class="button" onClick=${load}>Try again</button></div>`}
      <${Formats} />
      ${grouped().map(({ title, holder, found }) => html`<${OptionGroup} key=${holder} title=${title} holder=${holder} options=${found} />`)}
    </div>
    <div class="outcome-column">
      <div class="outcome"><${FormatPicture} /><${ForecastView} /><${PastExports} /></div>
      <${Start} />
    </div>
  </div>`;
}

function grouped() {
  const found = new Map(ORDER.map((holder) => [holder, /** @type {Option[]} */ ([])]));
  for (const option of options.value) {
    const group = GROUPS.find(({ has }) => has(option));
    if (group !== undefined) found.get(group.holder)?.push(option);
  }
  return ORDER.flatMap((holder) => {
    const of = found.get(holder) ?? [];
    const title = GROUPS.find((group) => group.holder === holder)?.title ?? holder;
    return of.length > 0 ? [{ title, holder, found: of }] : [];
  });
}

/** Go to what has to be set right first. */
function toWrong() {
  const wrong = document.querySelector('.option :is(input[aria-invalid="true"], [aria-invalid="true"] input:checked)');
  if (wrong instanceof HTMLElement) wrong.focus();
}

/** The way to the report of what would be written. @param {{held: boolean}} props */
function Report({ held }) {
  const address = actions.reportAddress(asked.value);
  const why = held
    ? "Set right first what is marked"
    : asked.value.sessions !== undefined
      ? "A report is of one session: take out those that are merged with it"
      : address.length > LONGEST_ADDRESS
        ? "So many single frames are more than an address holds: ars-web report takes them"
        : null;
  const face = html`<${Icon} name="clipboard-list" size=${14} />Report`;
  if (why !== null) return html`<span class="button" aria-disabled="true" title=${why}>${face}</span>`;
  return html`<a
    class="button" href=${address} target="_blank" rel="noopener" title="What these options would write and what to mend first, on a page of its own"
  >${face}</a>`;
}

function Start() {
  const starting = useSignal(false);
  const problem = useSignal(/** @type {string | null} */ (null));
  const held = !isSound.value || refusals.value.size > 0 || format.value === "";
  const frames = isCurrent.value ? forecast.value?.frames : undefined;
  const start = async () => {
    if (held) return toWrong();
    if (starting.value) return;
    starting.value = true;
    problem.value = null;
    try {
      const made = await actions.startExport(format.value, asked.value);
      await begin(made);
    } catch (error) {
      refused(/** @type {Error} */ (error));
      problem.value = refusals.value.size > 0 ? null : /** @type {Error} */ (error).message;
    } finally {
      starting.value = false;
    }
  };
  const going = exports.value?.filter(isGoing).length ?? 0;
  return html`<footer class="start">
    ${problem.value !== null && html`<p class="problem" role="alert">${problem.value}</p>`}
    <p class="visually-hidden" role="status">${going > 0 ? `${many(going, "export")} running` : "No export is running"}</p>
    <div class="row">
      <${Report} held=${held} />
      <button class="button main" aria-disabled=${held || starting.value} onClick=${start}>
        ${starting.value ? "Starting…" : frames === undefined ? "Start export" : `Export ${many(frames, "frame")}`}
      </button>
    </div>
  </footer>`;
}
