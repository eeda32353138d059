/** Chooses a zip from this computer. */

import { Icon } from "../../lib/icon.js";
import { html, useRef } from "../../lib/view.js";
import { take } from "./draft.js";

export function ZipButton() {
  const input = useRef(/** @type {HTMLInputElement | null} */ (null));
  return html`<button class="button" onClick=${() => input.current?.click()}><${Icon} name="file-archive" /> Choose a zip</button>
    <input
      ref=${input} type="file" accept=".zip,application/zip" hidden aria-label="Zip of a recording"
      onChange=${(/** @type {any} */ event) => {
        const files = [...event.currentTarget.files];
        event.currentTarget.value = ""; // the same file may be chosen again
        if (files.length > 0) take(files);
      }}
    />`;
}
