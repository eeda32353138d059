/** How a class's objects look the same: after which turns nothing about them has changed. */

import { Icon } from "../lib/icon.js";
import { html } from "../lib/view.js";
import * as store from "../store.js";

/** @typedef {import("../store.js").SymmetryDraft} Symmetry */
/** @typedef {[number, number, number]} Axis */

/** @type {readonly [string, Axis][]} */
const AXES = [
  ["X", [1, 0, 0]],
  ["Y", [0, 1, 0]],
  ["Z", [0, 0, 1]],
];
/** Into how many parts a circle is divided, as objects have it. */
const ORDERS = [2, 3, 4, 5, 6, 8, 10, 12];

/** @type {Record<Symmetry["kind"], {words: string, first: Symmetry}>} */
const KINDS = {
  none: { words: "None", first: { kind: "none" } },
  discrete: { words: "Some turns", first: { kind: "discrete", rotations: [{ axis: [0, 0, 1], order: 2 }] } },
  continuous: { words: "Any turn", first: { kind: "continuous", axis: [0, 0, 1], flip: false } },
};

/** @param {import("./class_editor.js").ClassPart} props */
export function ClassSymmetry({ one, tried, wrong }) {
  const { kind, rotations, axis, flip } = one.symmetry;
  /** @param {Symmetry} symmetry */
  const give = (symmetry) => void tried("symmetry", store.actions.changeClass(one.id, { symmetry }));
  /** @param {Symmetry["rotations"]} next */
  const turn = (next) => give({ kind: "discrete", rotations: next });
  return html`<div class="class-part" role="group" aria-label="Symmetry">
    <label class="line"><span class="muted">Symmetry</span>
      <select class="field" aria-label="Symmetry" title="Which turns about the box's centre change nothing about how it looks"
        value=${kind} onChange=${(/** @type {any} */ event) => give(KINDS[/** @type {Symmetry["kind"]} */ (event.currentTarget.value)].first)}
      >${Object.entries(KINDS).map(([value, { words }]) => html`<option key=${value} value=${value}>${words}</option>`)}</select>
    </label>
    ${kind === "discrete" &&
    html`<ul class="turns" aria-label="Turns">
      ${rotations.map(
        (rotation, i) => html`<li key=${i} class="turn">
          <span class="muted">about</span>
          <${AxisChoice} label=${`Axis of turn ${i + 1}`} axis=${rotation.axis} onChoose=${(/** @type {Axis} */ next) => turn(rotations.map((old, at) => (at === i ? { ...old, axis: next } : old)))} />
          <span class="muted">by</span>
          <select class="field" aria-label=${`Part of turn ${i + 1}`} value=${rotation.order}
            onChange=${(/** @type {any} */ event) => turn(rotations.map((old, at) => (at === i ? { ...old, order: Number(event.currentTarget.value) } : old)))}
          >${[...new Set([...ORDERS, rotation.order])].sort((a, b) => a - b).map((order) => html`<option key=${order} value=${order}>1/${order}, ${+(360 / order).toFixed(1)}°</option>`)}</select>
          <button class="button quiet icon-only" aria-label=${`Remove turn ${i + 1}`} title="Remove" disabled=${rotations.length === 1}
            onClick=${() => turn(rotations.filter((_, at) => at !== i))}><${Icon} name="x" size=${14} /></button>
        </li>`,
      )}
      <li><button class="button link" onClick=${() => turn([...rotations, { axis: unused(rotations), order: 2 }])}>Add turn</button>
        <span class="muted small">What follows from them counts too.</span></li>
    </ul>`}
    ${kind === "continuous" &&
    axis !== null &&
    html`<div class="turn">
      <span class="muted">about</span>
      <${AxisChoice} label="Axis" axis=${axis} onChoose=${(/** @type {Axis} */ next) => give({ kind, axis: next, flip })} />
      <label class="row" title="A half turn across the axis changes nothing either, as of a tube; a bottle's ends differ">
        <input type="checkbox" checked=${flip} onChange=${(/** @type {any} */ event) => give({ kind, axis, flip: event.currentTarget.checked })} />
        Both ends alike
      </label>
    </div>`}
    ${wrong("symmetry")}
  </div>`;
}

/** One of the box's axes; any other, which only imports give, stays to be chosen. @param {{label: string, axis: Axis, onChoose: (axis: Axis) => void}} props */
function AxisChoice({ label, axis, onChoose }) {
  const named = AXES.find(([, known]) => isAlong(axis, known))?.[0];
  return html`<select class="field" aria-label=${label} value=${named ?? ""}
    onChange=${(/** @type {any} */ event) => {
      const next = AXES.find(([name]) => name === event.currentTarget.value);
      if (next !== undefined) onChoose(next[1]);
    }}
  >${AXES.map(([name]) => html`<option key=${name} value=${name}>${name}</option>`)}
    ${named === undefined && html`<option value="">${axis.map((part) => +part.toFixed(2)).join(", ")}</option>`}</select>`;
}

/** @param {readonly number[]} axis @param {readonly number[]} known of unit length */
function isAlong(axis, known) {
  const length = Math.hypot(...axis);
  return Math.abs(axis.reduce((sum, part, i) => sum + part * known[i], 0)) > length * (1 - 1e-12);
}

/** An axis that no turn is about yet. @param {readonly {axis: Axis}[]} rotations */
function unused(rotations) {
  return (AXES.find(([, axis]) => !rotations.some((one) => isAlong(one.axis, axis))) ?? AXES[0])[1];
}
