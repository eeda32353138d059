/** A rectangle along the image's edges, dragged from corner to corner; by keys, one corner, then the other. */

import { cornerAt, polygonOf } from "../rings.js";
import { MaskTool, colorOf } from "./tool.js";

/** CSS pixels that a side has at least: less is a slip of the hand. */
export const LEAST_SIDE = 4;

/** @param {import("./tool.js").Place} a @param {import("./tool.js").Place} b @returns {[number, number, number, number]} */
export function boundsOf(a, b) {
  const [from, to] = [cornerAt({ x: Math.min(a.x, b.x), y: Math.min(a.y, b.y) }), cornerAt({ x: Math.max(a.x, b.x), y: Math.max(a.y, b.y) })];
  return [...from, ...to];
}

/** @param {readonly [number, number, number, number]} bounds @returns {import("./tool.js").Corner[]} */
export const ringOf = ([x0, y0, x1, y1]) => [[x0, y0], [x1, y0], [x1, y1], [x0, y1]];

/** Whether it is worth drawing. @param {readonly [number, number, number, number]} bounds @param {number} zoom */
export const isLarge = ([x0, y0, x1, y1], zoom) => Math.min(x1 - x0, y1 - y0) * zoom >= LEAST_SIDE;

export class RectangleTool extends MaskTool {
  /** @type {{from: import("./tool.js").Place, to: import("./tool.js").Place, operation: import("./tool.js").Operation, byKeys: boolean} | null} */
  #drawn = null;

  /** @param {import("./tool.js").Place} at @param {import("./tool.js").Modifiers} event @returns {import("./tool.js").Drag} */
  press(at, event) {
    this.#drawn = { from: at, to: at, operation: this.board.operation(event), byKeys: false };
    return { move: (to) => this.#stretch(to), end: (to) => this.#finish(to), cancel: () => void this.cancel() };
  }

  /** @param {import("./tool.js").Place} at @param {import("./tool.js").Modifiers} event */
  click(at, event) {
    if (!this.board.aimed) return this.board.say("Move the crosshair with the arrows, then press Enter.");
    if (this.#drawn !== null) return this.#finish(at);
    this.#drawn = { from: at, to: at, operation: this.board.operation(event), byKeys: true };
    this.board.say("First corner. Move on and press Enter for the other.");
  }

  /** @param {import("./tool.js").Place | null} at */
  hover(at) {
    if (at !== null && this.#drawn?.byKeys) this.#stretch(at);
  }

  /** @param {import("./tool.js").Place} to */
  #stretch(to) {
    if (this.#drawn !== null) this.#drawn = { ...this.#drawn, to };
    this.board.repaint();
  }

  /** @param {import("./tool.js").Place} to */
  #finish(to) {
    if (this.#drawn === null) return;
    const { from, operation } = this.#drawn;
    const bounds = boundsOf(from, to);
    this.cancel();
    if (isLarge(bounds, this.board.zoom)) void this.board.combine({ polygon: polygonOf(ringOf(bounds)) }, operation, operation === "subtract" ? "cut out" : "rectangle");
  }

  cancel() {
    const had = this.#drawn !== null;
    this.#drawn = null;
    this.board.repaint();
    return had;
  }

  /** @returns {import("./tool.js").Shown} */
  overlay() {
    if (this.#drawn === null) return {};
    const { from, to, operation } = this.#drawn;
    return { regions: [{ rings: [ringOf(boundsOf(from, to))], color: colorOf(operation, this.board.color), fill: 0.15 }] };
  }
}
