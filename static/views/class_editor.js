/** A class's name, colour, usual size, symmetry, keypoints and mesh, each stored as soon as it is given. */

import { Popover } from "../lib/popover.js";
import { parseQuantity, trimmed } from "../lib/quantity.js";
import { html, useSignal } from "../lib/view.js";
import * as store from "../store.js";
import { ClassKeypoints } from "./class_keypoints.js";
import { ClassMesh } from "./class_mesh.js";
import { ClassSymmetry } from "./class_symmetry.js";

/** @typedef {import("../store.js").ObjectClass} ObjectClass */
/** @typedef {[number, number, number]} Triple */

/**
 * What the parts of the editor change a class by.
 * @typedef {object} ClassPart
 * @property {ObjectClass} one
 * @property {(at: string, work: Promise<unknown>) => Promise<boolean>} tried whether it went well; else it is said at `at`
 * @property {(at: string, text: string | null) => void} say what is wrong at a place, before the server is asked
 * @property {(at: string) => any} wrong what is shown there
 */

/** Okabe and Ito's, told apart by colour-blind eyes. */
const COLOURS = [
  ["#56b4e9", "Sky blue"],
  ["#e69f00", "Orange"],
  ["#009e73", "Green"],
  ["#cc79a7", "Pink"],
  ["#0072b2", "Blue"],
  ["#d55e00", "Vermilion"],
  ["#f0e442", "Yellow"],
];

/** @param {{one: ObjectClass, anchor: import("../lib/view.js").RefObject<HTMLElement>, onClose: () => void}} props */
export function ClassEditor({ one, anchor, onClose }) {
  const problem = useSignal(/** @type {{at: string, text: string} | null} */ (null));
  const name = useSignal(/** @type {string | null} */ (null));
  /** @param {string} at where it is shown if it fails @param {Promise<unknown>} work @returns {Promise<boolean>} */
  const tried = async (at, work) => {
    problem.value = null;
    try {
      await work;
      return true;
    } catch (error) {
      problem.value = { at, text: /** @type {Error} */ (error).message };
      return false;
    }
  };
  /** @param {string} at */
  const wrong = (at) => problem.value?.at === at && html`<p class="problem" role="alert">${problem.value.text}</p>`;
  const rename = async () => {
    const wanted = name.value?.trim() ?? one.name;
    if (wanted === one.name) return void (name.value = null);
    if (wanted === "") return void (problem.value = { at: "name", text: "A class needs a name." });
    const typed = name.value;
    // What is typed while the answer is awaited stays.
    if ((await tried("name", store.actions.changeClass(one.id, { name: wanted }))) && name.value === typed) name.value = null;
  };
  /** @param {string} color */
  const recolour = (color) => void tried("colour", store.actions.changeClass(one.id, { color }));
  /** @param {Triple | null} size */
  const resize = (size) => tried("size", store.actions.changeClass(one.id, { default_size: size }));
  const remove = async () => {
    if (await tried("delete", store.actions.deleteClass(one.id))) onClose();
  };
  const chosen = store.selectedBox.value;
  /** @type {ClassPart} */
  const part = { one, tried, wrong, say: (at, text) => (problem.value = text === null ? null : { at, text }) };

  return html`<${Popover} label=${`Class ${one.name}`} anchor=${anchor} onClose=${onClose}>
    <label class="line"><span class="muted">Name</span>
      <input
        class="field" value=${name.value ?? one.name} maxlength="200" autocomplete="off" aria-invalid=${problem.value?.at === "name"}
        onInput=${(/** @type {any} */ event) => (name.value = event.currentTarget.value)} onBlur=${rename}
        onKeyDown=${(/** @type {KeyboardEvent} */ event) => {
          if (event.key === "Enter") void rename();
          if (event.key === "Escape") name.value = null; // or it would be kept as the field goes
        }}
      />
    </label>
    ${wrong("name")}
    <div class="line" role="group" aria-label="Colour"><span class="muted">Colour</span>
      <span class="colours">
        ${COLOURS.map(
          ([color, called]) => html`<button
            key=${color} class="colour" style=${{ background: color }} aria-label=${called} title=${called}
            aria-pressed=${one.color === color} onClick=${() => recolour(color)}
          ></button>`,
        )}
        <input class="colour" type="color" value=${one.color} aria-label="Another colour" title="Another colour"
          onChange=${(/** @type {any} */ event) => recolour(event.currentTarget.value)} />
      </span>
    </div>
    ${wrong("colour")}
    <${UsualSize} one=${one} resize=${resize} />
    ${wrong("size")}
    ${(chosen !== null || one.default_size !== null) &&
    html`<div class="line actions">
      ${chosen !== null && html`<button class="button small" onClick=${() => void resize([...chosen.size])}>As ${chosen.name}</button>`}
      ${one.default_size !== null && html`<button class="button small" onClick=${() => void resize(null)}>No usual size</button>`}
    </div>`}
    <${ClassSymmetry} ...${part} />
    <${ClassKeypoints} ...${part} />
    <${ClassMesh} ...${part} />
    <div class="line actions">
      <button class="button small bad" onClick=${() => void remove()}>Delete class</button>
    </div>
    ${wrong("delete")}
  </${Popover}>`;
}

/** Three sides that are stored once all are there. @param {{one: ObjectClass, resize: (size: Triple) => Promise<boolean>}} props */
function UsualSize({ one, resize }) {
  const drafts = useSignal(/** @type {(string | null)[]} */ ([null, null, null]));
  const problem = useSignal(/** @type {string | null} */ (null));
  const texts = drafts.value.map((draft, i) => draft ?? (one.default_size === null ? "" : trimmed(one.default_size[i] * 1000, 0, 3)));
  const commit = async () => {
    if (drafts.value.every((draft) => draft === null) || texts.some((text) => text.trim() === "")) return;
    const sides = texts.map((text) => parseQuantity(text, "length"));
    const bad = sides.find((side) => !side.ok || side.value <= 0);
    if (bad !== undefined) return void (problem.value = bad.ok ? "A side is longer than 0 mm." : bad.problem);
    const size = /** @type {Triple} */ (sides.map((side) => (side.ok ? side.value : NaN)));
    const typed = drafts.value;
    if ((await resize(size)) && drafts.value === typed) drafts.value = [null, null, null];
  };
  return html`<div class="line" role="group" aria-label="Usual size, mm"><span class="muted">Size mm</span>
      <span class="sides">
        ${texts.map(
          (text, i) => html`<input
            key=${i} class="field" value=${text} aria-label=${`Usual size ${"XYZ"[i]}, mm`} placeholder=${"XYZ"[i]} autocomplete="off" spellcheck=${false}
            aria-invalid=${problem.value !== null}
            onInput=${(/** @type {any} */ event) => {
              const typed = event.currentTarget.value;
              drafts.value = drafts.value.map((draft, at) => (at === i ? typed : draft));
              problem.value = null;
            }}
            onBlur=${() => void commit()}
            onKeyDown=${(/** @type {KeyboardEvent} */ event) => {
              if (event.key === "Enter") void commit();
              if (event.key === "Escape") drafts.value = [null, null, null];
            }}
          />`,
        )}
      </span>
    </div>
    ${problem.value !== null && html`<p class="problem" role="alert">${problem.value}</p>`}`;
}
