/** The heat map: every direction round an object as a map of the sphere, hot where it is seen, holes marked. */

import { html, useEffect, useMemo, useRef, useSignal } from "../../lib/view.js";
import { binsOf, byArea, counting, direction } from "../../store.js";
import { areaWords, countWords, heat, placeWords, rowsOf } from "./bins.js";

/** @typedef {import("./bins.js").Bin} Bin */

/** Of a hole's dot, degrees. */
const DOT = 1.9;

/** Where the axes are named: azimuths along the bottom, polar angles on the left. */
const AROUND = /** @type {const} */ ([[-180, "−180°"], [-90, "−90°"], [0, "0° x"], [90, "90° y"], [180, "180°"]]);
const DOWN = /** @type {const} */ ([[0, "top z"], [90, "side"], [180, "below"]]);

/** @param {{coverage: import("../../store.js").Coverage, stale: boolean, name: string}} props `name`: of what is seen */
export function HeatMap({ coverage, stale, name }) {
  const by = byArea.value ? "area" : "angle";
  const rows = useMemo(() => rowsOf(coverage, by), [coverage, by]);
  const most = useMemo(() => Math.max(1, ...rows.flat().map(({ count }) => count)), [rows]);
  const grid = useRef(/** @type {SVGSVGElement | null} */ (null));
  /** The bin that the keys go from. */
  const active = useSignal(/** @type {number | null} */ (null));
  const hovered = useSignal(/** @type {number | null} */ (null));
  const focused = useSignal(false);

  const all = useMemo(() => new Map(rows.flat().map((bin) => [bin.index, bin])), [rows]);
  // Until bins of another size are counted, those that are shown have no place among the ones asked for.
  const isOther = coverage.counts.length !== binsOf(counting.value).azimuth_bins;
  const chosen = direction.value?.by === by && !isOther ? (all.get(direction.value.index) ?? null) : null;
  const at = all.get(active.value ?? -1) ?? chosen ?? rows[Math.floor(rows.length / 2)][0];
  const read = all.get(hovered.value ?? -1) ?? (focused.value ? at : chosen);
  useEffect(() => {
    if (chosen !== null) active.value = chosen.index;
  }, [chosen?.index]);

  /** @param {Bin} bin */
  const go = (bin) => {
    focused.value = true;
    active.value = bin.index;
    const cell = grid.current?.querySelector(`[data-index="${bin.index}"]`);
    if (cell instanceof SVGElement) cell.focus();
  };
  /** @param {Bin} bin */
  const choose = (bin) => {
    active.value = bin.index;
    if (bin.reachable && !isOther) direction.value = { by, index: bin.index };
  };
  /** @param {KeyboardEvent} event */
  const keys = (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "Enter" || event.key === " ") choose(at);
    else {
      const to = stepped(rows, at, event.key);
      if (to === null) return;
      go(to);
    }
    // Elsewhere these keys would move the box.
    event.preventDefault();
    event.stopPropagation();
  };
  /** @param {Event} event @returns {number | null} */
  const under = (event) => {
    const cell = /** @type {Element} */ (event.target).closest("[data-index]");
    return cell === null ? null : Number(cell.getAttribute("data-index"));
  };

  return html`<div class="heat-map" data-stale=${stale} data-other=${isOther}>
    <svg
      ref=${grid} viewBox="-212 -5 398 200" role="grid" aria-label=${`Views of ${name} by direction`} aria-busy=${stale}
      onKeyDown=${keys} onPointerOver=${(/** @type {Event} */ event) => (hovered.value = under(event))} onPointerLeave=${() => (hovered.value = null)}
      onFocusIn=${(/** @type {any} */ event) => (focused.value = event.target.matches(":focus-visible"))} onFocusOut=${() => (focused.value = false)}
      onClick=${(/** @type {Event} */ event) => {
        const bin = all.get(under(event) ?? -1);
        if (bin !== undefined) choose(bin);
      }}
    >
      <defs>
        <pattern id="folded" width="5" height="5" patternUnits="userSpaceOnUse" patternTransform="rotate(45)"><rect width="5" height="5" class="folded-ground" /><rect width="1.4" height="5" class="folded-line" /></pattern>
      </defs>
      ${rows.map(
        (row, r) => html`<g key=${`${by} ${r}`} role="row" aria-rowindex=${r + 1}>
          ${row.map(
            (bin) => html`<rect
              key=${bin.index} class="bin" role="gridcell" tabindex=${bin === at ? 0 : -1} data-index=${bin.index} data-count=${bin.count} data-reachable=${bin.reachable}
              x=${bin.left} y=${bin.top} width=${bin.right - bin.left} height=${bin.bottom - bin.top}
              aria-selected=${bin === chosen} aria-disabled=${!bin.reachable} aria-label=${`${placeWords(bin)}: ${countWords(bin)}`}
              style=${{ fill: !bin.reachable ? "url(#folded)" : bin.count === 0 ? "var(--hole)" : heat(bin.count, most) }}
              onFocus=${() => (active.value = bin.index)}
            />`,
          )}
        </g>`,
      )}
      <g class="dots" aria-hidden="true">
        ${rows.flat().filter(({ count, reachable }) => reachable && count === 0).map(
          (bin) => html`<circle key=${`${by} ${bin.index}`} cx=${(bin.left + bin.right) / 2} cy=${(bin.top + bin.bottom) / 2} r=${Math.min(DOT, (bin.bottom - bin.top) / 7)} />`,
        )}
      </g>
      ${chosen !== null && html`<${Ring} bin=${chosen} kind="chosen" />`}
      ${focused.value && html`<${Ring} bin=${at} kind="at" />`}
      <g class="axes" aria-hidden="true">
        ${AROUND.map(([value, words]) => html`<text key=${value} x=${value} y="191" text-anchor=${value === -180 ? "start" : value === 180 ? "end" : "middle"}>${words}</text>`)}
        ${DOWN.map(([value, words]) => html`<text key=${value} x="-184" y=${value === 0 ? 8 : value === 180 ? 178 : 93} text-anchor="end">${words}</text>`)}
      </g>
    </svg>
    <p class="reading" role="status">${isOther
      ? html`<span class="muted">Counting the views…</span>`
      : read === null
      ? html`<span class="muted">Arrow keys walk the bins; Enter or a click shows frames.</span>`
      : html`<strong>${countWords(read)}</strong> <span class="muted">${placeWords(read)}<span class="area"> · ${areaWords(read)}</span></span>`}</p>
    <${Legend} most=${most} isSeen=${coverage.views > 0} hasFolded=${rows.flat().some(({ reachable }) => !reachable)} />
  </div>`;
}

/** @param {{bin: Bin, kind: "chosen" | "at"}} props */
function Ring({ bin, kind }) {
  const place = { x: bin.left, y: bin.top, width: bin.right - bin.left, height: bin.bottom - bin.top };
  return html`<g class=${`ring ${kind}`} aria-hidden="true"><rect class="halo" ...${place} /><rect ...${place} /></g>`;
}

/** @param {{most: number, isSeen: boolean, hasFolded: boolean}} props */
function Legend({ most, isSeen, hasFolded }) {
  return html`<div class="legend" role="group" aria-label="What the colours mean">
    ${isSeen && html`${most > 1 && html`<span>1</span>`}<span class="ramp" data-flat=${most === 1}></span><span>${most.toLocaleString("en")} ${most === 1 ? "view" : "views"}</span>`}
    <span class="key"><span class="hole"></span>no view</span>
    ${hasFolded && html`<span class="key"><span class="folded"></span>looks the same elsewhere</span>`}
  </div>`;
}

/** Where a key leads to; null: it leads nowhere. @param {Bin[][]} rows @param {Bin} from @param {string} key */
function stepped(rows, from, key) {
  const r = rows.findIndex((row) => row.includes(from));
  const row = rows[r];
  const place = row.indexOf(from);
  switch (key) {
    case "ArrowLeft":
    case "ArrowRight":
      // The map's left and right edges are one.
      return row[(place + (key === "ArrowRight" ? 1 : -1) + row.length) % row.length];
    case "ArrowUp":
    case "ArrowDown": {
      const next = rows[r + (key === "ArrowDown" ? 1 : -1)];
      const middle = (from.left + from.right) / 2;
      return next?.find(({ left, right }) => left <= middle && middle < right) ?? from;
    }
    case "Home":
      return row[0];
    case "End":
      return row[row.length - 1];
    default:
      return null;
  }
}
