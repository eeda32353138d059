/** The right side in masks mode: the object's masks, what they give together, and the way on. */

import { html, useSignal } from "../../lib/view.js";
import * as store from "../../store.js";
import { addingClass } from "../classes.js";
import { HullOptions } from "./hull_options.js";
import { MasksList } from "./masks_list.js";
import { begin, options, made, subject } from "./subject.js";
import { Views } from "./views_section.js";

export function MasksPanel() {
  const now = subject.value;
  if (now === null) return null;
  return html`${now.id === null && html`<${ClassOfNew} class_id=${now.class_id} />`}
    <${MasksList} subject=${now} />
    <${Views} key=${now.key} subject=${now} />
    <${HullOptions} key=${`${now.key}-options`} subject=${now} />`;
}

/** @param {{class_id: number}} props */
function ClassOfNew({ class_id }) {
  const all = [...store.classes.value.values()];
  return html`<section class="panel-section class-of-new" aria-label="New object">
    <label class="row"><span class="muted">New object of class</span>
      <select
        class="field" value=${class_id} aria-label="Class of the new object"
        onChange=${(/** @type {any} */ event) => {
          const wanted = Number(event.currentTarget.value);
          store.chosenClass.value = wanted;
          store.newClass.value = wanted;
        }}
      >${all.map((one) => html`<option key=${one.id} value=${one.id}>${one.name}</option>`)}</select>
    </label>
    <button class="button link" onClick=${() => (addingClass.value = true)}>Add class</button>
  </section>`;
}

/** The main button: make the box, or, once it is made, go on to the next object. */
export function MakeBox() {
  const now = subject.value;
  const busy = useSignal(false);
  const problem = useSignal(/** @type {{key: string, text: string} | null} */ (null));
  if (now === null) return null;
  const accepted = store.masksOfSelected.value.filter((mask) => mask.accepted).length;
  const isMade = made(now.box) !== undefined;
  if (isMade) {
    return html`<div class="panel-foot"><button class="button main" onClick=${() => begin(now.class_id)}>Outline the next object</button></div>`;
  }
  const few = accepted < 2;
  const locked = now.box?.locked ?? false;
  const make = async () => {
    if (busy.value || few || locked || now.id === null) return;
    busy.value = true;
    problem.value = null;
    try {
      await store.actions.makeHull(now.id, now.box === null ? { ...options.value, class_id: now.class_id } : options.value);
      store.actions.select(now.id);
    } catch (error) {
      problem.value = { key: now.key, text: /** @type {Error} */ (error).message };
    }
    busy.value = false;
  };
  return html`<div class="panel-foot">
    ${problem.value?.key === now.key && html`<p class="problem" role="alert">${problem.value.text}</p>`}
    <button
      class="button main" aria-disabled=${busy.value || few || locked} onClick=${make}
      title=${locked ? "The box is locked: unlock it to make it of its masks." : few ? "Outline the object in two frames first." : "The box round the hull of all masks"}
    >${busy.value ? "Making the box…" : now.box === null ? "Make box" : "Make box of the masks"}</button>
  </div>`;
}
