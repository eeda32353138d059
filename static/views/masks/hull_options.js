/** How the hull is made: the expected error of masks, the support plane, and the box's axes. */

import { millimetres, parseQuantity, trimmed } from "../../lib/quantity.js";
import { html, useId, useLayoutEffect, useRef, useSignal } from "../../lib/view.js";
import * as store from "../../store.js";
import { made, options, wish } from "./subject.js";

/** @typedef {import("./subject.js").Subject} Subject */
/** @typedef {import("../../store.js").HullOptions} Options */

/** Pixels; more is no error but another outline. */
const MOST_WIDENING = 50;
/** Metres, as the server has it. */
const FARTHEST = 1e7;

const ORIENTATIONS = /** @type {const} */ ([
  ["world", "World", "The box's axes are the world's"],
  ["upright", "Upright", "Turned about the vertical to the smallest footprint"],
  ["free", "Free", "Turned any way, to the smallest volume"],
]);

/** A box that is made of masks follows at once; for others it is kept until they are. @param {Subject} subject @param {Partial<Options>} changes */
async function change(subject, changes) {
  const now = made(subject.box);
  if (now === undefined || subject.id === null) wish(changes);
  else await store.actions.makeHull(subject.id, changes);
}

/** @param {{subject: Subject}} props */
export function HullOptions({ subject }) {
  const problem = useSignal(/** @type {string | null} */ (null));
  const locked = subject.box?.locked ?? false;
  const { orientation, widen_px, fitted } = options.value;
  return html`<section class="panel-section hull-options" aria-label="How the box is made">
    <${InlineField}
      label="Expected mask error" shown=${`${trimmed(widen_px, 0, 2)} px`} edited=${trimmed(widen_px, 0, 2)} locked=${locked}
      title="By how much outlines and camera poses may be off: each mask is widened by it, so that thin objects are not lost"
      read=${pixels} onCommit=${(/** @type {number} */ px) => change(subject, { widen_px: px })}
    />
    <div class="line"><span class="muted">Box axes</span>
      <div class="joined" role="group" aria-label="Box axes">
        ${ORIENTATIONS.map(
          ([name, words, title]) => html`<button
            key=${name} class="button small" aria-pressed=${!fitted && orientation === name} title=${title} disabled=${locked}
            onClick=${() =>
              change(subject, { orientation: name }).then(
                () => (problem.value = null),
                (error) => (problem.value = error.message),
              )}
          >${words}</button>`,
        )}
      </div>
    </div>
    ${fitted && html`<p class="muted">The box stays as it was fitted, and the hull follows the masks. Choose axes to make it of the hull again.</p>`}
    ${problem.value !== null && html`<p class="problem" role="alert">${problem.value}</p>`}
  </section>`;
}

/** @param {{subject: Subject, onDone: () => void}} props */
export function SupportPlane({ subject, onDone }) {
  const problem = useSignal(/** @type {string | null} */ (null));
  const ground = options.value.ground;
  /** @param {number | null} z */
  const set = (z) =>
    change(subject, { ground: z }).then(
      () => {
        problem.value = null;
        if (z === null) onDone();
      },
      (error) => (problem.value = error.message),
    );
  return html`<div class="support-plane" role="group" aria-label="Support plane">
    <${InlineField}
      label="Stands at z" shown=${ground === null ? "" : `${millimetres(ground)} mm`} edited=${ground === null ? "" : trimmed(ground * 1000, 1, 3)}
      placeholder="mm" title="Height of the plane in the world; nothing of the object is below" read=${height} focused=${ground === null}
      onCommit=${(/** @type {number} */ z) => change(subject, { ground: z })}
    />
    <div class="box-buttons">
      <button class="button small" aria-pressed=${ground === 0} onClick=${() => void set(0)}>On the ground</button>
      ${ground !== null && html`<button class="button small" onClick=${() => void set(null)}>No plane</button>`}
    </div>
    ${problem.value !== null && html`<p class="problem" role="alert">${problem.value}</p>`}
  </div>`;
}

/** @param {string} text @returns {import("../../lib/quantity.js").Parsed} */
function pixels(text) {
  const value = Number(text.trim().replace(/\s*px$/i, "").replace(",", "."));
  if (text.trim() === "" || !Number.isFinite(value)) return { ok: false, problem: "Type a number of pixels, such as 1.5." };
  if (value < 0 || value > MOST_WIDENING) return { ok: false, problem: `From 0 to ${MOST_WIDENING} px.` };
  return { ok: true, value };
}

/** @param {string} text @returns {import("../../lib/quantity.js").Parsed} */
function height(text) {
  const read = parseQuantity(text, "length");
  if (read.ok && Math.abs(read.value) > FARTHEST) return { ok: false, problem: `At most ${FARTHEST / 1000} km from the origin.` };
  return read;
}

/**
 * A number in a line of text, which can be typed over.
 * @param {object} props
 * @param {string} props.label
 * @param {string} props.shown
 * @param {string} props.edited
 * @param {string} props.title
 * @param {string} [props.placeholder]
 * @param {boolean} [props.locked]
 * @param {boolean} [props.focused] it takes the focus as it comes
 * @param {(text: string) => import("../../lib/quantity.js").Parsed} props.read
 * @param {(value: number) => Promise<void>} props.onCommit
 */
function InlineField({ label, shown, edited, title, placeholder, locked = false, focused = false, read, onCommit }) {
  const id = useId();
  const input = useRef(/** @type {HTMLInputElement | null} */ (null));
  const draft = useSignal(/** @type {string | null} */ (null));
  const inside = useSignal(false);
  const problem = useSignal(/** @type {string | null} */ (null));
  useLayoutEffect(() => {
    if (focused) input.current?.focus();
  }, []);
  useLayoutEffect(() => {
    if (inside.value) input.current?.select();
  }, [inside.value]);
  const restore = () => {
    draft.value = null;
    problem.value = null;
  };
  const commit = async () => {
    const typed = draft.value;
    if (typed === null || typed === edited || (typed.trim() === "" && edited === "")) return restore();
    const found = read(typed);
    if (!found.ok) return void (problem.value = found.problem);
    try {
      await onCommit(found.value);
      if (draft.value === typed) restore();
    } catch (error) {
      problem.value = /** @type {Error} */ (error).message;
    }
  };
  return html`<div class="line inline-field">
      <label class="muted" for=${id} title=${title}>${label}</label>
      <input
        ref=${input} id=${id} class="field" value=${draft.value ?? (inside.value ? edited : shown)} readonly=${locked} placeholder=${placeholder} title=${title}
        autocomplete="off" spellcheck=${false} aria-invalid=${problem.value !== null} aria-describedby=${problem.value === null ? undefined : `${id}-problem`}
        onFocus=${() => (inside.value = true)}
        onBlur=${() => {
          inside.value = false;
          void commit();
        }}
        onInput=${() => {
          draft.value = input.current?.value ?? null;
          problem.value = null;
        }}
        onKeyDown=${(/** @type {KeyboardEvent} */ event) => {
          if (event.key === "Enter") void commit().then(() => input.current?.select());
          if (event.key !== "Escape") return;
          event.stopPropagation();
          if (draft.value !== null) restore();
          else input.current?.blur();
        }}
      />
    </div>
    ${problem.value !== null && html`<p class="problem" role="alert" id=${`${id}-problem`}>${problem.value}</p>`}`;
}
