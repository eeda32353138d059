/** Five hints for the first visit, one after the other; once dismissed they stay away. */

import { html, useSignal } from "../lib/view.js";
import * as store from "../store.js";

const SEEN = "ars-web.hints-seen";

const HINTS = [
  ["Walk the recording", "Each point is a camera. Click one to stand where it stood, its photo behind the boxes; or choose a picture in the strip below and press F, which also leads back."],
  ["Correct a box", "Click a box; in a frame, L zooms to it. G moves it, R turns it, S resizes it by its faces, U stands it upright. Or type its numbers on the right: 85/2 and 8.5 cm work."],
  ["Look where errors show", "The six pictures on the right are the frames in which an error of the selected box shows most. They follow while you edit."],
  ["Nothing is lost", "Every change is saved at once. Ctrl+Z takes back yours, never another's; History shows all of them."],
  ["Every key", "Press ? for the keys and Ctrl+K for everything by its name. When the boxes fit, Export writes the training set."],
];

export function Hints() {
  const at = useSignal(localStorage.getItem(SEEN) === null ? 0 : HINTS.length);
  if (at.value >= HINTS.length || store.overlay.value !== null || store.mode.value === "export") return null;
  const [title, text] = HINTS[at.value];
  const end = () => {
    at.value = HINTS.length;
    localStorage.setItem(SEEN, "1");
  };
  return html`<aside class="hint" aria-label="Hints">
    <h2>${title}</h2>
    <p>${text}</p>
    <footer>
      <button class="button link" onClick=${end}>Do not show again</button>
      <span class="muted">${at.value + 1} of ${HINTS.length}</span>
      <button class="button" onClick=${() => (at.value + 1 < HINTS.length ? (at.value += 1) : end())}>
        ${at.value + 1 < HINTS.length ? "Next" : "Done"}
      </button>
    </footer>
  </aside>`;
}
