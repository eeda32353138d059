/** A box from four corners, each clicked in two frames: two panes side by side, and the steps below them. */

import { Icon } from "../lib/icon.js";
import { html, signal, useEffect, useLayoutEffect, useRef, useState } from "../lib/view.js";
import { actions, frame, frames, overlay, tool } from "../store.js";
import { corners, current, begun, startOver, stepBack, takeBack } from "./points/corners.js";
import { PointsPane } from "./points/pane.js";
import { isGoodAngle, partnerOf } from "./points/partner_frame.js";
import { Steps } from "./points/steps.js";

/** By how many degrees the last box's edges were set right; null: said long enough. */
const made = signal(/** @type {number | null} */ (null));
/** Beyond this the corners hardly belong to one box. */
const CROOKED = 5;

/** @typedef {0 | 1} Side */

export function PointsTool() {
  const [shown, setShown] = useState(/** @type {readonly [number, number | null]} */ ([frame.peek(), null]));
  const [side, setSide] = useState(/** @type {Side} */ (0));
  const [note, setNote] = useState(/** @type {readonly [string | null, string | null]} */ ([null, null]));
  const root = useRef(/** @type {HTMLDivElement | null} */ (null));
  const searching = useRef(0);
  const count = frames.value;

  /** @param {Side} which @param {number} to */
  const show = (which, to) => {
    setShown(([left, right]) => (which === 0 ? [to, right] : [left, to]));
    setNote(([left, right]) => (which === 0 ? [null, right] : [left, null]));
    if (which === side) actions.goTo(to);
  };

  /** Find a frame for one pane that goes with the other's. @param {Side} which @param {number} beside the other's frame */
  const suggest = async (which, beside) => {
    const search = ++searching.current;
    const say = (/** @type {string | null} */ text) => setNote(([left, right]) => (which === 0 ? [text, right] : [left, text]));
    say("Looking for a good angle…");
    const seen = corners.peek()[current.peek()].get(beside);
    const at = seen ?? (await middleOf(beside));
    const found = at === null ? null : await partnerOf({ frame: beside, ...at }, frames.peek(), { mustShow: seen !== undefined });
    if (search !== searching.current) return;
    if (found === null) return say(frames.peek() < 2 ? "The recording has only this frame" : "No other frame was found");
    show(which, found.frame);
    say(angleWords(found.degrees));
  };

  useEffect(() => {
    void suggest(1, frame.peek());
    return () => void (searching.current += 1);
  }, []);

  // The film strip and the scrubber are for the pane at hand.
  const now = frame.value;
  useEffect(() => {
    if (shown[side] !== now) show(side, now);
  }, [now]);
  /** @param {Side} which */
  const activate = (which) => {
    if (which === side) return;
    setSide(which);
    const of = shown[which];
    if (of !== null) actions.goTo(of);
  };

  useLayoutEffect(() => {
    /** @type {HTMLElement | null} */ (root.current?.querySelector(".canvas"))?.focus();
    addEventListener("keydown", keyed, true);
    return () => removeEventListener("keydown", keyed, true);
  }, []);

  const [left, right] = shown;
  return html`<div class="points-tool" ref=${root} aria-label="Box from four points" role="region">
    <header class="points-head">
      <h2>Box from four points</h2>
      <p role="status">${instruction(left, right)}</p>
      <button type="button" class="button quiet icon-only" aria-label="Leave this tool" title="Leave this tool; the marks stay" onClick=${() => (tool.value = "select")}><${Icon} name="x" /></button>
    </header>
    <div class="panes">
      <${PointsPane}
        name="Left" frame=${left} other=${right} active=${side === 0} note=${note[0]}
        onFrame=${(/** @type {number} */ to) => show(0, to)} onActive=${() => activate(0)}
        onSuggest=${right === null || count < 2 ? null : () => void suggest(0, right)}
      />
      ${right === null
        ? html`<section class="points-pane waiting"><p class="muted" role="status">${note[1]}</p></section>`
        : html`<${PointsPane}
            name="Right" frame=${right} other=${left} active=${side === 1} note=${note[1]}
            onFrame=${(/** @type {number} */ to) => show(1, to)} onActive=${() => activate(1)}
            onSuggest=${count < 2 ? null : () => void suggest(1, left)}
          />`}
    </div>
    <${Steps} onMade=${finish} />
  </div>`;
}

/** What was done about the last box's edges, for over the scene; it goes with the next press. */
export function MadeBox() {
  const degrees = made.value;
  useEffect(() => {
    if (degrees === null) return;
    const stop = new AbortController();
    // Not by the press that made it.
    requestAnimationFrame(() => {
      for (const kind of ["pointerdown", "keydown"]) addEventListener(kind, () => (made.value = null), { signal: stop.signal, once: true, capture: true });
    });
    return () => stop.abort();
  }, [degrees]);
  if (degrees === null) return null;
  const words = `Its edges were set right by ${degrees.toFixed(1)}°`;
  return html`<div class="chip" role="status">
    ${degrees > CROOKED ? html`<span class="problem">${words}: the corners hardly belong to one box. Undo, and mark them again.</span>` : `Box made. ${words}.`}
  </div>`;
}

/** @param {number} degrees */
function finish(degrees) {
  made.value = degrees;
  startOver();
  tool.value = "select";
}

/** What to do next. @param {number} left @param {number | null} right */
function instruction(left, right) {
  const corner = current.value;
  const sightings = corners.value[corner];
  if (corners.value.every((one) => one.size >= 2)) return "All four corners are marked: choose the class and make the box. Drag a corner to mend it.";
  if (sightings.size === 0) return `Click P${corner} in either frame.`;
  const missing = [left, right].find((one) => one !== null && !sightings.has(one));
  return missing === undefined ? `Take another frame on one side, and click P${corner} there.` : `Now click P${corner} in frame ${missing}: it lies on the dashed line.`;
}

/** @param {number | null} degrees */
function angleWords(degrees) {
  if (degrees === null) return "no good angle was found";
  return isGoodAngle(degrees) ? `about ${degrees.toFixed(0)}° apart` : `only about ${degrees.toFixed(0)}° apart: look for a better one`;
}

/** @param {number} index @returns {Promise<{x: number, y: number} | null>} null: the server does not say */
async function middleOf(index) {
  return actions.cameraOf(index).then(
    ({ width, height }) => ({ x: width / 2, y: height / 2 }),
    () => null, // the page says elsewhere that the server does not answer
  );
}

/**
 * The tool's own keys, before the page's: there they would move or delete the selected box, which is not even seen.
 * @param {KeyboardEvent} event
 */
function keyed(event) {
  if (overlay.peek() !== null || event.altKey) return;
  const target = event.target;
  if (target instanceof HTMLInputElement || target instanceof HTMLSelectElement) return;
  const undo = (event.ctrlKey || event.metaKey) && !event.shiftKey && event.key.toLowerCase() === "z";
  if (event.key === "Backspace" || event.key === "Delete") takeBack();
  else if (event.key === "Escape" ? !stepBack() : undo ? !begun.peek() || !takeBack() : !strayArrow(event)) return;
  event.preventDefault();
  event.stopImmediatePropagation();
}

/** An arrow that is meant for nothing in particular; the panes, the scrubber and the strip take their own. @param {KeyboardEvent} event */
function strayArrow(event) {
  const arrow = event.key.startsWith("Arrow") || event.key === "PageUp" || event.key === "PageDown";
  return arrow && (event.target === document.body || (event.target instanceof HTMLElement && event.target.closest("button") !== null));
}
