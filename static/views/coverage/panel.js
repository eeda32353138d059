/** The right side in Coverage mode: which object, what is seen of it, how it is counted, and where to look next. */

import { Icon } from "../../lib/icon.js";
import { html, useEffect, useId, useLayoutEffect, useSignal } from "../../lib/view.js";
import * as store from "../../store.js";
import { NoBoxes } from "../new_box.js";
import { coverage, useObjects } from "./found.js";
import { Objects } from "./objects.js";
import { NextViews, PlanViews } from "./next_views.js";
import { percent } from "./words.js";

export function CoveragePanel() {
  useObjects();
  // Who selects a box elsewhere means that one, not its class.
  const box = store.selected.value;
  useEffect(() => {
    const of = store.coverageClass.peek();
    if (of !== null && box !== null && store.boxes.peek().get(box)?.class_id !== of) store.coverageClass.value = null;
  }, [box]);
  // A direction is one of an object: others have other frames there.
  const of = JSON.stringify(store.seen.value);
  const last = useSignal(of);
  useLayoutEffect(() => {
    if (last.peek() !== of) store.direction.value = null;
    last.value = of;
  }, [of]);
  if (store.seen.value === null) return html`<section class="panel-section"><${NoBoxes} /></section>`;
  return html`<${Objects} /><${Numbers} /><${HowCounted} /><${NextViews} />`;
}

/** The main button. */
export function CoverageWayOn() {
  return store.seen.value === null ? null : html`<${PlanViews} />`;
}

function Numbers() {
  const found = coverage.value.value;
  if (found === null) return null;
  const unseen = found.equal_area.empty_fraction;
  const facts = [
    ["Frames", found.frames.toLocaleString("en")],
    ["Views", found.views.toLocaleString("en")],
    ["Unseen", percent(unseen)],
  ];
  return html`<section class="panel-section coverage-numbers" aria-label="How much is seen" data-stale=${!coverage.isCurrent.value}>
    <dl>${facts.map(([name, value]) => html`<div key=${name}><dt>${name}</dt><dd data-number=${name.toLowerCase()}>${value}</dd></div>`)}</dl>
    <p class="muted">${found.views === 0
      ? store.counting.value.min_visible > 0
        ? "No frame shows so much of it. Ask for less of it to be visible, or move its box to where the cameras look."
        : "No frame shows it. Move its box to where the cameras look."
      : unseen === 0
        ? "Frames see it from every direction."
        : `From ${percent(unseen)} of all directions no frame sees it.`}</p>
  </section>`;
}

const WIDTHS = [10, 15, 20, 30];

function HowCounted() {
  const id = useId();
  const typed = useSignal(/** @type {string | null} */ (null));
  const problem = useSignal(/** @type {string | null} */ (null));
  const { degrees, min_visible } = store.counting.value;
  const of = store.seen.value;
  /** @param {string} text */
  const keep = (text) => {
    const share = Number(text.replace("%", "").replace(",", ".").trim() || NaN);
    if (!(share >= 0 && share <= 100)) {
      problem.value = "A share from 0 to 100 %, such as 50.";
      return;
    }
    typed.value = problem.value = null;
    store.counting.value = { ...store.counting.peek(), min_visible: share / 100 };
  };
  return html`<section class="panel-section counting" aria-label="How it is counted">
    <div class="setting"><label for=${`${id}-bins`}>Size of a bin</label>
      <select
        class="field" id=${`${id}-bins`} value=${degrees}
        onChange=${(/** @type {any} */ event) => {
          store.direction.value = null;
          store.counting.value = { ...store.counting.peek(), degrees: Number(event.currentTarget.value) };
        }}
      >${WIDTHS.map((width) => html`<option key=${width} value=${width}>${width}°</option>`)}</select>
    </div>
    <div class="setting"><label for=${`${id}-visible`}>At least visible</label>
      <span class="with-unit"><input
        class="field number" id=${`${id}-visible`} inputmode="decimal" value=${typed.value ?? String(+(100 * min_visible).toFixed(2))} aria-invalid=${problem.value !== null}
        title="Views in which less of the object is seen do not count" aria-describedby=${problem.value === null ? undefined : `${id}-problem`}
        onInput=${(/** @type {any} */ event) => (typed.value = event.currentTarget.value)}
        onChange=${(/** @type {any} */ event) => keep(event.currentTarget.value)}
      /><span class="muted">%</span></span>
    </div>
    ${problem.value !== null && html`<p class="problem" role="alert" id=${`${id}-problem`}>${problem.value}</p>`}
    ${of !== null &&
    html`<div class="downloads">
      ${/** @type {const} */ ([["png", "Picture"], ["json", "Numbers"]]).map(
        ([as, title]) => html`<a key=${as} class="button" href=${store.actions.coverageAddress(of, store.counting.value, as)} download=${`coverage.${as}`} title=${as === "png" ? "Both histograms as PNG" : "Both histograms as JSON"}>
          <${Icon} name="download" size=${14} />${title}</a>`,
      )}
      <a class="button" href=${store.actions.reportAddress()} target="_blank" rel="noopener" title="What an export would hold and what to mend first, on a page of its own">
        <${Icon} name="clipboard-list" size=${14} />Report</a>
    </div>`}
  </section>`;
}
