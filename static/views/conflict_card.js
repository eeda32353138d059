/** An edit of ours that met somebody else's: both, side by side, and which is to stay. */

import { fixed } from "../lib/quantity.js";
import { anglesOfWxyz } from "../lib/rotation.js";
import { html, useSignal } from "../lib/view.js";
import * as store from "../store.js";

const GROUPS = /** @type {const} */ ([
  ["Position", "mm", "XYZ"],
  ["Rotation", "°", "RPY"],
  ["Size", "mm", "XYZ"],
]);

export function ConflictCard() {
  const conflict = store.conflict.value;
  return conflict === null ? null : html`<${Card} key=${conflict.box_id} conflict=${conflict} />`;
}

/** @param {{conflict: import("../store.js").Conflict}} props */
function Card({ conflict }) {
  const busy = useSignal(false);
  const { box_id, detail, yours, current } = conflict;
  const keep = () => (store.conflict.value = null);
  const overrule = async () => {
    busy.value = true;
    await store.attempt(`box:${box_id}`, () => store.actions.overrule(yours));
    busy.value = false;
  };
  return html`<section class="card conflict" aria-label="Conflict">
    <p class="problem" role="alert">${sentence(detail)}</p>
    <p class="muted">${current === null
      ? "Your change could not be stored. Whoever deleted the box can undo that; these are your numbers."
      : "Your change is not stored. Which one is to stay?"}</p>
    <${Numbers} yours=${yours} current=${current} />
    <div class="row">
      ${current === null
        ? html`<button class="button" onClick=${keep}>Leave it deleted</button>`
        : html`<button class="button" disabled=${busy.value} onClick=${keep}>Keep theirs</button>
            <button class="button" disabled=${busy.value} onClick=${() => void overrule()}>Use mine</button>`}
    </div>
  </section>`;
}

/** @param {Pick<import("../store.js").Conflict, "yours" | "current">} props */
function Numbers({ yours, current }) {
  const theirs = current === null ? null : numbers(current, null);
  const mine = numbers(yours, theirs === null ? null : theirs[1]);
  const finely = theirs !== null && mine.every((row, i) => row.every((value, j) => fixed(value, 1) === fixed(theirs[i][j], 1)));
  const text = (/** @type {number} */ value) => fixed(value, finely ? 3 : 1);
  const differs = (/** @type {number} */ i, /** @type {number} */ j) => theirs !== null && text(theirs[i][j]) !== text(mine[i][j]);
  const shown = GROUPS.map((_, i) => i).filter((i) => theirs === null || [0, 1, 2].some((j) => differs(i, j)));
  const same = GROUPS.filter((_, i) => !shown.includes(i)).map(([name], i) => (i === 0 ? name : name.toLowerCase()));
  return html`<table>
    <thead><tr><th scope="col"><span class="visually-hidden">Number</span></th>${theirs !== null && html`<th scope="col">Theirs</th>`}<th scope="col">Yours</th></tr></thead>
    <tbody>
      ${shown.flatMap((i) => {
        const [name, unit, axes] = GROUPS[i];
        return [...axes].map(
          (axis, j) => html`<tr key=${`${name}${axis}`} data-differs=${differs(i, j)}>
            <th scope="row">${j === 0 ? `${name} ${unit}` : html`<span class="visually-hidden">${name}</span>`} <span data-tone=${"xyz"[j]}>${axis}</span></th>
            ${theirs !== null && html`<td>${text(theirs[i][j])}</td>`}
            <td>${differs(i, j) ? html`<strong>${text(mine[i][j])}</strong><span class="visually-hidden">, differs</span>` : text(mine[i][j])}</td>
          </tr>`,
        );
      })}
    </tbody>
  </table>
  ${same.length > 0 && html`<p class="muted">${same.join(" and ")} ${same.length === 1 ? "is" : "are"} the same in both.</p>`}`;
}

/**
 * Position and size in mm, rotation in degrees.
 * @param {{T_world_box: import("../store.js").Transform, size: readonly number[]}} box
 * @param {import("../lib/rotation.js").Angles | null} near
 * @returns {[number[], [number, number, number], number[]]}
 */
function numbers({ T_world_box, size }, near) {
  const inMillimetres = (/** @type {readonly number[]} */ lengths) => lengths.map((length) => length * 1000);
  return [inMillimetres(T_world_box.position), anglesOfWxyz(T_world_box.wxyz, near), inMillimetres(size)];
}

/** @param {string} text the server's, which begins in lower case */
function sentence(text) {
  return `${text.charAt(0).toUpperCase()}${text.slice(1)}${/[.!?]$/.test(text) ? "" : "."}`;
}
