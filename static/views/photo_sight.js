/** How near the photo of the entered frame is seen, and what of it: asked for here, done by the bridge in the scene. */

import { signal } from "../lib/view.js";
import * as store from "../store.js";

/**
 * What the bridge is to do next, as it hears it; see static/scene/bridge.js.
 * @type {import("../lib/view.js").Signal<{ars: "fit"} | {ars: "zoom", by: number} | {ars: "show", box: number} | null>}
 */
export const asked = signal(null);

/** One step of the zoom keys. */
const STEP = 1.25;

export const zoomIn = () => (asked.value = { ars: "zoom", by: STEP });
export const zoomOut = () => (asked.value = { ars: "zoom", by: 1 / STEP });
export const wholePhoto = () => (asked.value = { ars: "fit" });

/** Zoom to the selected box, and keep it in the middle from frame to frame until zoomed or moved by hand. */
export function zoomToBox() {
  if (store.selected.value !== null) asked.value = { ars: "show", box: store.selected.value };
}
