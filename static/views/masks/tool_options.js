/** What the tool at hand can be told, in the pane that is drawn in. */

import { Icon } from "../../lib/icon.js";
import { html } from "../../lib/view.js";
import { drawing, LEAST_BRUSH, MOST_BRUSH } from "./drawing.js";

/** @typedef {import("../../lib/mask_editor.js").MaskEditor} MaskEditor */
/** @typedef {import("../../lib/mask_editor.js").ToolName} ToolName */

/** @type {readonly [import("../../lib/mask_editor.js").Operation, string, string][]} */
const OPERATIONS = [
  ["new", "New", "The next shape takes the place of the mask"],
  ["add", "Add", "Shapes join the mask"],
  ["subtract", "Cut out", "Shapes are cut out of the mask: bites, or holes (hold Alt)"],
];
/** @type {readonly [import("../../lib/mask_tools/smart_tool.js").Marking, string, string][]} */
const MARKINGS = [
  ["box", "Box", "Drag a rough box round the object"],
  ["inside", "Inside", "Draw over what belongs to the object"],
  ["outside", "Outside", "Draw over what does not belong to it (hold Shift)"],
];

/** @type {Record<ToolName, string>} */
const HOW = {
  select: "Drag points, edges or pieces. Page Up and Page Down choose a point, arrows move it, Insert adds one, Delete removes it.",
  polygon: "Arrows move the crosshair, Enter adds a point, and closes where it did not move. Backspace takes a point back.",
  lasso: "Draw round the object. By keys: arrows and Enter, as with the polygon.",
  rectangle: "Drag from corner to corner. By keys: Enter at one corner, then at the other.",
  brush: "Paint. By keys: Enter dabs, Shift and Enter draws on. Brackets change the size.",
  eraser: "Rub out. By keys: Enter dabs, Shift and Enter draws on. Brackets change the size.",
  smart: "Drag a rough box round the object, then mark what is missing; with Shift, what is too much. By keys: Enter.",
};

/** How a tool is used, for a screen reader. @param {ToolName} tool */
export const howTo = (tool) => HOW[tool];

/** @param {{editor: MaskEditor, sheet: import("../../lib/mask_sheet.js").MaskSheet}} props */
export function ToolOptions({ editor, sheet }) {
  const tool = drawing.tool.value;
  const open = sheet.open.value;
  const drawn = sheet.polygons.value.length > 0;
  const chosen = editor.corners.chosen.value !== null;
  return html`<div class="tool-options" role="group" aria-label="Tool options">
    ${tool === "smart" && html`<${Smart} editor=${editor} />`}
    ${drawn && open === null && (["polygon", "lasso", "rectangle"].includes(tool) || (tool === "smart" && editor.smart.marking === "box")) && html`<${Choice} label="What the next shape does" choices=${OPERATIONS} value=${drawing.operation.value} onChoose=${(/** @type {any} */ next) => (drawing.operation.value = next)} />`}
    ${(tool === "brush" || tool === "eraser") && html`<${BrushSize} />`}
    ${open !== null &&
    html`<div class="chip">
      <span class="muted">${open.length} ${open.length === 1 ? "point" : "points"}</span>
      <button type="button" class="button quiet" disabled=${open.length < 3} title="Close the outline (Enter)" onClick=${() => void editor.ring.close()}>Close</button>
      <button type="button" class="button quiet" title="Give the outline up (Escape)" onClick=${() => editor.ring.drop()}>Give up</button>
    </div>`}
    ${chosen && open === null &&
    html`<div class="chip">
      <button type="button" class="button quiet" title="Remove the chosen point (Delete)" onClick=${() => editor.corners.remove()}>Remove point</button>
      <button type="button" class="button quiet" title="Remove the piece or fill the hole that it belongs to (Shift Delete)" onClick=${() => editor.corners.removeRing()}>${ringWord(editor)}</button>
    </div>`}
    ${(sheet.canUndo.value || sheet.canRedo.value || open !== null) &&
    html`<div class="chip steps">
      <button type="button" class="button quiet icon-only" aria-label="Undo in this outline" title=${`Undo ${sheet.undoes.value ?? "the last point"} (Ctrl Z)`} disabled=${!sheet.canUndo.value && open === null} onClick=${() => editor.undo()}><${Icon} name="undo-2" size=${14} /></button>
      <button type="button" class="button quiet icon-only" aria-label="Redo in this outline" title=${`Redo ${sheet.redoes.value ?? ""} (Ctrl Shift Z)`} disabled=${!sheet.canRedo.value} onClick=${() => editor.redo()}><${Icon} name="redo-2" size=${14} /></button>
    </div>`}
  </div>`;
}

/** @param {MaskEditor} editor */
function ringWord(editor) {
  return (editor.corners.chosen.value?.ring ?? 0) > 0 ? "Fill hole" : "Remove piece";
}

/** @param {{editor: MaskEditor}} props */
function Smart({ editor }) {
  const { smart } = editor;
  const { rectangle, inside, outside } = smart.marks.value;
  const begun = rectangle !== null || inside.length + outside.length > 0;
  return html`<${Choice} label="What the next drag is" choices=${MARKINGS} value=${smart.marking} onChoose=${(/** @type {any} */ next) => (smart.chosen.value = next)} />
    ${smart.busy.value
      ? html`<div class="chip"><${Icon} name="loader-circle" size=${14} /><span class="muted">Finding the outline</span></div>`
      : begun && html`<button type="button" class="chip button" title="Keep this outline, and begin another (Enter, Escape)" onClick=${() => smart.finish()}>Keep</button>`}`;
}

/**
 * @param {object} props
 * @param {string} props.label
 * @param {readonly (readonly [string, string, string])[]} props.choices value, word, explanation
 * @param {string} props.value
 * @param {(value: string) => void} props.onChoose
 */
function Choice({ label, choices, value, onChoose }) {
  return html`<div class="chip segments" role="group" aria-label=${label}>
    ${choices.map(([key, word, title]) => html`<button key=${key} type="button" class="button quiet" title=${title} aria-pressed=${key === value} onClick=${() => onChoose(key)}>${word}</button>`)}
  </div>`;
}

function BrushSize() {
  const now = drawing.brush.value;
  return html`<label class="chip">Size
    <input
      type="range" min=${Math.log(LEAST_BRUSH)} max=${Math.log(MOST_BRUSH)} step="0.01" value=${Math.log(now)} aria-label="Brush size" aria-valuetext=${`${now} pixels`} title="[ and ]"
      onInput=${(/** @type {any} */ event) => (drawing.brush.value = Math.max(LEAST_BRUSH, Math.round(Math.exp(Number(event.currentTarget.value)))))}
    />
    <output>${now} px</output>
  </label>`;
}
