/** How bright and contrasted a pane shows its photo; nothing of it changes the photo. */

import { Icon } from "../../lib/icon.js";
import { Popover } from "../../lib/popover.js";
import { html, useRef, useSignal } from "../../lib/view.js";

const PLAIN = { brightness: 1, contrast: 1 };
const SLIDERS = /** @type {const} */ ([
  ["brightness", "Brightness"],
  ["contrast", "Contrast"],
]);

/** @param {{editor: import("../../lib/mask_editor.js").MaskEditor}} props */
export function PhotoLight({ editor }) {
  const open = useSignal(false);
  const light = useSignal(editor.light);
  const anchor = useRef(/** @type {HTMLButtonElement | null} */ (null));
  /** @param {typeof PLAIN} next */
  const put = (next) => {
    light.value = next;
    editor.light = next;
  };
  const changed = light.value.brightness !== 1 || light.value.contrast !== 1;
  return html`<button
      ref=${anchor} type="button" class="chip button icon-only" aria-label="Brightness and contrast" title="Brightness and contrast of the photo"
      aria-expanded=${open.value} aria-pressed=${changed} onClick=${() => (open.value = !open.value)}
    ><${Icon} name="sun" size=${14} /></button>
    ${open.value &&
    html`<${Popover} label="Brightness and contrast" anchor=${anchor} above=${true} onClose=${() => (open.value = false)}>
      <div class="photo-light">
        ${SLIDERS.map(
          ([key, title]) => html`<label key=${key}>${title}
            <input
              type="range" min="0.4" max="3" step="0.05" value=${light.value[key]} aria-label=${title}
              onInput=${(/** @type {any} */ event) => put({ ...light.value, [key]: Number(event.currentTarget.value) })}
            />
            <output>${Math.round(light.value[key] * 100)} %</output>
          </label>`,
        )}
        <button type="button" class="button" disabled=${!changed} onClick=${() => put(PLAIN)}>As it is</button>
      </div>
    <//>`}`;
}
