/** One box in the list. */

import { Icon } from "../lib/icon.js";
import { initials, personColor } from "../lib/person.js";
import { sizeText } from "../lib/quantity.js";
import { html, useLayoutEffect, useRef, useSignal } from "../lib/view.js";
import * as store from "../store.js";
import { toggleHidden, toggleLock } from "./box_menu.js";

/**
 * @param {object} props
 * @param {string} props.id
 * @param {import("../store.js").Box} props.box
 * @param {number} props.index
 * @param {number} props.offset pixels from the list's top
 * @param {import("../store.js").Person[]} [props.visitors] who else has it selected
 * @param {boolean} props.renaming
 * @param {(begin: boolean) => void} props.onRename
 */
export function BoxRow({ id, box, index, offset, visitors = [], renaming, onRename }) {
  const colour = store.classes.value.get(box.class_id)?.color;
  const className = store.classes.value.get(box.class_id)?.name;
  const isHidden = store.hidden.value.has(box.id);
  const isSelected = store.selected.value === box.id;
  return html`<div
    class="box-row" role="row" id=${id} data-box=${box.id} data-hidden=${isHidden} data-locked=${box.locked}
    aria-selected=${isSelected} aria-rowindex=${index + 1} style=${{ top: `${offset}px` }}
    onClick=${() => store.actions.select(box.id)} onDblClick=${() => onRename(true)}
  >
    <span class="swatch" style=${{ background: colour }} title=${className} role="presentation"></span>
    <span class="name" role="gridcell">
      ${renaming ? html`<${RenameField} box=${box} onDone=${() => onRename(false)} />` : html`<span class="cut" title=${box.name}>${box.name}</span>`}
    </span>
    <${Visitors} visitors=${visitors} />
    <span class="size muted" role="gridcell">${sizeText(box.size)}</span>
    <span class="lock-cell" role="gridcell">
      <${RowButton} class="lock" icon=${box.locked ? "lock" : "lock-open"} pressed=${box.locked} label=${`Lock ${box.name}`}
        title=${box.locked ? "Unlock (K)" : "Lock (K)"} run=${() => toggleLock(box)} />
    </span>
    <span role="gridcell">
      <${RowButton} class="eye" icon=${isHidden ? "eye-off" : "eye"} pressed=${isHidden} label=${`Hide ${box.name}`}
        title=${isHidden ? "Show on this page (H)" : "Hide on this page (H)"} run=${() => toggleHidden(box.id)} />
    </span>
  </div>`;
}

/**
 * An object that is being outlined and has no box yet.
 * @param {{id: string, draft: import("../store.js").Draft & {name: string}, index: number, offset: number, visitors?: import("../store.js").Person[]}} props
 */
export function DraftRow({ id, draft, index, offset, visitors = [] }) {
  const colour = store.classes.value.get(draft.class_id)?.color;
  return html`<div
    class="box-row" role="row" id=${id} data-box=${draft.id} aria-selected=${store.selected.value === draft.id} aria-rowindex=${index + 1}
    style=${{ top: `${offset}px` }} title="It is being outlined, and has no box yet" onClick=${() => store.actions.select(draft.id)}
  >
    <span class="swatch" style=${{ background: colour }} role="presentation"></span>
    <span class="name" role="gridcell"><span class="cut">${draft.name}</span></span>
    <${Visitors} visitors=${visitors} />
    <span class="size muted" role="gridcell">new</span>
  </div>`;
}

/** @param {{visitors: import("../store.js").Person[]}} props */
function Visitors({ visitors }) {
  if (visitors.length === 0) return null;
  return html`<span class="visitors" role="gridcell">${visitors.slice(0, 3).map(
    (person) => html`<span
      class="visitor" key=${person.view} style=${{ background: personColor(person.view) }} role="img"
      aria-label=${`Selected by ${person.name || "someone"}`} title=${`Selected by ${person.name || "someone"}`}
    >${initials(person.name)}</span>`,
  )}</span>`;
}

/**
 * Not reached by Tab: the list's keys and its menu do the same.
 * @param {{class: string, icon: string, label: string, title: string, pressed: boolean, run: () => void}} props
 */
function RowButton({ class: name, icon, label, title, pressed, run }) {
  return html`<button
    class=${`row-button ${name}`} tabindex=${-1} aria-label=${label} aria-pressed=${pressed} title=${title}
    onClick=${(/** @type {Event} */ event) => {
      event.stopPropagation();
      run();
    }}
    onDblClick=${(/** @type {Event} */ event) => event.stopPropagation()}
  ><${Icon} name=${icon} size=${15} /></button>`;
}

/** @param {{box: import("../store.js").Box, onDone: () => void}} props */
function RenameField({ box, onDone }) {
  const input = useRef(/** @type {HTMLInputElement | null} */ (null));
  const typed = useSignal(box.name);
  const problem = useSignal(/** @type {string | null} */ (null));
  const leaving = useRef(false);
  useLayoutEffect(() => {
    input.current?.focus();
    input.current?.select();
  }, []);
  const leave = () => {
    leaving.current = true;
    onDone();
  };
  const keep = async () => {
    if (leaving.current) return;
    const wanted = typed.value.trim();
    if (wanted === box.name) return leave();
    if (wanted === "") return void (problem.value = "A box needs a name; Escape keeps the old one.");
    try {
      await store.actions.changeBox(box.id, { name: wanted });
      if (typed.value.trim() === wanted) leave(); // else somebody types on
    } catch (error) {
      problem.value = /** @type {Error} */ (error).message;
    }
  };
  return html`<input
      class="field rename" aria-label=${`Name of ${box.name}`} maxlength="200" value=${typed.value} ref=${input} spellcheck=${false}
      aria-invalid=${problem.value !== null} onBlur=${keep}
      onInput=${(/** @type {any} */ event) => {
        typed.value = event.currentTarget.value;
        problem.value = null;
      }}
      onClick=${(/** @type {Event} */ event) => event.stopPropagation()}
      onDblClick=${(/** @type {Event} */ event) => event.stopPropagation()}
      onKeyDown=${(/** @type {KeyboardEvent} */ event) => {
        event.stopPropagation();
        if (event.key === "Enter") void keep();
        if (event.key === "Escape") leave();
      }}
    />
    ${problem.value !== null && html`<span class="problem below" role="alert">${problem.value}</span>`}`;
}
