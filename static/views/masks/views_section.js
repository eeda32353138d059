/** What the views give together, and what would make it better. */

import { plural } from "../../lib/plural.js";
import { millimetres, sizeText } from "../../lib/quantity.js";
import { html, useSignal } from "../../lib/view.js";
import * as store from "../../store.js";
import { Fit, FitButton } from "./fit.js";
import { guidance, trouble, views } from "./guidance.js";
import { jobs, OutlineRest, OutlineRestButton } from "./outline_rest.js";
import { openView } from "./panes.js";
import { SupportPlane } from "./hull_options.js";
import { options } from "./subject.js";

/** Degrees between the views below which the hull is much too long. */
const NARROW = 60;

/** @param {{subject: import("./subject.js").Subject}} props */
export function Views({ subject }) {
  const planeOpen = useSignal(false);
  const told = guidance.value;
  const angle = told?.angle_degrees ?? null;
  const isNarrow = angle !== null && angle < NARROW;
  const next = told?.next_view ?? null;
  const hasPlane = options.value.ground !== null;
  return html`<section class="panel-section views-section" aria-label="Views">
    <h2 class="heading section-head">Views</h2>
    <dl class="views-facts">
      <div><dt>Angle between views</dt><dd class=${isNarrow ? "narrow" : ""}>${angle === null ? html`<span class="muted">${views.value.length < 2 ? "needs two masks" : "not known yet"}</span>` : `${angle.toFixed(0)}°${isNarrow ? ", narrow" : ""}`}</dd></div>
      <div><dt>Hull so far</dt><dd title=${told?.hull ? `${volumeText(told.hull.volume)}` : undefined}>${hullText(told)}</dd></div>
      <div><dt>Best next view</dt><dd>
        ${next === null
          ? html`<span class="muted">${told?.problem ? (isDisagreement(told.problem) ? "once the views agree" : "see below") : views.value.length === 0 ? "after the first mask" : "none is better"}</span>`
          : html`<button class="button link" title=${next.reason} onClick=${() => openView(next.frame)}>Frame ${next.frame}</button>`}
      </dd></div>
    </dl>
    <${Advice} preview=${told} />
    <div class="box-buttons">
      <${OutlineRestButton} subject=${subject} />
      <button
        class="button small" aria-pressed=${hasPlane || planeOpen.value} aria-expanded=${planeOpen.value} onClick=${() => (planeOpen.value = !planeOpen.value)}
        title="The plane that the object stands on: nothing of it is below. Cameras that look from above only need it."
      >${hasPlane ? `Plane at ${millimetres(options.value.ground ?? 0)} mm` : "Support plane"}</button>
      <${FitButton} box=${subject.box} />
    </div>
    ${planeOpen.value && html`<${SupportPlane} subject=${subject} onDone=${() => (planeOpen.value = false)} />`}
    <${OutlineRest} job=${jobs.value.get(subject.id ?? store.NEW)} id=${subject.id} />
    <${Fit} box=${subject.box} />
  </section>`;
}

/** @param {import("./guidance.js").HullPreview | null} told */
function hullText(told) {
  if (told?.hull) return sizeText(told.hull.size);
  return html`<span class="muted">${told?.problem ? (isDisagreement(told.problem) ? "none: the views disagree" : "none: see below") : "needs two masks"}</span>`;
}

/** Whether it is known how far one of them misses the others; else they may see too little, which the words below say. @param {{views: readonly {misfit_px: number | null}[]}} problem */
function isDisagreement({ views }) {
  return views.some(({ misfit_px }) => misfit_px !== null);
}

/** @param {number} volume cubic metres */
function volumeText(volume) {
  return `${(volume * 1e6).toLocaleString("en", { maximumSignificantDigits: 3 })} cm³`;
}

/** @param {{preview: import("./guidance.js").HullPreview | null}} props */
function Advice({ preview }) {
  if (trouble.value !== null) return html`<p class="problem" role="alert">${trouble.value}</p>`;
  if (preview === null) return null;
  if (preview.problem !== null) {
    const concerned = preview.problem.views.map(({ frame }) => frame);
    return html`<div class="advice">
      <p class="problem" role="status">${preview.problem.detail}</p>
      ${concerned.length > 0 &&
      html`<p class="row">${concerned.slice(0, 4).map((frame) => html`<button key=${frame} class="button link" onClick=${() => openView(frame)}>Frame ${frame}</button>`)}
        ${concerned.length > 4 && html`<span class="muted">and ${plural(concerned.length - 4, "more", "more")}</span>`}</p>`}
    </div>`;
  }
  return html`<div class="advice" role="status">${preview.warnings.map((text) => html`<p key=${text} class="muted">${text}</p>`)}</div>`;
}
