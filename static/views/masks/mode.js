/** The centre in masks mode: one to four frames side by side, in which an object is outlined. */

import { Icon } from "../../lib/icon.js";
import { html, useEffect, useLayoutEffect, useRef } from "../../lib/view.js";
import * as store from "../../store.js";
import { drawing } from "./drawing.js";
import * as guidance from "./guidance.js";
import { MaskPane } from "./pane.js";
import { activate, active, arrange, close, follow, leave, MOST, open, panes, searching, show } from "./panes.js";
import * as saving from "./saving.js";
import { begin, giveUp, subject } from "./subject.js";

export function MasksMode() {
  const root = useRef(/** @type {HTMLElement | null} */ (null));
  useLayoutEffect(() => {
    const stops = [saving.connect(), guidance.connect()];
    open();
    return () => {
      leave();
      giveUp();
      for (const stop of stops) stop();
    };
  }, []);
  useEffect(() => /** @type {HTMLElement | null} */ (root.current?.querySelector('[role="application"]'))?.focus(), []);

  const now = subject.value;
  const classOfNew = store.classOfNew.value;
  // Whoever begins to draw without having chosen an object draws a new one.
  useEffect(() => {
    if (store.selected.value === null && classOfNew !== null) begin(classOfNew);
  }, [store.selected.value, classOfNew]);
  useEffect(() => {
    if (now !== null) saving.knowClass(now.key, now.class_id);
    follow();
  }, [now?.key, now?.class_id]);

  // The film strip and the scrubber are for the pane at hand.
  const frame = store.frame.value;
  useEffect(() => {
    if (panes.value[active.value] !== undefined && panes.value[active.value].frame !== frame) show(active.value, frame);
  }, [frame]);

  const count = panes.value.length;
  return html`<section class="masks-mode" ref=${root} aria-label="Masks" data-panes=${count}>
    ${now === null
      ? html`<${NoClass} />`
      : panes.value.map(
          (pane, at) => html`<${OnePane} key=${pane.id} subject=${now} frame=${pane.frame} at=${at} />`,
        )}
    ${now !== null && count === 1 && searching.value &&
    html`<div class="mask-waiting"><p class="muted" role="status">Looking for a frame from another side…</p></div>`}
    ${now !== null && html`<${Arrangement} />`}
  </section>`;
}

/** @param {{subject: import("./subject.js").Subject, frame: number, at: number}} props */
function OnePane({ subject, frame, at }) {
  const { key, color, name, box } = subject;
  const preview = guidance.guidance.value;
  const overlays = (preview?.overlays ?? []).filter((overlay) => overlay.frame === frame);
  return html`<${MaskPane}
    boxKey=${key} frame=${frame} color=${color} name=${name} note=${noteOf(frame, overlays)} guidance=${overlays}
    problem=${problemOf(key, frame)} locked=${box?.locked ?? false} active=${at === active.value}
    onFrame=${(/** @type {number} */ to) => show(at, to)} onActive=${() => activate(at)}
    onClose=${panes.value.length > 1 ? () => close(at) : undefined}
  />`;
}

/** What there is to say of a frame beside its number. @param {number} frame @param {readonly {kind: string}[]} overlays */
function noteOf(frame, overlays) {
  const mask = store.masksOfSelected.value.find((one) => one.frame === frame);
  if (mask !== undefined && !mask.accepted) return "proposed: is it right?";
  const isOpen = subject.value !== null && drawing.of(subject.value.key, frame).open.value !== null;
  if (isOpen || guidance.views.value.some((view) => view.frame === frame)) return isOpen || mask === undefined ? "drawing" : WORDS[mask.origin];
  if (guidance.isBlind(frame)) return "the object is not in sight here: take another frame";
  if (overlays.some(({ kind }) => kind === "hull")) return "the hull so far, seen from here";
  if (overlays.some(({ kind }) => kind === "band")) return "the object lies inside the dashed band";
  return guidance.views.value.length === 0 ? `outline ${subject.value?.name ?? "the object"} here` : "";
}

/** @type {Record<import("../../store.js").MaskOrigin, string>} */
const WORDS = { drawn: "drawn", smart: "drawn with the smart tool", proposed: "outlined by the machine" };

/** @param {string} key @param {number} frame */
function problemOf(key, frame) {
  const told = saving.refused.value.get(saving.place(key, frame));
  if (told !== undefined) return told;
  const problem = guidance.guidance.value?.problem ?? null;
  const view = problem?.views.find((one) => one.frame === frame);
  return problem === null || view === undefined ? null : saving.misfitWords(view.misfit_px, problem.detail);
}

const NAMES = ["One frame", "Two frames side by side", "Three frames", "Four frames"];

function Arrangement() {
  const count = panes.value.length;
  return html`<div class="arrangement" role="group" aria-label="Frames side by side">
    ${Array.from({ length: MOST }, (_, i) => i + 1).map(
      (wanted) => html`<button
        key=${wanted} class="button quiet icon-only" aria-pressed=${count === wanted} aria-label=${NAMES[wanted - 1]} title=${NAMES[wanted - 1]}
        disabled=${wanted > store.frames.value} onClick=${() => arrange(wanted)}
      ><${Layout} count=${wanted} /></button>`,
    )}
  </div>`;
}

/** A small picture of an arrangement. @param {{count: number}} props */
function Layout({ count }) {
  const lines = ["", "M8 2V14", "M8 2V14M8 8H14", "M8 2V14M2 8H14"][count - 1];
  return html`<svg width="16" height="16" viewBox="0 0 16 16" aria-hidden="true" fill="none" stroke="currentColor" stroke-width="1.3">
    <rect x="1.5" y="2" width="13" height="12" rx="2" /><path d=${lines} />
  </svg>`;
}

function NoClass() {
  return html`<div class="mask-waiting">
    <div class="mask-empty">
      <${Icon} name="waypoints" size=${24} />
      <p>An object that is outlined in two frames or more gets its box by itself.</p>
      <p class="muted">Add a class first, on the right: a kind of object, such as “mug”.</p>
    </div>
  </div>`;
}
