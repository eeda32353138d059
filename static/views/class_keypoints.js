/** The named points of a class's objects, which formats with keypoints write. */

import { Icon } from "../lib/icon.js";
import { html, useSignal } from "../lib/view.js";
import * as store from "../store.js";

/** @typedef {import("../store.js").Keypoint} Keypoint */

/** @param {import("./class_editor.js").ClassPart} props */
export function ClassKeypoints({ one, tried, say, wrong }) {
  const points = one.keypoints;
  /** What is being typed, and where; null: nothing. */
  const draft = useSignal(/** @type {{row: number, field: number, text: string} | null} */ (null));
  /** @param {readonly Keypoint[] | null} keypoints */
  const give = (keypoints) => tried("keypoints", store.actions.changeClass(one.id, { keypoints }));
  const commit = async () => {
    const now = draft.value;
    if (now === null || points[now.row] === undefined) return;
    const next = changed(points[now.row], now.field, now.text.trim());
    if (typeof next === "string") return say("keypoints", next);
    if (JSON.stringify(next) !== JSON.stringify(points[now.row])) {
      if (!(await give(points.map((old, row) => (row === now.row ? next : old))))) return;
    } else say("keypoints", null);
    if (draft.value === now) draft.value = null;
  };
  /** @param {number} row @param {number} field 0: the name; 1, 2, 3: x, y, z @param {string} label */
  const cell = (row, field, label) => {
    const stored = field === 0 ? points[row].name : String(+points[row].place[field - 1].toFixed(6));
    const typed = draft.value?.row === row && draft.value.field === field ? draft.value.text : null;
    return html`<input
      class="field" aria-label=${label} autocomplete="off" spellcheck=${false} maxlength="60" value=${typed ?? stored}
      onInput=${(/** @type {any} */ event) => (draft.value = { row, field, text: event.currentTarget.value })}
      onBlur=${() => void commit()}
      onKeyDown=${(/** @type {KeyboardEvent} */ event) => {
        if (event.key === "Enter") void commit();
        if (event.key === "Escape") draft.value = null;
      }}
    />`;
  };
  const add = () => void give([...points, { name: freeName(points), place: [0, 0, 0] }]);
  return html`<div class="class-part" role="group" aria-label="Keypoints">
    <div class="line"><span class="muted">Keypoints</span>
      <span class="row spread">
        <span class=${points.length === 0 ? "muted" : ""}>${points.length === 0 ? "centre and corners" : `${points.length} named`}</span>
        <button class="button small" aria-label="Add keypoint" onClick=${add}>Add</button>
      </span>
    </div>
    ${points.length > 0 &&
    html`<div class="keypoints">
        <span class="muted small">Name</span>${["X", "Y", "Z"].map((axis) => html`<span key=${axis} class="muted small" data-tone=${axis.toLowerCase()}>${axis}</span>`)}<span></span>
        ${points.map(
          ({ name }, row) => html`${cell(row, 0, `Name of keypoint ${row + 1}`)}${["X", "Y", "Z"].map((axis, i) => cell(row, i + 1, `${axis} of ${name}`))}
            <button class="button quiet icon-only" aria-label=${`Remove ${name}`} title="Remove" onClick=${() => void give(points.filter((_, at) => at !== row))}><${Icon} name="x" size=${14} /></button>`,
        )}
      </div>
      <p class="muted small">Shares of the box's size from its centre: a corner is at 0.5 or −0.5.
        <button class="button link" onClick=${() => void give(null)}>Centre and corners again</button></p>`}
    ${wrong("keypoints")}
  </div>`;
}

/** The keypoint once one of its fields is what was typed; or what is wrong with it. @param {Keypoint} old @param {number} field @param {string} text */
function changed(old, field, text) {
  if (field === 0) return text === "" ? "A keypoint needs a name, such as spout." : { ...old, name: text };
  const value = Number(text.replace(",", ".").replace("−", "-"));
  if (text === "" || !Number.isFinite(value)) return `“${text}” is not a number: a corner is at 0.5 or -0.5.`;
  const [x, y, z] = old.place.map((was, i) => (i === field - 1 ? value : was));
  return { ...old, place: /** @type {[number, number, number]} */ ([x, y, z]) };
}

/** @param {readonly Keypoint[]} points */
function freeName(points) {
  for (let number = points.length + 1; ; number++) {
    if (!points.some(({ name }) => name === `point ${number}`)) return `point ${number}`;
  }
}
