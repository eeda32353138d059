/** The contact sheet: every so many frames at once, with all boxes drawn, to see at a glance where one is off. */

import { Dialog } from "../lib/dialog.js";
import { Icon } from "../lib/icon.js";
import { niceStep, niceSteps } from "../lib/nice_step.js";
import { useScrollPlace } from "../lib/scroll_place.js";
import { html, useEffect, useLayoutEffect, useMemo, useRef, useState } from "../lib/view.js";
import { WholeField } from "../lib/whole_field.js";
import { actions, frame, frames, markFunction, markShape, mode, overlay, revision, selectedBox, shownBoxes } from "../store.js";
import { AsExported } from "./as_exported.js";
import { ContactLabels } from "./contact_labels.js";
import { ContactTile } from "./contact_tile.js";
import { FrameMarks } from "./frame_marks.js";

/** Tiles that the sheet opens with, at most. With steps of 1, 2, 5, … there are then at least 24, if there are so many frames. */
const FIRST_SHOWN = 60;
const GAP = 12;
const PADDING = 20;
const CAPTION = 24;
const SMALLEST = 120;
const LARGEST = 480;
const FIRST_WIDTH = 208;
/** Rows kept ready above and below what is in sight. */
const MARGIN = 1;

export function ContactSheet() {
  const sheet = useRef(/** @type {HTMLDivElement | null} */ (null));
  const place = useScrollPlace(sheet);
  const labels = useMemo(() => new ContactLabels(), []);
  const marks = useMemo(() => new FrameMarks(), []);
  const isMarked = markFunction.value !== "";
  const count = frames.value;
  const [step, setStep] = useState(() => niceStep(frames.peek() / FIRST_SHOWN));
  const [wish, setWish] = useState(FIRST_WIDTH);
  const [onlySelected, setOnly] = useState(false);
  const sizeOf = useImageSizes();

  const box = selectedBox.value;
  const only = onlySelected && box !== null;
  const all = useMemo(() => Array.from({ length: Math.ceil(count / step) }, (_, i) => i * step), [count, step]);
  const told = labels.version.value;
  const listed = useMemo(
    () => (only ? all.filter((index) => labels.of(index)?.some((one) => one.boxId === box.id && one.inImage)) : all),
    [all, only, box?.id, told],
  );
  const unchecked = only ? labels.countMissing(all) : 0;

  const room = Math.max(0, place.width - 2 * PADDING);
  const columns = Math.max(1, Math.floor((room + GAP) / (wish + GAP)));
  const width = Math.max(0, Math.floor((room - (columns - 1) * GAP) / columns));
  const height = Math.round(width / (sizeOf?.aspect ?? 4 / 3)) + CAPTION;
  const pitch = height + GAP;
  const rows = Math.ceil(listed.length / columns);
  const first = Math.max(0, Math.floor((place.top - PADDING) / pitch) - MARGIN);
  const last = Math.min(rows - 1, Math.floor((place.top + place.height - PADDING) / pitch) + MARGIN);
  const shown = width === 0 ? [] : listed.slice(first * columns, (last + 1) * columns);

  // What is in sight first; with the filter, all that it has to look at.
  const state = shownBoxes.value;
  useEffect(() => {
    if (!place.resting) return;
    if (!isMarked || only) labels.want(only ? [...shown, ...all] : shown);
  }, [place, state, only, all, listed, columns, isMarked]);
  const way = `${markFunction.value} ${markShape.value} ${revision.value}`;
  void marks.version.value;
  useEffect(() => {
    if (place.resting) marks.want(isMarked ? shown : []);
  }, [place, way, only, all, listed, columns]);
  useEffect(() => () => marks.want([]), []);

  // The frame at hand is where one comes in.
  const opened = useRef(false);
  useLayoutEffect(() => {
    if (opened.current || width === 0 || sheet.current === null) return;
    opened.current = true;
    const row = Math.floor(frame.peek() / step / columns);
    sheet.current.scrollTop = PADDING + row * pitch - (place.height - pitch) / 2;
  }, [width]);

  const [active, setActive] = useState(() => Math.floor(frame.peek() / step));
  const at = Math.max(0, Math.min(listed.length - 1, active));
  // The focus goes to the tile of the frame at hand, as soon as that is there.
  const moving = useRef(true);
  useLayoutEffect(() => {
    if (!moving.current || sheet.current === null || width === 0) return;
    const row = Math.floor(at / columns);
    const [top, bottom] = [row * pitch, PADDING * 2 + (row + 1) * pitch];
    if (top < sheet.current.scrollTop) sheet.current.scrollTop = top;
    else if (bottom > sheet.current.scrollTop + place.height) sheet.current.scrollTop = bottom - place.height;
    const tile = sheet.current.querySelector(`[data-at="${at}"]`);
    if (tile instanceof HTMLElement) {
      moving.current = false;
      tile.focus({ preventScroll: true });
    }
  });

  /** @param {KeyboardEvent} event */
  const keyed = (event) => {
    const page = columns * Math.max(1, Math.floor(place.height / pitch));
    const ways = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -columns, ArrowDown: columns, PageUp: -page, PageDown: page, Home: -at, End: listed.length - 1 - at };
    const way = /** @type {Record<string, number>} */ (ways)[event.key];
    if (way === undefined) return;
    event.preventDefault();
    moving.current = true;
    setActive(Math.max(0, Math.min(listed.length - 1, at + way)));
  };
  /** @param {number} index */
  const enter = (index) => {
    overlay.value = null;
    // Whoever outlines wants the frame beside the others, not to leave them.
    if (mode.peek() === "masks") actions.goTo(index);
    else actions.enterFrame(index);
  };
  /** @param {number} next */
  const changeStep = (next) => {
    setStep(next);
    setActive(Math.floor((at * step) / next));
    if (sheet.current !== null) sheet.current.scrollTop = 0;
  };

  const problem = (isMarked ? marks : labels).problem.value;
  return html`<${Dialog} label="Contact sheet" class="contact-sheet" onClose=${() => (overlay.value = null)}>
    <header>
      <h2>Contact sheet</h2>
      <${StepChooser} step=${step} count=${count} onChange=${changeStep} />
      <label class="row">
        <span class="muted">Size</span>
        <input
          type="range" min=${SMALLEST} max=${LARGEST} step="1" value=${wish} aria-label="Size of the pictures"
          onInput=${(/** @type {any} */ event) => setWish(Number(event.currentTarget.value))}
        />
      </label>
      <${AsExported} />
      <label class="row" title=${box === null ? "Select a box first, in the list or in the scene." : ""}>
        <input
          type="checkbox" checked=${only} disabled=${box === null}
          onChange=${(/** @type {any} */ event) => setOnly(event.currentTarget.checked)}
        />
        <span class=${box === null ? "muted" : ""}>Only frames that show ${box === null ? "the selected box" : box.name}</span>
      </label>
      <span class="muted count" role="status">${countWords(listed.length, all.length, only, unchecked)}</span>
      <button type="button" class="button quiet icon-only" aria-label="Close" title="Close (Escape)" onClick=${() => (overlay.value = null)}><${Icon} name="x" /></button>
    </header>
    ${problem !== null &&
    html`<p class="problem" role="alert">
      The boxes could not be drawn${isMarked ? " as exported" : ""}: ${problem}
      <button type="button" class="button" onClick=${() => (isMarked ? marks : labels).want(shown)}>Try again</button>
    </p>`}
    <div class="sheet" ref=${sheet} onKeyDown=${keyed}>
      ${listed.length === 0 && html`<${Nothing} count=${count} name=${box?.name ?? ""} unchecked=${unchecked} step=${step} />`}
      <ul class="tiles" aria-label="Frames" style=${{ height: `${Math.max(0, rows * pitch - GAP) + 2 * PADDING}px` }}>
        ${shown.map((index, i) => {
          const slot = first * columns + i;
          return html`<li
            key=${index} aria-setsize=${listed.length} aria-posinset=${slot + 1}
            style=${{ left: `${PADDING + (slot % columns) * (width + GAP)}px`, top: `${PADDING + Math.floor(slot / columns) * pitch}px`, width: `${width}px`, height: `${height}px` }}
          >
            <button
              type="button" class="tile" data-at=${slot} tabindex=${slot === at ? 0 : -1} aria-label=${`Enter frame ${index}`}
              aria-current=${index === frame.value} onClick=${() => enter(index)} onFocus=${() => setActive(slot)}
            >
              <${ContactTile} index=${index} drawn=${isMarked ? null : labels.of(index)} marks=${isMarked ? marks.of(index) : null} width=${width} size=${sizeOf?.size(index) ?? null} wanted=${place.resting} />
            </button>
          </li>`;
        })}
      </ul>
    </div>
  <//>`;
}

/** @param {{step: number, count: number, onChange: (step: number) => void}} props */
function StepChooser({ step, count, onChange }) {
  const steps = niceSteps(Math.max(1, count / 2));
  const near = steps.findLastIndex((one) => one <= step);
  return html`<div class="row" role="group" aria-label="Which frames">
    <span class="muted">Every</span>
    <input
      type="range" min="0" max=${steps.length - 1} step="1" value=${near} aria-label="Frames apart" aria-valuetext=${`every ${step}`}
      onInput=${(/** @type {any} */ event) => onChange(steps[Number(event.currentTarget.value)])}
    />
    <${WholeField}
      label="Every so many frames" kind="number" least=${1} most=${Math.max(1, count)} value=${step}
      onCommit=${(/** @type {number} */ asked) => asked >= 1 && asked <= count && onChange(asked)}
    />
    <span class="muted">frames</span>
  </div>`;
}

/** @param {{count: number, name: string, unchecked: number, step: number}} props */
function Nothing({ count, name, unchecked, step }) {
  if (unchecked > 0) return html`<p class="muted nothing">Looking for ${name} in the frames…</p>`;
  if (count === 0) return html`<p class="muted nothing">This recording has no frames.</p>`;
  return html`<p class="muted nothing">
    None of these frames shows ${name}. ${step > 1 ? "Look at more of them, with a smaller step, or" : "Move it to where the cameras looked, or"} show all frames.
  </p>`;
}

/** @param {number} listed @param {number} all @param {boolean} only @param {number} unchecked */
function countWords(listed, all, only, unchecked) {
  if (!only) return `${all} ${all === 1 ? "frame" : "frames"}`;
  return unchecked > 0 ? `${listed} found, ${unchecked} of ${all} still to look at` : `${listed} of ${all}`;
}

/** How large the images are, by frame, once the cameras are known. */
function useImageSizes() {
  const [cameras, setCameras] = useState(/** @type {readonly import("../store.js").Camera[]} */ ([]));
  const [others, setOthers] = useState(/** @type {ReadonlyMap<number, import("../store.js").Camera>} */ (new Map()));
  useEffect(() => {
    let gone = false;
    actions.cameras().then(
      (found) => gone || setCameras(found),
      () => {}, // the labels' problem says that the server does not answer
    );
    return () => {
      gone = true;
    };
  }, []);
  const asked = useRef(new Set());
  if (cameras.length === 0) return null;
  return {
    aspect: cameras[0].width / cameras[0].height,
    size: (/** @type {number} */ index) => {
      if (cameras.length === 1) return cameras[0];
      if (!asked.current.has(index)) {
        asked.current.add(index);
        actions.cameraOf(index).then(
          (camera) => setOthers((known) => new Map(known).set(index, camera)),
          () => asked.current.delete(index),
        );
      }
      return others.get(index) ?? null;
    },
  };
}
