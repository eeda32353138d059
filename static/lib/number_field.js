/**
 * A field for one number with its unit: typed with or without it, reckoned (`85/2`), stepped by arrows, or drawn by its
 * letter. What cannot be read stays, with the reason beneath.
 */

import { parseQuantity } from "./quantity.js";
import { html, useEffect, useId, useLayoutEffect, useRef, useSignal } from "./view.js";

/** Pixels of the pointer for one step. */
const PIXELS = 3;
/** Pixels that a hand trembles. */
const STILL = 3;

/**
 * Values are metres or degrees.
 * @typedef {object} NumberFieldProps
 * @property {string} label what a screen reader says
 * @property {string} letter
 * @property {"x" | "y" | "z"} tone the letter's colour
 * @property {import("./quantity.js").Kind} kind
 * @property {number} value
 * @property {(value: number) => string} shown the value as it is seen
 * @property {(value: number) => string} edited the value as it is edited, with more decimals
 * @property {number} step
 * @property {string} [title]
 * @property {boolean} [locked] it can be read, and not changed
 * @property {(value: number) => string | null} [wrong] why a value cannot be, in words
 * @property {(value: number) => Promise<void>} onCommit a value was typed; rejects with what is wrong
 * @property {(value: number, hold: boolean) => void} onStep `hold`: a button is held, and `onStepped` follows
 * @property {() => void} onStepped the last step of several is done
 * @property {() => void} [onLeave] Escape, where there was nothing to restore
 */

/** @param {NumberFieldProps} props */
export function NumberField(props) {
  const { label, letter, tone, kind, value, shown, edited, step, title, locked = false } = props;
  const id = useId();
  const input = useRef(/** @type {HTMLInputElement | null} */ (null));
  const focused = useSignal(false);
  /** What is being typed; null: nothing. */
  const draft = useSignal(/** @type {string | null} */ (null));
  const problem = useSignal(/** @type {string | null} */ (null));
  // Handlers that outlast a rendering see the newest props.
  const newest = useRef(props);
  newest.current = props;

  useLayoutEffect(() => {
    if (focused.value) input.current?.select();
  }, [focused.value]);

  /** @param {number} next @returns {boolean} whether it can be */
  const allowed = (next) => {
    problem.value = newest.current.wrong?.(next) ?? null;
    return problem.value === null;
  };
  /** What is typed, or the value; null where it cannot be read. */
  const current = () => {
    if (draft.value === null) return newest.current.value;
    const parsed = parseQuantity(draft.value, kind);
    problem.value = parsed.ok ? null : parsed.problem;
    return parsed.ok ? parsed.value : null;
  };
  const restore = () => {
    draft.value = null;
    problem.value = null;
  };
  const commit = async () => {
    const typed = draft.value;
    if (typed === null) return;
    if (typed === edited(newest.current.value)) return restore();
    const next = current();
    if (next === null || !allowed(next)) return;
    if (next === newest.current.value) return restore();
    try {
      await newest.current.onCommit(next);
      if (draft.value === typed) restore();
    } catch (error) {
      problem.value = /** @type {Error} */ (error).message;
    }
  };
  /** @param {number} next @param {boolean} hold */
  const stepTo = (next, hold) => {
    if (!allowed(next)) return;
    draft.value = null;
    newest.current.onStep(next, hold);
    // The next step may come before the next rendering.
    newest.current = { ...newest.current, value: next };
  };

  /** @param {KeyboardEvent} event */
  const keys = (event) => {
    if (event.key === "Enter") {
      void commit().then(() => document.activeElement === input.current && input.current?.select());
    } else if (event.key === "Escape") {
      event.stopPropagation();
      if (draft.value !== null || problem.value !== null) return restore();
      input.current?.blur();
      props.onLeave?.();
    } else if ((event.key === "ArrowUp" || event.key === "ArrowDown") && !locked) {
      event.preventDefault();
      event.stopPropagation();
      const from = current();
      if (from !== null) stepTo(tidy(from + (event.key === "ArrowUp" ? 1 : -1) * step * times(event)), false);
    }
  };

  const scrub = useScrub({
    start: () => {
      restore();
      return newest.current.value;
    },
    move: (from, steps) => stepTo(tidy(from + steps * step), true),
    end: () => newest.current.onStepped(),
    click: () => input.current?.focus(),
  });

  const text = draft.value ?? (focused.value ? edited(value) : shown(value));
  return html`<div class="number-field" data-tone=${tone} data-locked=${locked}>
    <span class="letter" aria-hidden="true" title=${locked ? undefined : "Drag to change"} onPointerDown=${locked ? undefined : scrub}>${letter}</span>
    <input
      ref=${input} id=${id} role="spinbutton" aria-label=${label} aria-valuenow=${Number(shown(value).replace("°", ""))}
      aria-valuetext=${`${shown(value)}${kind === "length" ? " mm" : ""}`} aria-invalid=${problem.value !== null}
      aria-describedby=${problem.value === null ? undefined : `${id}-problem`}
      data-typing=${draft.value !== null} title=${title} value=${text} readonly=${locked} autocomplete="off" spellcheck=${false} enterkeyhint="done"
      onPointerDown=${(/** @type {PointerEvent} */ event) => {
        if (document.activeElement === input.current) return;
        // Or the release would undo the selection.
        event.preventDefault();
        input.current?.focus();
      }}
      onFocus=${() => (focused.value = true)}
      onBlur=${() => {
        focused.value = false;
        void commit();
        newest.current.onStepped();
      }}
      onInput=${() => {
        draft.value = input.current?.value ?? null;
        problem.value = null;
      }}
      onKeyDown=${keys}
    />
    ${problem.value !== null && html`<p class="problem" role="alert" id=${`${id}-problem`}>${problem.value}</p>`}
  </div>`;
}

/**
 * Dragging sideways steps a number: whole steps, tens with Shift, tenths with Alt. Escape puts it back.
 * @param {{start: () => number, move: (from: number, steps: number) => void, end: () => void, click: () => void}} on
 */
function useScrub(on) {
  const stop = useRef(() => {});
  // A field may go while it is drawn, with its box: what was drawn ends there.
  useEffect(() => () => stop.current(), []);
  /** @param {PointerEvent} event */
  return (event) => {
    if (event.button !== 0) return;
    event.preventDefault();
    const letter = /** @type {HTMLElement} */ (event.currentTarget);
    letter.setPointerCapture(event.pointerId);
    const from = on.start();
    let [last, drawn, steps, moving] = [event.clientX, 0, 0, false];
    /** @param {PointerEvent} event */
    const move = (event) => {
      if (!moving && Math.abs(event.clientX - last) < STILL) return;
      const by = times(event);
      drawn += ((event.clientX - last) / PIXELS) * by;
      [last, moving] = [event.clientX, true];
      const next = Math.round(drawn / by) * by;
      if (next !== steps) on.move(from, (steps = next));
    };
    /** @param {Event} event */
    const finish = (event) => {
      const clicked = !moving && event.type === "pointerup";
      stop.current();
      if (clicked) on.click();
    };
    /** @param {KeyboardEvent} event */
    const keys = (event) => {
      if (event.key !== "Escape") return;
      event.stopPropagation();
      if (moving) on.move(from, 0);
      finish(event);
    };
    stop.current = () => {
      letter.removeEventListener("pointermove", move);
      letter.removeEventListener("lostpointercapture", finish);
      letter.removeEventListener("pointerup", finish);
      removeEventListener("keydown", keys, true);
      stop.current = () => {};
      if (moving) on.end();
    };
    letter.addEventListener("pointermove", move);
    letter.addEventListener("pointerup", finish);
    letter.addEventListener("lostpointercapture", finish);
    addEventListener("keydown", keys, true);
  };
}

/** @param {{shiftKey: boolean, altKey: boolean}} event */
function times({ shiftKey, altKey }) {
  return shiftKey ? 10 : altKey ? 0.1 : 1;
}

/** Without the last digits that adding leaves, a nanometre at most. @param {number} value */
function tidy(value) {
  return Math.round(value * 1e9) / 1e9;
}
