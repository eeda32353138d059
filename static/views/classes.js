/** The classes: their colours, usual sizes and how many boxes are of each; each opens to be changed. */

import { html, signal, useLayoutEffect, useRef, useSignal } from "../lib/view.js";
import { sizeText } from "../lib/quantity.js";
import * as store from "../store.js";
import { ClassEditor } from "./class_editor.js";

/** @typedef {import("../store.js").ObjectClass} ObjectClass */

/** Whether a class is being named that is to be added. */
export const addingClass = signal(false);

export function Classes() {
  const all = [...store.classes.value.values()].sort((a, b) => a.id - b.id);
  /** @type {Map<number, number>} */
  const counts = new Map();
  for (const { class_id } of store.boxes.value.values()) counts.set(class_id, (counts.get(class_id) ?? 0) + 1);
  return html`<section class="panel-section" aria-label="Classes">
    <header class="section-head">
      <h2 class="heading">Classes</h2>
      <button class="button link" onClick=${() => (addingClass.value = true)}>Add class</button>
    </header>
    <ul class="classes">
      ${all.map((one) => html`<${ClassRow} key=${one.id} one=${one} count=${counts.get(one.id) ?? 0} />`)}
    </ul>
    ${addingClass.value && html`<${NewClass} />`}
    ${all.length === 0 && !addingClass.value &&
    html`<p class="muted">No classes yet. A class is a kind of object, such as “mug”; each box has one.</p>`}
  </section>`;
}

/** @param {{one: ObjectClass, count: number}} props */
function ClassRow({ one, count }) {
  const row = useRef(/** @type {HTMLElement | null} */ (null));
  const open = useSignal(false);
  const boxes = count === 1 ? "1 box" : `${count.toLocaleString("en")} boxes`;
  return html`<li>
    <button class="class-row" ref=${row} aria-haspopup="dialog" aria-expanded=${open.value} title="Change its name, colour, size, symmetry, keypoints or mesh" onClick=${() => (open.value = !open.value)}>
      <span class="swatch" style=${{ background: one.color }}></span>
      <span class="name cut">${one.name}</span>
      <span class="muted">${one.default_size === null ? boxes : `${boxes}, ${sizeText(one.default_size)}`}</span>
    </button>
    ${open.value && html`<${ClassEditor} one=${one} anchor=${row} onClose=${() => (open.value = false)} />`}
  </li>`;
}

function NewClass() {
  const input = useRef(/** @type {HTMLInputElement | null} */ (null));
  const problem = useSignal(/** @type {string | null} */ (null));
  const busy = useSignal(false);
  useLayoutEffect(() => input.current?.focus(), []);
  const close = () => (addingClass.value = false);
  const add = async () => {
    const name = input.current?.value.trim() ?? "";
    if (name === "") return void (problem.value = "A class needs a name, such as mug.");
    busy.value = true;
    try {
      const made = await store.actions.addClass(name);
      store.chosenClass.value = made.id;
      store.setProblem("boxes", null);
      close();
    } catch (error) {
      problem.value = /** @type {Error} */ (error).message;
    }
    busy.value = false;
  };
  return html`<form class="new-class" onSubmit=${(/** @type {Event} */ event) => {
      event.preventDefault();
      void add();
    }}>
      <input
        class="field" ref=${input} aria-label="Name of the new class" placeholder="Name, such as mug" maxlength="200" autocomplete="off"
        aria-invalid=${problem.value !== null} readonly=${busy.value} onInput=${() => (problem.value = null)}
        onKeyDown=${(/** @type {KeyboardEvent} */ event) => {
          if (event.key !== "Escape") return;
          event.stopPropagation();
          close();
        }}
      />
      <button class="button small">Add</button>
      <button class="button small quiet" type="button" onClick=${close}>Cancel</button>
    </form>
    ${problem.value !== null && html`<p class="problem" role="alert">${problem.value}</p>`}`;
}
