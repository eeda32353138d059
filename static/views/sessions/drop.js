/** A zip may be dropped anywhere on the page. */

import { html, signal, useEffect } from "../../lib/view.js";
import { isOpen, take } from "./draft.js";

/** Whether files are held over the page. */
export const isOver = signal(false);

export function DropAnywhere() {
  useEffect(() => {
    /** @param {DragEvent} event */
    const over = (event) => {
      if (!carriesFiles(event)) return;
      event.preventDefault(); // without this the browser would open the file
      isOver.value = true;
    };
    /** @param {DragEvent} event */
    const out = (event) => {
      if (event.relatedTarget === null) isOver.value = false;
    };
    /** @param {DragEvent} event */
    const drop = (event) => {
      if (!carriesFiles(event)) return;
      event.preventDefault();
      isOver.value = false;
      const { items, files } = /** @type {DataTransfer} */ (event.dataTransfer);
      take([...files], [...items].some((item) => item.webkitGetAsEntry()?.isDirectory));
    };
    const on = /** @type {const} */ ([["dragenter", over], ["dragover", over], ["dragleave", out], ["drop", drop]]);
    for (const [kind, listener] of on) addEventListener(kind, listener);
    return () => {
      for (const [kind, listener] of on) removeEventListener(kind, listener);
    };
  }, []);
  if (!isOver.value || isOpen.value) return null;
  return html`<div class="drop-cover"><p>Drop the zip to look at what is in it</p></div>`;
}

/** @param {DragEvent} event */
function carriesFiles(event) {
  return event.dataTransfer?.types.includes("Files") ?? false;
}
