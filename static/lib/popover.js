/** A small panel beside what opened it; Escape and a click elsewhere close it, and the focus goes back. */

import { html, useEffect, useLayoutEffect, useRef } from "./view.js";

/**
 * @param {{
 *   label: string, anchor: import("./view.js").RefObject<HTMLElement>, onClose: () => void, above?: boolean,
 *   children?: import("./view.js").ComponentChildren,
 * }} props
 */
export function Popover({ label, anchor, onClose, above = false, children }) {
  const ref = useRef(/** @type {HTMLElement | null} */ (null));
  useLayoutEffect(() => {
    const panel = /** @type {HTMLElement} */ (ref.current);
    const from = anchor.current;
    if (from === null) return;
    const put = () => {
      const [place, { width, height }] = [from.getBoundingClientRect(), panel.getBoundingClientRect()];
      const below = place.bottom + 4;
      const isBelow = !above && below + height + 8 <= innerHeight;
      panel.style.left = `${Math.max(8, Math.min(above ? place.left : place.right - width, innerWidth - width - 8))}px`;
      panel.style.top = `${isBelow ? below : Math.max(8, Math.min(place.top - 4, innerHeight - 8) - height)}px`;
    };
    put();
    // What opens within it makes it higher.
    const sized = new ResizeObserver(put);
    sized.observe(panel);
    /** @type {HTMLElement | null} */ (panel.querySelector("input, button"))?.focus();
    return () => {
      sized.disconnect();
      if (panel.contains(document.activeElement)) from.focus();
    };
  }, []);
  useEffect(() => {
    /** @param {Event} event */
    const elsewhere = (event) => {
      const target = /** @type {Node} */ (event.target);
      if (!ref.current?.contains(target) && !anchor.current?.contains(target)) onClose();
    };
    // A click into a frame is only told by the focus that goes there.
    const intoFrame = () => document.activeElement instanceof HTMLIFrameElement && onClose();
    addEventListener("pointerdown", elsewhere, true);
    addEventListener("blur", intoFrame);
    return () => {
      removeEventListener("pointerdown", elsewhere, true);
      removeEventListener("blur", intoFrame);
    };
  }, [onClose]);
  /** @param {KeyboardEvent} event */
  const keys = (event) => {
    event.stopPropagation();
    if (event.key === "Escape") {
      anchor.current?.focus();
      onClose();
    }
  };
  return html`<div class="popover" role="dialog" aria-label=${label} ref=${ref} onKeyDown=${keys}>${children}</div>`;
}
