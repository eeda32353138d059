/** A frame's photo, small. */

import { LazyImage } from "../lib/lazy_image.js";
import { html } from "../lib/view.js";
import { actions } from "../store.js";

/** Widths that small images are asked for in: few, so that the server and the browser keep each of them once. */
const WIDTHS = [160, 320, 640];

/**
 * @param {object} props
 * @param {number} props.index
 * @param {number} props.width CSS pixels that it will be shown in
 * @param {boolean} props.wanted
 */
export function FrameImage({ index, width, wanted }) {
  const needed = width * Math.min(2, devicePixelRatio);
  const asked = WIDTHS.find((candidate) => candidate >= needed) ?? /** @type {number} */ (WIDTHS.at(-1));
  return html`<${LazyImage}
    address=${actions.imageAddress(index, { width: asked })} wanted=${wanted}
    reason=${() => actions.imageProblem(index)}
  />`;
}
