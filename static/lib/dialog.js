/** A modal dialog: the browser keeps the focus inside, closes it on Escape and gives the focus back. */

import { html, useLayoutEffect, useRef } from "./view.js";

/**
 * @param {{
 *   label: string, onClose: () => void, class?: string,
 *   children?: import("./view.js").ComponentChildren,
 * }} props
 */
export function Dialog({ label, onClose, class: name = "", children }) {
  const ref = useRef(/** @type {HTMLDialogElement | null} */ (null));
  useLayoutEffect(() => {
    const dialog = /** @type {HTMLDialogElement} */ (ref.current);
    dialog.showModal();
    return () => dialog.close();
  }, []);
  return html`<dialog
    class=${`dialog ${name}`} aria-label=${label} ref=${ref}
    onCancel=${(/** @type {Event} */ event) => {
      event.preventDefault(); // who holds the state closes it
      onClose();
    }}
    onKeyDown=${(/** @type {KeyboardEvent} */ event) => event.stopPropagation()}
    onClick=${(/** @type {MouseEvent} */ event) => event.target === ref.current && onClose()}
  >${children}</dialog>`;
}
