/** Below the scene: the scrubber over all frames, and the film strip. */

import { html, useEffect, useSignal, useState } from "../lib/view.js";
import { actions, sid } from "../store.js";
import { FilmStrip } from "./film_strip.js";
import { Scrubber } from "./scrubber.js";

/** Until the cameras are known, and beyond what a strip can hold. */
const USUAL = 4 / 3;

/**
 * @param {object} props
 * @param {import("../lib/view.js").ReadonlySignal<readonly import("./scrubber.js").Mark[]>} [props.marks] frames worth pointing at
 */
export function BottomBar({ marks }) {
  const shown = useSignal(/** @type {{first: number, last: number} | null} */ (null));
  const aspect = useAspect();
  return html`<footer class="frames-bar" aria-label="Frames">
    <${Scrubber} marks=${marks} shown=${shown} aspect=${aspect} />
    <${FilmStrip} marks=${marks} shown=${shown} aspect=${aspect} />
  </footer>`;
}

/** Width by height of the recording's images; of the first camera's where there are several. */
export function useAspect() {
  const [aspect, setAspect] = useState(USUAL);
  const session = sid.value;
  useEffect(() => {
    if (session === "") return;
    let gone = false;
    actions.cameras().then(
      ([camera]) => {
        if (!gone && camera !== undefined) setAspect(Math.max(0.6, Math.min(2.4, camera.width / camera.height)));
      },
      () => {}, // the page says elsewhere that the server does not answer
    );
    return () => {
      gone = true;
    };
  }, [session]);
  return aspect;
}
