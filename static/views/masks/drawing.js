/** What is drawn on this page: each object's mask in each frame, and the tool at hand. Nothing of it is stored here. */

import { MaskSheet } from "../../lib/mask_sheet.js";
import { signal } from "../../lib/view.js";

/** @typedef {import("../../lib/mask_editor.js").ToolName} ToolName */
/** @typedef {import("../../lib/rings.js").Polygons} Polygons */
/** @typedef {(boxKey: string, frame: number, polygons: Polygons, phase: "live" | "done") => void} Listener */

/** The tools, with the keys that take them. @type {readonly {tool: ToolName, title: string, key: string, icon: string}[]} */
export const TOOLS = [
  { tool: "select", title: "Move points and pieces", key: "V", icon: "mouse-pointer-2" },
  { tool: "polygon", title: "Polygon", key: "P", icon: "waypoints" },
  { tool: "lasso", title: "Lasso", key: "D", icon: "lasso" },
  { tool: "rectangle", title: "Rectangle", key: "T", icon: "square-dashed" },
  { tool: "brush", title: "Brush", key: "K", icon: "brush" },
  { tool: "eraser", title: "Eraser", key: "E", icon: "eraser" },
  { tool: "smart", title: "Smart outline", key: "Q", icon: "wand-sparkles" },
];

/** The brush's diameter, image pixels. */
export const LEAST_BRUSH = 1;
export const MOST_BRUSH = 400;

/** @type {Map<string, Map<number, MaskSheet>>} */
const sheets = new Map();
/** @type {Set<Listener>} */
const listeners = new Set();

export const drawing = {
  tool: signal(/** @type {ToolName} */ ("polygon")),
  brush: signal(24),
  operation: signal(/** @type {import("../../lib/mask_editor.js").Operation} */ ("add")),

  /** @param {string} boxKey the object's name on this page @param {number} frame */
  of(boxKey, frame) {
    const known = sheets.get(boxKey) ?? new Map();
    sheets.set(boxKey, known);
    let sheet = known.get(frame);
    if (sheet === undefined) {
      sheet = new MaskSheet((polygons, phase) => {
        for (const listener of listeners) listener(boxKey, frame, polygons, phase);
      });
      known.set(frame, sheet);
    }
    return sheet;
  },

  /** Hear of what is drawn. Returns the way to stop. @param {Listener} listener */
  onChange(listener) {
    listeners.add(listener);
    return () => void listeners.delete(listener);
  },
};
