/** What keys do in masks mode; its tools. */

import * as store from "../../store.js";
import { drawing, TOOLS } from "./drawing.js";
import { activate, active, activeFrame, openView, panes } from "./panes.js";
import { guidance } from "./guidance.js";
import { subject } from "./subject.js";

const inMasks = () => store.mode.value === "masks";

/** @type {import("../commands.js").Command[]} */
export const maskCommands = [
  ...TOOLS.map(({ tool, title, key }) => ({
    id: `mask-${tool}`,
    title,
    group: /** @type {const} */ ("Masks"),
    keys: [key],
    run: () => void (drawing.tool.value = tool),
    when: inMasks,
  })),
  {
    id: "mask-next-view",
    title: "Open the best next view",
    group: "Masks",
    keys: ["W"],
    run: () => openView(guidance.value?.next_view?.frame ?? activeFrame()),
    when: () => inMasks() && (guidance.value?.next_view ?? null) !== null,
  },
  {
    id: "mask-next-pane",
    title: "Next pane",
    group: "Masks",
    keys: ["Z"],
    run: () => activate((active.value + 1) % panes.value.length),
    when: () => inMasks() && panes.value.length > 1,
  },
];

/** The sheet of the object in the pane at hand. */
function sheetAtHand() {
  const now = subject.value;
  return now === null ? null : drawing.of(now.key, activeFrame());
}

/**
 * Of a ring that is being drawn, and of what is drawn and not stored, the steps are the drawing's own; of all else the
 * session's. Answers whether there was such a step.
 * @param {"undo" | "redo"} which
 */
export function stepDrawing(which) {
  if (!inMasks()) return false;
  const sheet = sheetAtHand();
  if (sheet === null) return false;
  const ring = sheet.open.value;
  if (ring !== null && which === "undo") {
    sheet.draw(ring.length > 1 ? ring.slice(0, -1) : null);
    return true;
  }
  if (!sheet.dirty.value) return false;
  if (!(which === "undo" ? sheet.canUndo.value : sheet.canRedo.value)) return false;
  sheet[which]();
  return true;
}

/** Take away the mask in the pane at hand; what goes wrong is shown at the object's masks. */
export function removeMask() {
  const mask = store.masksOfSelected.value.find(({ frame }) => frame === activeFrame());
  if (mask === undefined) return;
  void store.attempt("masks", () => store.actions.deleteMask(mask.id));
}
