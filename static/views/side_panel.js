/** The right panel: the boxes and the selected one's numbers, or the history; the way on at the bottom. */

import { command } from "./commands.js";
import { html } from "../lib/view.js";
import * as store from "../store.js";
import { BoxNumbers } from "./box_numbers.js";
import { BoxesList } from "./boxes_list.js";
import { addingClass, Classes } from "./classes.js";
import { ConflictCard } from "./conflict_card.js";
import { HistoryPanel } from "./history_panel.js";
import { CoveragePanel, CoverageWayOn } from "./coverage/panel.js";
import { MakeBox, MasksPanel } from "./masks/panel.js";
import { NewBox } from "./new_box.js";
import { TellingFrames } from "./telling_frames.js";

const TABS = /** @type {const} */ ([
  ["boxes", "Boxes"],
  ["history", "History"],
]);

export function SidePanel() {
  const shown = store.sidePanel.value;
  const inMasks = store.mode.value === "masks";
  const inCoverage = store.mode.value === "coverage";
  return html`<div class="panel-top">
      <${Tabs} />
      ${shown === "boxes" && !inCoverage && (inMasks || store.boxes.value.size > 0) && html`<${NewBox} />`}
    </div>
    <${ConflictCard} />
    <div class="panel-body" role="tabpanel" id="panel-body" aria-labelledby=${`tab-${shown}`}>
      ${shown === "boxes" && inCoverage
        ? html`<${CoveragePanel} />`
        : shown === "boxes"
        ? html`<${BoxesList} />${inMasks ? html`<${MasksPanel} />` : html`<${BoxNumbers} /><${TellingFrames} />`}${(!inMasks || addingClass.value || store.classes.value.size === 0) && html`<${Classes} />`}${!inMasks && html`<${Facts} />`}`
        : html`<${HistoryPanel} />`}
    </div>
    ${inMasks && html`<${MakeBox} />`}
    ${inCoverage && html`<${CoverageWayOn} />`}
    ${!inMasks && !inCoverage && store.mode.value !== "export" &&
    html`<div class="panel-foot">
      <button class="button main" onClick=${command("mode-export").run}>Export training set</button>
    </div>`}`;
}

function Tabs() {
  /** @param {KeyboardEvent} event */
  const arrows = (event) => {
    if (event.key !== "ArrowLeft" && event.key !== "ArrowRight") return;
    event.preventDefault();
    event.stopPropagation();
    const next = store.sidePanel.value === "boxes" ? "history" : "boxes";
    store.sidePanel.value = next;
    document.getElementById(`tab-${next}`)?.focus();
  };
  return html`<div class="panel-tabs" role="tablist" aria-label="Side panel" onKeyDown=${arrows}>
    ${TABS.map(([tab, title]) => {
      const isShown = store.sidePanel.value === tab;
      return html`<button
        key=${tab} id=${`tab-${tab}`} role="tab" class="heading" aria-selected=${isShown} aria-controls="panel-body" tabindex=${isShown ? 0 : -1}
        title=${tab === "history" ? `History (${command("history").keys[0]})` : undefined}
        onClick=${() => (store.sidePanel.value = tab)}
      >${title}</button>`;
    })}
  </div>`;
}

function Facts() {
  const session = store.session.value;
  if (session === null) return null;
  const facts = [
    ["Frames", store.frames.value],
    ["Boxes", store.boxes.value.size],
    ["Classes", store.classes.value.size],
  ];
  return html`<dl class="facts">
    ${facts.map(([name, count]) => html`<div key=${name}><dt>${name}</dt><dd>${count.toLocaleString("en")}</dd></div>`)}
  </dl>`;
}
