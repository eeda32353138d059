/** Making boxes: of the class used last or a chosen one, and, where there are none yet, the ways to make one. */

import { command } from "./commands.js";
import { Icon } from "../lib/icon.js";
import { Menu } from "../lib/menu.js";
import { html, useRef, useSignal } from "../lib/view.js";
import * as store from "../store.js";
import { addingClass } from "./classes.js";
import { begin } from "./masks/subject.js";

/** A box of `classId`, which further new boxes get, too. @param {number | null} classId */
function makeBox(classId) {
  if (classId === null) {
    store.setProblem("boxes", "A box needs a class: add one below first.");
    addingClass.value = true;
    return;
  }
  store.setProblem("boxes", null);
  store.chosenClass.value = classId;
  if (store.mode.value === "masks") begin(classId);
  else store.actions.newBox(classId);
}

/** The class as a person calls it. @param {number | null} id */
function nameOf(id) {
  return id === null ? "" : (store.classes.value.get(id)?.name ?? "");
}

export function NewBox() {
  const chooser = useRef(/** @type {HTMLElement | null} */ (null));
  const open = useSignal(false);
  const usual = store.classOfNew.value;
  const place = open.value ? chooser.current?.getBoundingClientRect() : undefined;
  return html`<div class="new-box">
    <button class="button link" onClick=${() => makeBox(usual)} title=${`New ${nameOf(usual) || "box"} ${store.mode.value === "masks" ? "to outline" : "where the view looks"} (${command("new-box").keys[0]})`}>New box</button>
    <button
      class="button link chooser" ref=${chooser} aria-haspopup="menu" aria-expanded=${open.value}
      aria-label="New box of another class" title="New box of another class" disabled=${store.classes.value.size === 0}
      onClick=${() => (open.value = !open.value)}
    ><${Icon} name="chevron-down" size=${14} /></button>
    ${place !== undefined &&
    html`<${Menu}
      label="Class of the new box" x=${place.right - 184} y=${place.bottom + 4} onClose=${() => (open.value = false)}
      items=${[...store.classes.value.values()].map((one) => ({ title: `New ${one.name}`, run: () => makeBox(one.id) }))}
    />`}
  </div>`;
}

export function NoBoxes() {
  const usual = store.classOfNew.value;
  return html`<div class="empty">
    <p class="muted">No boxes yet. A virtual box marks an object once, and with that in every frame. Three ways to make one:</p>
    <button class="way" onClick=${() => makeBox(usual)}>
      <${Icon} name="box" size=${20} />
      <span><strong>New box here</strong><span class="muted">Where the view looks; then move and size it.</span></span>
      <kbd>${command("new-box").keys[0]}</kbd>
    </button>
    <button class="way" onClick=${command("points").run}>
      <${Icon} name="waypoints" size=${20} />
      <span><strong>From four points</strong><span class="muted">Four corners, each clicked in two frames.</span></span>
      <kbd>${command("points").keys[0]}</kbd>
    </button>
    <button class="way" onClick=${command("mode-masks").run}>
      <${Icon} name="pencil" size=${20} />
      <span><strong>From masks</strong><span class="muted">Its outline, drawn in two frames: for round objects.</span></span>
      <kbd>${command("mode-masks").keys[0]}</kbd>
    </button>
  </div>`;
}
