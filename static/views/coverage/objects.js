/** All objects and classes, and how much of each no frame has seen; one of them is looked at. */

import { html, useLayoutEffect, useRef } from "../../lib/view.js";
import * as store from "../../store.js";
import { objects } from "./found.js";
import { percent } from "./words.js";

/** @typedef {{key: string, title: string, color: string, isClass: boolean, isChosen: boolean, unseen: number | null, choose: () => void}} Row */

/** @returns {Row[]} */
function rows() {
  const shares = new Map((objects.value.value ?? []).map((one) => [one.box_id === null ? `class ${one.class_id}` : `box ${one.box_id}`, one.empty_fraction]));
  const of = store.seen.value;
  const boxes = [...store.boxes.value.values()].sort((a, b) => a.id - b.id);
  const used = new Set(boxes.map(({ class_id }) => class_id));
  return [
    ...boxes.map((box) => ({
      key: `box ${box.id}`,
      title: box.name,
      color: store.classes.value.get(box.class_id)?.color ?? "var(--muted)",
      isClass: false,
      isChosen: of !== null && "box_id" in of && of.box_id === box.id,
      unseen: shares.get(`box ${box.id}`) ?? null,
      choose: () => {
        store.coverageClass.value = null;
        store.actions.select(box.id);
      },
    })),
    ...[...store.classes.value.values()].filter(({ id }) => used.has(id)).map((one) => ({
      key: `class ${one.id}`,
      title: `All of ${one.name}`,
      color: one.color,
      isClass: true,
      isChosen: of !== null && "class_id" in of && of.class_id === one.id,
      unseen: shares.get(`class ${one.id}`) ?? null,
      choose: () => (store.coverageClass.value = one.id),
    })),
  ];
}

export function Objects() {
  const list = useRef(/** @type {HTMLElement | null} */ (null));
  const all = rows();
  const at = Math.max(0, all.findIndex(({ isChosen }) => isChosen));
  useLayoutEffect(() => {
    const [element, row] = [list.current, list.current?.children[at]];
    if (element === null || !(row instanceof HTMLElement)) return;
    const above = row.getBoundingClientRect().top - element.getBoundingClientRect().top;
    if (above < 0) element.scrollTop += above;
    else element.scrollTop += Math.max(0, above + row.offsetHeight - element.clientHeight);
  }, [at, all.length]);
  /** @param {KeyboardEvent} event */
  const keys = (event) => {
    const to = { ArrowDown: at + 1, ArrowRight: at + 1, ArrowUp: at - 1, ArrowLeft: at - 1, Home: 0, End: all.length - 1 }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    const next = Math.max(0, Math.min(all.length - 1, to));
    all[next].choose();
    /** @type {HTMLElement | null} */ (list.current?.querySelectorAll('[role="radio"]')[next])?.focus();
  };
  const firstClass = all.findIndex(({ isClass }) => isClass);
  const problem = objects.problem.value;
  return html`<section class="panel-section coverage-objects" aria-label="Objects and how much of them is unseen">
    <div class="head"><span class="heading">Object</span><span class="heading">Unseen</span></div>
    ${problem !== null && html`<p class="problem" role="alert">${problem} <button class="button" onClick=${() => objects.retry()}>Try again</button></p>`}
    <div class="list" role="radiogroup" aria-label="Object" ref=${list} onKeyDown=${keys} data-stale=${!objects.isCurrent.value}>
      ${all.map(
        (row, i) => html`<button
          key=${row.key} class="object" role="radio" aria-checked=${row.isChosen} tabindex=${i === at ? 0 : -1} data-object=${row.key} data-first-class=${i === firstClass}
          onClick=${row.choose} aria-label=${`${row.title}${row.unseen === null ? "" : `, ${percent(row.unseen)} unseen`}`}
        >
          <span class="swatch" style=${{ background: row.color }} data-class=${row.isClass}></span>
          <span class="cut">${row.title}</span>
          <span class="share" aria-hidden="true"><span style=${{ width: `${100 * (row.unseen ?? 0)}%` }}></span></span>
          <span class="unseen">${row.unseen === null ? "" : percent(row.unseen)}</span>
        </button>`,
      )}
    </div>
  </section>`;
}
