/** Where to look next: cameras that would fill the holes, in the order of a short way. */

import { Icon } from "../../lib/icon.js";
import { fixed, millimetres } from "../../lib/quantity.js";
import { html, useEffect, useId, useMemo, useRef } from "../../lib/view.js";
import * as store from "../../store.js";
import { count, forget, limits, make, mistakes, ofAll, plan, planning, problem, wristRows } from "./plan.js";
import { seenName } from "./words.js";

/** @typedef {import("../../store.js").Tour} Tour */
/** @typedef {import("./plan.js").LimitName} LimitName */

/** @type {[LimitName, string, string, string][]} */
const LIMITS = [
  ["distance", "Distance", "mm", "From the camera to the object"],
  ["height", "Height", "mm", "Of the camera above the world's zero"],
  ["tilt", "Tilt", "°", "How far the camera looks down: 0° level, 90° straight down"],
];

/** Why a direction is filled by no view. @type {Record<Tour["cells_left"][number]["reason"], string>} */
const REASONS = {
  height: "too high or too low for the camera",
  tilt: "beyond the tilt that is allowed",
  near: "another object would be touched",
  large: "too near: it would not fit into the image",
  small: "too far: it would be small",
  hidden: "other objects hide it from there",
  later: "would take more views",
};

export function NextViews() {
  const id = useId();
  const wrong = mistakes.value;
  return html`<section class="panel-section next-views" aria-label="Where to look next">
    <h2 class="heading section-head">Where to look next</h2>
    <div class="setting"><label for=${`${id}-of`}>For</label>
      <select class="field wide" id=${`${id}-of`} value=${ofAll.value ? "all" : "seen"} onChange=${(/** @type {any} */ event) => (ofAll.value = event.currentTarget.value === "all")}>
        <option value="seen">${seenName()}</option><option value="all">all objects</option>
      </select>
    </div>
    <div class="setting"><label for=${`${id}-count`}>Views at most</label>
      <input class="field" id=${`${id}-count`} inputmode="numeric" value=${count.value} aria-invalid=${wrong.has("count")} onInput=${(/** @type {any} */ event) => (count.value = event.currentTarget.value.trim())} />
    </div>
    <${Mistake} of="count" />
    ${LIMITS.map(
      ([name, title, unit, meaning]) => html`<div class="setting" key=${name} role="group" aria-label=${title} title=${meaning}><span>${title}</span>
          <span class="with-unit">${["least", "most"].map(
            (which, i) => html`<input
              key=${which} class="field limit" aria-label=${`${title}, ${which}`} placeholder=${usual(name, i)} value=${limits.value[name][i]} aria-invalid=${wrong.has(name)} spellcheck=${false}
              onInput=${(/** @type {any} */ event) => {
                const both = /** @type {import("./plan.js").Typed} */ ([...limits.value[name]]);
                both[i] = event.currentTarget.value;
                limits.value = { ...limits.value, [name]: both };
              }}
            />`,
          )}<span class="muted unit">${unit}</span></span>
        </div>
        <${Mistake} key=${`${name}-mistake`} of=${name} />`,
    )}
    ${problem.value !== null && html`<${Refused} text=${problem.value} />`}
    ${plan.value === null
      ? html`<p class="muted small">Where nothing is given, views stay as far away and as high as the recorded frames.</p>`
      : html`<${Result} tour=${plan.value.tour} stale=${plan.value.revision !== store.revision.value} />`}
  </section>`;
}

/** Why there is no plan, where the button that asked for one may have left it out of sight. @param {{text: string}} props */
function Refused({ text }) {
  const root = useRef(/** @type {HTMLElement | null} */ (null));
  useEffect(() => root.current?.scrollIntoView({ block: "nearest" }), [text]);
  return html`<p class="problem" role="alert" ref=${root}>${text}</p>`;
}

/** @param {{of: "count" | LimitName}} props */
function Mistake({ of }) {
  const found = mistakes.value.get(of);
  return found === undefined ? null : html`<p class="problem" role="alert">${found}</p>`;
}

/** What the last plan kept to where nothing was given. @param {LimitName} name @param {number} i */
function usual(name, i) {
  const kept = plan.value?.tour.limits[name][i];
  if (kept === undefined) return i === 0 ? "from" : "to";
  return name === "tilt" ? fixed((kept * 180) / Math.PI, 0) : millimetres(kept, 0);
}

/** The main button. */
export function PlanViews() {
  const held = mistakes.value.size > 0 || planning.value;
  return html`<div class="panel-foot">
    <button class="button main" aria-disabled=${held} onClick=${() => void make()} title="Camera poses that fill the emptiest directions, in the order of a short way">
      ${planning.value ? "Planning…" : plan.value === null ? "Plan views" : "Plan again"}
    </button>
  </div>`;
}

/** @param {{tour: Tour, stale: boolean}} props */
function Result({ tour, stale }) {
  const { views, cells_empty, cells_filled, length } = tour;
  const chosen = store.direction.value;
  const root = useRef(/** @type {HTMLElement | null} */ (null));
  useEffect(() => root.current?.scrollIntoView({ block: "nearest" }), [tour]);
  return html`<div class="tour" ref=${root} data-stale=${stale} aria-label="Planned views" role="group">
    <p role="status">${views.length === 0
      ? cells_empty === 0 ? "Every direction has been seen: there is nothing to fill." : "No view within these limits fills a hole. Allow more."
      : html`<strong>${views.length} ${views.length === 1 ? "view" : "views"}</strong> fill ${cells_filled.toLocaleString("en")} of ${cells_empty.toLocaleString("en")} holes, on a way of ${length.toFixed(2)} m.`}
      ${stale && html`<span class="problem">The session was changed since: plan again.</span>`}</p>
    ${tour.doubts.map((doubt) => html`<p class="problem" key=${doubt}>${doubt[0].toUpperCase()}${doubt.slice(1)}.</p>`)}
    ${views.length > 0 &&
    html`<ol class="tour-views">
      ${views.map((view, i) => {
        const box = store.boxes.value.get(view.box_id);
        const first = view.fills.find(({ box_id }) => box_id === view.box_id) ?? view.fills[0];
        const isShown = first !== undefined && chosen?.by === "area" && chosen.index === first.cell && store.sphereBox.value === first.box_id;
        return html`<li key=${i}><button
          aria-pressed=${isShown} title="Show the direction that it fills"
          aria-label=${`View ${i + 1} of ${box?.name ?? "an object"}, ${millimetres(view.distance, 0)} mm away, tilted ${fixed((view.tilt * 180) / Math.PI, 0)}°, fills ${view.fills.length}`}
          onClick=${() => first !== undefined && showFill(first)}
        >
          <span class="number" aria-hidden="true">${i + 1}</span>
          <span class="swatch" style=${{ background: store.classes.value.get(box?.class_id ?? -1)?.color ?? "var(--muted)" }}></span>
          <span class="cut">${box?.name ?? "deleted"}</span>
          <span class="muted">${millimetres(view.distance, 0)} mm, ${fixed((view.tilt * 180) / Math.PI, 0)}°</span>
          <span class="fills">+${view.fills.length}</span>
        </button></li>`;
      })}
    </ol>`}
    <${Left} tour=${tour} />
    <div class="downloads">
      ${views.length > 0 && html`<${Download} name="tour.json" title="Tour" text=${JSON.stringify(tour, null, 1)} type="application/json" />
        <${WristDownload} tour=${tour} />`}
      <button class="button" onClick=${forget}>Clear</button>
    </div>
  </div>`;
}

/** @param {Tour["views"][number]["fills"][number]} fill */
function showFill({ box_id, cell }) {
  store.coverageClass.value = null;
  if (store.selected.value !== box_id) store.actions.select(box_id);
  store.byArea.value = true;
  // What is chosen is forgotten where another object is looked at, once that is drawn.
  setTimeout(() => (store.direction.value = { by: "area", index: cell }));
}

/** @param {{tour: Tour}} props */
function Left({ tour }) {
  const reasons = Object.entries(tour.left_by_reason).filter(([, number]) => number > 0);
  if (reasons.length === 0) return null;
  return html`<details class="left"><summary>${tour.cells_left.length.toLocaleString("en")} holes stay</summary>
    <ul>${reasons.map(([reason, number]) => html`<li key=${reason} data-reason=${reason}><strong>${number.toLocaleString("en")}</strong> ${REASONS[/** @type {keyof typeof REASONS} */ (reason)]}</li>`)}</ul>
  </details>`;
}

/** @param {{tour: Tour}} props */
function WristDownload({ tour }) {
  const rows = useMemo(() => wristRows(tour), [tour]);
  if (rows === null) return html`<span class="button" aria-disabled="true" title="The recording does not say how the robot holds the camera: only a recording in this program's own format with hand_eye has that">Wrist poses</span>`;
  return html`<${Download} name="wrist_poses.txt" title="Wrist poses" text=${rows} type="text/plain" />`;
}

/** @param {{name: string, title: string, text: string, type: string}} props */
function Download({ name, title, text, type }) {
  const address = useMemo(() => URL.createObjectURL(new Blob([text], { type })), [text]);
  useEffect(() => () => URL.revokeObjectURL(address), [address]);
  return html`<a class="button" href=${address} download=${name}><${Icon} name="download" size=${14} />${title}</a>`;
}
