/** The selected box: its class, its place and size as numbers, and what can be done to it. */

import { command } from "./commands.js";
import { NumberField } from "../lib/number_field.js";
import { fixed, millimetres, trimmed } from "../lib/quantity.js";
import { anglesOfWxyz, wxyzOfAngles } from "../lib/rotation.js";
import { html, useRef } from "../lib/view.js";
import * as store from "../store.js";
import { Fit, FitButton } from "./masks/fit.js";
import { SnapButton } from "./snap_button.js";

/** @typedef {import("../store.js").Box} Box */
/** @typedef {import("../lib/rotation.js").Angles} Angles */
/** @typedef {[number, number, number]} Triple */
/** @typedef {{T_world_box: import("../store.js").Transform, size: Triple}} Place */
/** @typedef {"Position" | "Rotation" | "Size"} RowName */

const TONES = /** @type {const} */ (["x", "y", "z"]);
/** Metres, as the server has it. */
const FARTHEST = 1e7;
const LARGEST_SIZE = 1e4;
/** Ten turns: more is a slip of the hand. */
const MOST_DEGREES = 3600;
const TURNS =
  "Roll, pitch and yaw: turns about the world's x, then y, then z. R = Rz(yaw) Ry(pitch) Rx(roll)";

/** @type {Record<RowName, {unit: string, letters: string, names: string[], title: string}>} */
const ROWS = {
  Position: { unit: "mm", letters: "XYZ", names: ["X", "Y", "Z"], title: "The box's centre in the world, mm" },
  Rotation: { unit: "degrees", letters: "RPY", names: ["roll", "pitch", "yaw"], title: TURNS },
  Size: { unit: "mm", letters: "XYZ", names: ["X", "Y", "Z"], title: "Along the box's own axes, mm" },
};

export function BoxNumbers() {
  const box = store.selectedBox.value;
  if (box === null) return null;
  return html`<${Numbers} key=${box.id} box=${box} />`;
}

/** @param {{box: Box}} props the selected box, as it is seen now */
function Numbers({ box }) {
  const fields = useRef(/** @type {HTMLElement | null} */ (null));
  // Several triples describe one rotation: what was typed stays for as long as it is one of them.
  const kept = useRef(/** @type {Angles | null} */ (null));
  kept.current = anglesOfWxyz(box.T_world_box.wxyz, kept.current);
  const values = { Position: box.T_world_box.position, Rotation: kept.current, Size: box.size };
  const problem = store.problems.value.get(`box:${box.id}`);

  /** The box with one number changed. @param {RowName} row @param {number} axis @param {number} value @returns {Place} */
  const changed = (row, axis, value) => {
    const now = store.shownBoxes.value.get(box.id) ?? box;
    const { position, wxyz } = now.T_world_box;
    if (row === "Position") return { T_world_box: { position: replaced(position, axis, value), wxyz }, size: now.size };
    if (row === "Size") return { T_world_box: { position, wxyz }, size: replaced(now.size, axis, value) };
    kept.current = replaced(anglesOfWxyz(wxyz, kept.current), axis, value);
    return { T_world_box: { position, wxyz: wxyzOfAngles(kept.current) }, size: now.size };
  };
  /** @param {RowName} row @param {number} axis @param {number} value */
  const commit = async (row, axis, value) => {
    const { T_world_box, size } = changed(row, axis, value);
    store.setProblem(`box:${box.id}`, null);
    try {
      await store.actions.changeBox(box.id, row === "Size" ? { size } : { T_world_box });
    } catch (error) {
      // The field shows it, unless another box is looked at by now.
      if (store.selected.value !== box.id) store.setProblem(`box:${box.id}`, /** @type {Error} */ (error).message);
      throw error;
    }
  };

  /** Tab goes round the nine fields; Escape leaves them. @param {KeyboardEvent} event */
  const goRound = (event) => {
    if (event.key !== "Tab") return;
    const inputs = [.../** @type {HTMLElement} */ (fields.current).querySelectorAll("input")];
    const [from, to] = event.shiftKey ? [inputs[0], inputs[inputs.length - 1]] : [inputs[inputs.length - 1], inputs[0]];
    if (event.target !== from) return;
    event.preventDefault();
    to.focus();
  };

  return html`<section class="panel-section" aria-label=${box.name}>
    <header class="section-head">
      <h2 class="heading cut" title=${box.name}>${box.name}</h2>
      <${ClassOfBox} box=${box} />
    </header>
    <div class="numbers" ref=${fields} onKeyDown=${goRound}>
      ${/** @type {RowName[]} */ (Object.keys(ROWS)).map(
        (row) => html`<div class="number-row" key=${row} role="group" aria-label=${`${row}, ${ROWS[row].unit}`}>
          <span class="row-label muted" title=${ROWS[row].title}>${row === "Size" ? "Size mm" : row}</span>
          ${TONES.map(
            (tone, axis) => html`<${NumberField}
              key=${tone} label=${`${row} ${ROWS[row].names[axis]}`} letter=${ROWS[row].letters[axis]} tone=${tone}
              title=${ROWS[row].title} locked=${box.locked} value=${values[row][axis]} ...${LOOKS[row]}
              onCommit=${(/** @type {number} */ value) => commit(row, axis, value)}
              onStep=${(/** @type {number} */ value, /** @type {boolean} */ hold) => store.actions.editBox(box.id, changed(row, axis, value), hold)}
              onStepped=${() => void store.actions.finishEdit()} onLeave=${leave}
            />`,
          )}
        </div>`,
      )}
    </div>
    <${Buttons} box=${box} />
    ${problem !== undefined &&
    html`<p class="problem dismissible" role="alert">${problem}
      <button class="button link" onClick=${() => store.setProblem(`box:${box.id}`, null)}>Dismiss</button>
    </p>`}
  </section>`;
}

/** How each row's numbers are typed and shown. */
const LOOKS = {
  Position: {
    kind: "length",
    step: 0.001,
    shown: millimetres,
    edited: (/** @type {number} */ metres) => trimmed(metres * 1000, 1, 3),
    wrong: (/** @type {number} */ metres) =>
      Math.abs(metres) <= FARTHEST ? null : `A box is at most ${FARTHEST / 1000} km from the origin.`,
  },
  Rotation: {
    kind: "angle",
    step: 1,
    shown: (/** @type {number} */ degrees) => `${fixed(degrees, 1)}°`,
    edited: (/** @type {number} */ degrees) => trimmed(degrees, 1, 3),
    wrong: (/** @type {number} */ degrees) =>
      Math.abs(degrees) <= MOST_DEGREES ? null : `An angle is from -${MOST_DEGREES}° to ${MOST_DEGREES}°.`,
  },
  Size: {
    kind: "length",
    step: 0.001,
    shown: millimetres,
    edited: (/** @type {number} */ metres) => trimmed(metres * 1000, 1, 3),
    wrong: (/** @type {number} */ metres) =>
      metres <= 0 ? "A side is longer than 0 mm." : metres <= LARGEST_SIZE ? null : `A side is at most ${LARGEST_SIZE / 1000} km long.`,
  },
};

/** @param {{box: Box}} props */
function ClassOfBox({ box }) {
  return html`<select
    class="quiet-select" aria-label=${`Class of ${box.name}`} disabled=${box.locked} value=${box.class_id}
    onChange=${(/** @type {any} */ event) => {
      const wanted = Number(event.currentTarget.value);
      event.currentTarget.value = String(box.class_id);
      void store.attempt(`box:${box.id}`, () => store.actions.changeBox(box.id, { class_id: wanted }));
    }}
  >${[...store.classes.value.values()].map((one) => html`<option key=${one.id} value=${one.id}>${one.name}</option>`)}</select>`;
}

/** @param {{box: Box}} props */
function Buttons({ box }) {
  const stored = store.boxes.value.get(box.id) ?? null;
  /** @param {"box" | "world"} axes */
  const axesButton = (axes) => html`<button
    class="button small" aria-pressed=${store.axes.value === axes} onClick=${() => (store.axes.value = axes)}
    title=${`Move and turn along the ${axes}'s axes (${command("axes").keys[0]})`}
  >${axes === "box" ? "Box axes" : "World axes"}</button>`;
  /** @param {string} id @param {string} words */
  const button = (id, words) => {
    const { keys, run, title, when } = command(id);
    return html`<button class="button small" title=${`${title} (${keys[0]})`} disabled=${!(when?.() ?? true)} onClick=${run}>${words}</button>`;
  };
  return html`<div class="box-buttons">
      <div class="joined" role="group" aria-label="Axes">${axesButton("box")}${axesButton("world")}</div>
      <button
        class="button small" aria-pressed=${store.upright.value} onClick=${command("upright").run}
        title=${`Stand the box upright, and turn it about the world's z only (${command("upright").keys[0]})`}
      >Upright</button>
      <${SnapButton} />
    </div>
    <div class="box-buttons">
      ${button("ground", "To ground")}${button("duplicate", "Duplicate")}
      ${button("lock", box.locked ? "Unlock" : "Lock")}${button("delete", "Delete")}
    </div>
    ${store.masksOfSelected.value.length > 0 && html`<div class="box-buttons"><${FitButton} box=${stored} /></div><${Fit} box=${stored} />`}`;
}

/** Out of the fields, to where the arrows nudge the box: in the list of boxes they would choose another. */
function leave() {
  /** @type {HTMLElement | null} */ (document.activeElement)?.blur();
}

/**
 * @template {readonly [number, number, number]} T
 * @param {T} triple @param {number} axis @param {number} value
 */
function replaced(triple, axis, value) {
  return /** @type {Triple} */ (triple.map((old, i) => (i === axis ? value : old)));
}
