/** One frame in which an object is outlined: the photo, what is drawn on it, and what there is to say of it. */

import { Icon } from "../../lib/icon.js";
import { MaskEditor } from "../../lib/mask_editor.js";
import { html, useEffect, useLayoutEffect, useRef, useSignal, useState } from "../../lib/view.js";
import { WholeField } from "../../lib/whole_field.js";
import { actions, frames, overlay } from "../../store.js";
import { drawing, LEAST_BRUSH, MOST_BRUSH } from "./drawing.js";
import { PhotoLight } from "./photo_light.js";
import { howTo, ToolOptions } from "./tool_options.js";

/**
 * @typedef {object} MaskPaneProps
 * @property {string} boxKey the object's name in the drawings of this page
 * @property {number} frame
 * @property {string} color of the object's class
 * @property {string} name of the object
 * @property {string} note what there is to say beside the frame's number
 * @property {readonly {polygons: import("../../lib/rings.js").Polygons, kind: "band" | "hull"}[]} guidance
 * @property {string | null} problem
 * @property {boolean} locked
 * @property {boolean} active whether keys and the film strip are for this pane
 * @property {(frame: number) => void} onFrame
 * @property {() => void} onActive
 * @property {() => void} [onClose]
 */

/** @param {MaskPaneProps} props */
export function MaskPane(props) {
  const { boxKey, frame, color, name, note, guidance, problem, locked, active, onFrame, onActive, onClose } = props;
  const root = useRef(/** @type {HTMLElement | null} */ (null));
  const place = useRef(/** @type {HTMLDivElement | null} */ (null));
  const newest = useRef(props);
  newest.current = props;
  const [editor, setEditor] = useState(/** @type {MaskEditor | null} */ (null));
  const zoom = useSignal(1);
  const broken = useSignal(/** @type {string | null} */ (null));
  const failure = useSignal(/** @type {string | null} */ (null));
  const said = useSignal("");
  const sheet = drawing.of(boxKey, frame);

  useLayoutEffect(() => {
    const made = new MaskEditor(/** @type {HTMLDivElement} */ (place.current), {
      tool: drawing.tool,
      brush: drawing.brush,
      operation: drawing.operation,
      combine: (polygons, shape, operation) => actions.combine({ frame: newest.current.frame, polygons, operation, ...shape }),
      segment: (prompt) => actions.segment(newest.current.frame, prompt),
      onNew: () => (drawing.operation.value = "add"),
      onFailure: (text) => (failure.value = text),
      onSay: (text) => (said.value = text),
      onView: (view) => (zoom.value = view.zoom),
    });
    setEditor(made);
    return () => made.stop();
  }, []);

  useLayoutEffect(() => {
    if (editor === null) return;
    broken.value = null;
    editor.show(actions.imageAddress(frame)).then(async (result) => {
      if (result !== "failed") return;
      const why = await actions.imageProblem(frame);
      if (newest.current.frame === frame) broken.value = why;
    });
  }, [editor, frame]);

  useLayoutEffect(() => {
    failure.value = null;
  }, [sheet]);
  useLayoutEffect(() => editor?.work(sheet, { color, guidance, locked }), [editor, sheet, color, guidance, locked]);

  useEffect(() => {
    if (!active || editor === null) return;
    /** @param {KeyboardEvent} event */
    const keyed = (event) => {
      const target = event.target instanceof Node ? event.target : null;
      if (overlay.peek() !== null || isField(event.target)) return;
      const inside = root.current?.contains(target) ?? false;
      // What undoes, removes or moves is for the drawing only where the focus is; elsewhere it is the page's.
      if (event.key === "Escape" ? !editor.cancel() : !(inside && editor.key(event)) && !sizeBrush(event)) return;
      event.preventDefault();
      event.stopImmediatePropagation();
    };
    addEventListener("keydown", keyed, true);
    return () => removeEventListener("keydown", keyed, true);
  }, [active, editor]);

  const trouble = broken.value ?? failure.value ?? problem;
  const step = (/** @type {number} */ by) => onFrame(Math.max(0, Math.min(frames.value - 1, frame + by)));
  const label = `Outline of ${name}, frame ${frame}. ${locked ? "It is locked." : howTo(drawing.tool.value)}`;
  return html`<section
    class="mask-pane" ref=${root} data-active=${active} aria-label=${`Frame ${frame}`} onFocusIn=${onActive} onPointerDown=${onActive}
  >
    <div class="canvas" ref=${place} tabindex="0" role="application" aria-label=${label}></div>
    <header>
      <div class="chip frame-chip">
        <button type="button" class="button quiet icon-only" aria-label="Previous frame" disabled=${frame <= 0} onClick=${() => step(-1)}><${Icon} name="chevron-left" size=${14} /></button>
        <${FrameNumber} frame=${frame} onFrame=${onFrame} />
        <button type="button" class="button quiet icon-only" aria-label="Next frame" disabled=${frame >= frames.value - 1} onClick=${() => step(1)}><${Icon} name="chevron-right" size=${14} /></button>
        ${(note !== "" || locked) && html`<span class="muted note">${locked ? "locked" : note}</span>`}
      </div>
      <div class="row">
        <button type="button" class="chip button zoom" title="Whole image, or as large as the pane (0: whole, 1: pixel by pixel, + and -)" aria-label=${`Magnified ${zoom.value.toFixed(1)} times. Show the whole image, or fill the pane`} onClick=${() => editor?.fit()}>${zoom.value.toFixed(zoom.value < 10 ? 1 : 0)}x</button>
        ${onClose !== undefined && html`<button type="button" class="chip button icon-only" aria-label=${`Close frame ${frame}`} title="Close this frame" onClick=${onClose}><${Icon} name="x" size=${14} /></button>`}
      </div>
    </header>
    <footer>
      ${trouble !== null && html`<p class="problem pane-problem" role="alert">${trouble}</p>`}
      <div class="row">
        ${editor !== null && html`<${PhotoLight} editor=${editor} />`}
        ${editor !== null && active && !locked && html`<${ToolOptions} editor=${editor} sheet=${sheet} />`}
      </div>
    </footer>
    <p class="visually-hidden" role="status">${said.value}</p>
  </section>`;
}

/** "Frame 10", which becomes a field where it is pressed. @param {{frame: number, onFrame: (frame: number) => void}} props */
function FrameNumber({ frame, onFrame }) {
  const asking = useSignal(false);
  if (!asking.value) return html`<button type="button" class="frame-number" title="Go to another frame" onClick=${() => (asking.value = true)}>Frame ${frame}</button>`;
  return html`<label class="frame-number">Frame
    <${WholeField}
      label="Frame of this pane" least=${0} most=${frames.value - 1} value=${frame} onLeave=${() => (asking.value = false)}
      onCommit=${(/** @type {number} */ asked) => onFrame(Math.max(0, Math.min(frames.peek() - 1, asked)))}
    />
  </label>`;
}

/** Whether keys are for what lies there. @param {EventTarget | null} target */
function isField(target) {
  if (target instanceof HTMLElement && target.closest(".popover, dialog") !== null) return true;
  return (target instanceof HTMLInputElement && target.type !== "range") || target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement;
}

/** By the brackets, wherever the focus is. @param {KeyboardEvent} event @returns {boolean} */
function sizeBrush({ key }) {
  if (key !== "[" && key !== "]") return false;
  if (!["brush", "eraser", "smart"].includes(drawing.tool.peek())) return false;
  const now = drawing.brush.peek();
  const step = Math.max(1, Math.round(now / 8));
  drawing.brush.value = Math.max(LEAST_BRUSH, Math.min(MOST_BRUSH, now + (key === "]" ? step : -step)));
  return true;
}
