/** A field for a whole number. What is being typed stays while the page changes round it. */

import { html, useLayoutEffect, useRef, useSignal } from "./view.js";

/**
 * @typedef {object} WholeFieldProps
 * @property {string} label what a screen reader says
 * @property {number} least
 * @property {number} most
 * @property {number} value
 * @property {(value: number) => void} onCommit a number was typed or stepped to; it may lie outside
 * @property {string} [kind] of field, a class of the style sheets
 * @property {() => void} [onLeave] for a field that comes and goes: it was left
 */

/** @param {WholeFieldProps} props */
export function WholeField({ label, least, most, value, onCommit, kind = "", onLeave }) {
  const input = useRef(/** @type {HTMLInputElement | null} */ (null));
  /** What is being typed; null: nothing. A rendering for another reason would else put the value back over it. */
  const draft = useSignal(/** @type {string | null} */ (null));
  useLayoutEffect(() => {
    if (onLeave !== undefined) input.current?.select();
  }, []);
  const commit = () => {
    const typed = draft.peek();
    draft.value = null;
    if (typed !== null && typed.trim() !== "") onCommit(Math.round(Number(typed)));
  };
  return html`<input
    ref=${input} class=${`field ${kind}`} type="number" min=${least} max=${most} step="1" value=${draft.value ?? value} aria-label=${label}
    onInput=${() => (draft.value = input.current?.value ?? null)} onChange=${commit} onBlur=${() => onLeave?.()}
    onKeyDown=${(/** @type {KeyboardEvent} */ event) => {
      if (event.key !== "Enter" && event.key !== "Escape") return;
      if (event.key === "Enter") commit();
      else draft.value = null;
      if (onLeave === undefined) return;
      event.stopPropagation();
      onLeave();
    }}
  />`;
}
