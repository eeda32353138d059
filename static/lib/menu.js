/** A menu at a place on the screen: arrows move in it, Escape and a click elsewhere close it. */

import { html, useEffect, useLayoutEffect, useRef } from "./view.js";

/**
 * @typedef {object} MenuItem
 * @property {string} title
 * @property {() => void} run
 * @property {string} [keys] shown at its end
 * @property {boolean} [disabled]
 * @property {boolean} [bad] it takes something away
 */

/**
 * @param {{label: string, x: number, y: number, items: (MenuItem | null)[], onClose: () => void}} props
 *   x, y: in CSS pixels of the window; null items are lines
 */
export function Menu({ label, x, y, items, onClose }) {
  const ref = useRef(/** @type {HTMLElement | null} */ (null));
  useLayoutEffect(() => {
    const menu = /** @type {HTMLElement} */ (ref.current);
    const { width, height } = menu.getBoundingClientRect();
    menu.style.left = `${Math.max(8, Math.min(x, innerWidth - width - 8))}px`;
    menu.style.top = `${Math.max(8, Math.min(y, innerHeight - height - 8))}px`;
    const before = document.activeElement;
    menu.querySelector("button")?.focus();
    return () => before instanceof HTMLElement && before.isConnected && before.focus();
  }, [x, y]);
  useEffect(() => {
    /** @param {Event} event */
    const elsewhere = (event) => !ref.current?.contains(/** @type {Node} */ (event.target)) && onClose();
    addEventListener("pointerdown", elsewhere, true);
    addEventListener("blur", onClose);
    return () => {
      removeEventListener("pointerdown", elsewhere, true);
      removeEventListener("blur", onClose);
    };
  }, [onClose]);
  /** @param {KeyboardEvent} event */
  const keys = (event) => {
    event.stopPropagation();
    if (event.key === "Escape" || event.key === "Tab") {
      event.preventDefault();
      return onClose();
    }
    const buttons = [.../** @type {HTMLElement} */ (ref.current).querySelectorAll("button")];
    const at = buttons.indexOf(/** @type {HTMLButtonElement} */ (document.activeElement));
    const next = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: buttons.length - 1 }[event.key];
    if (next === undefined) return;
    event.preventDefault();
    buttons[(next + buttons.length) % buttons.length].focus();
  };
  return html`<div class="menu" role="menu" aria-label=${label} ref=${ref} onKeyDown=${keys}>
    ${items.map((item, i) =>
      item === null
        ? html`<hr key=${i} />`
        : html`<button
            key=${i} role="menuitem" class=${item.bad ? "button-bad" : ""} aria-disabled=${item.disabled ?? false}
            onClick=${() => {
              if (item.disabled) return;
              onClose();
              item.run();
            }}
          >${item.title}${item.keys && html`<span class="keys">${item.keys}</span>`}</button>`,
    )}
  </div>`;
}
