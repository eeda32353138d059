/** Below the scene in Coverage mode: the heat map, and beside it the frames of the chosen direction. */

import { html } from "../../lib/view.js";
import * as store from "../../store.js";
import { binFrames, coverage, useBinFrames, useCoverage } from "./found.js";
import { BinFramesView } from "./frames.js";
import { HeatMap } from "./map.js";
import { seenName } from "./words.js";

export function CoverageDock() {
  useCoverage();
  useBinFrames();
  const found = coverage.value.value;
  const problem = coverage.problem.value;
  const isEmpty = store.seen.value === null;
  return html`<section class="coverage-dock" aria-label="Coverage">
    ${isEmpty
      ? html`<div class="teach alone"><p>Coverage shows from which sides an object has been filmed, and from which not.</p><p class="muted">It counts the frames that see an object's box: make one first, on the right.</p></div>`
      : html`<div class="map-column">
            <header><h2 class="heading">Seen from</h2><${Kind} /></header>
            ${problem !== null && html`<p class="problem" role="alert">${problem} <button class="button" onClick=${() => coverage.retry()}>Try again</button></p>`}
            ${found === null
              ? problem === null && html`<p class="muted" role="status">Counting the views…</p>`
              : html`<${HeatMap} coverage=${found} stale=${!coverage.isCurrent.value} name=${seenName()} />`}
          </div>
          <${BinFramesView} />`}
  </section>`;
}

const KINDS = /** @type {const} */ ([
  [false, "Equal angles", "Bins as in a map: those near the top and the bottom are small"],
  [true, "Equal area", "Cells that are all as large as each other on the sphere"],
]);

function Kind() {
  return html`<div class="kinds" role="group" aria-label="Bins of">
    ${KINDS.map(
      ([area, title, meaning]) => html`<button
        key=${title} class="button" aria-pressed=${store.byArea.value === area} title=${meaning}
        onClick=${() => {
          if (store.byArea.value === area) return;
          store.byArea.value = area;
          // A bin of the one kind is none of the other.
          store.direction.value = null;
          binFrames.value.value = null;
        }}
      >${title}</button>`,
    )}
  </div>`;
}
