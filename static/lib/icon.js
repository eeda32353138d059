/** Icons, as inline SVG that takes the colour of the text around it. */

import { ICONS } from "../vendor/lucide/icons.js";
import { h, html } from "./view.js";

/**
 * Decoration only: whatever holds it must be named in words.
 * @param {{name: string, size?: number}} props `name`: as vendor/lucide/icons.js calls it
 */
export function Icon({ name, size = 16 }) {
  const parts = ICONS[name];
  if (parts === undefined) throw new Error(`there is no icon ${name}`);
  return html`<svg
    class="icon" width=${size} height=${size} viewBox="0 0 24 24" aria-hidden="true"
    fill="none" stroke="currentColor" stroke-width="1.75" stroke-linecap="round" stroke-linejoin="round"
  >${parts.map(([tag, attributes]) => h(tag, attributes))}</svg>`;
}
