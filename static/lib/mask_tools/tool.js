/** What every drawing tool can be told; each answers to what it has a use for. Places are in image coordinates. */

/** @typedef {import("../rings.js").Corner} Corner */
/** @typedef {import("../rings.js").Polygon} Polygon */
/** @typedef {import("../rings.js").Polygons} Polygons */
/** @typedef {import("../rings.js").Place} Place */
/** @typedef {import("../mask_sheet.js").Operation} Operation */
/** @typedef {import("../image_pane.js").Modifiers} Modifiers */
/** @typedef {Partial<import("../image_pane.js").Overlay>} Shown */
/** @typedef {import("../pane_gestures.js").Drag} Drag */
/** Joined with a mask or cut out of it by the server. @typedef {{polygon: Polygon} | {stroke: {points: Corner[], width: number}}} Shape */

/**
 * What a tool draws on: one object's mask in the image that the pane shows.
 * @typedef {object} Board
 * @property {import("../mask_sheet.js").MaskSheet} sheet
 * @property {number} zoom CSS pixels an image pixel
 * @property {string} color of the object
 * @property {number} brush its diameter, image pixels
 * @property {boolean} aimed arrow keys put the crosshair where it is: Enter means that place
 * @property {import("./open_ring.js").OpenRing} ring
 * @property {import("./corners.js").Corners} corners
 * @property {(event: Modifiers) => Operation} operation what is chosen; with Alt, to cut out
 * @property {(shape: Shape, operation: Operation, step: string) => Promise<boolean>} combine false: it could not be done, and that is said
 * @property {(prompt: import("./smart_tool.js").Prompt) => Promise<Polygons>} segment
 * @property {(sheet: import("../mask_sheet.js").MaskSheet, base: Polygons, shapes: Polygons, operation: "add" | "subtract") => Promise<Polygons>} joined
 * @property {(text: string) => void} say for who does not see it
 * @property {(text: string | null) => void} fail what went wrong, in words; null: nothing any more
 * @property {() => void} repaint
 */

/** What is cut out is drawn in this colour. */
export const CUT = "#ff7b72";

/** @param {Operation} operation @param {string} color of the object */
export const colorOf = (operation, color) => (operation === "subtract" ? CUT : color);

export class MaskTool {
  /** @param {Board} board */
  constructor(board) {
    this.board = board;
  }

  /** Whether corners are shown, and can be moved. */
  get showsCorners() {
    return false;
  }

  /** The brush that is seen at the pointer. @returns {{diameter: number, color: string} | null} */
  get cursor() {
    return null;
  }

  /** @param {Place} _at @param {Modifiers} _event @returns {Drag | null} null: it is a click, or pans */
  press(_at, _event) {
    return null;
  }

  /** @param {Place} _at @param {Modifiers} _event */
  click(_at, _event) {}

  /** @param {Place | null} _at @param {"pointer" | "finger" | "keys"} _by */
  hover(_at, _by) {}

  doubleClick() {}

  /** Back out one step. @returns {boolean} whether there was one */
  cancel() {
    return false;
  }

  /** What the tool shows over the mask. @returns {Shown} */
  overlay() {
    return {};
  }
}
