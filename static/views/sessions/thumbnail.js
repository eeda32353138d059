/** A small image that is asked for when it comes into sight. */

import { Icon } from "../../lib/icon.js";
import { html, useState } from "../../lib/view.js";

/**
 * It fills its width, and keeps its height while the image is on its way or cannot be had.
 * @param {{address: string, label: string}} props
 */
export function Thumbnail({ address, label }) {
  const [broken, setBroken] = useState("");
  return html`<div class="thumbnail">
    ${broken === address
      ? html`<span role="img" aria-label=${`${label}, which cannot be shown`} title="This image cannot be shown."><${Icon} name="image" size=${20} /></span>`
      : html`<img src=${address} alt=${label} loading="lazy" decoding="async" draggable=${false} onError=${() => setBroken(address)} />`}
  </div>`;
}
