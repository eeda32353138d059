/** A round brush that paints, or takes away. By keys, Enter dabs, and with Shift draws on from the last dab. */

import { away, cornerAt } from "../rings.js";
import { MaskTool, colorOf } from "./tool.js";

/** CSS pixels from one point of a stroke to the next, at least. */
const STEP = 1.5;

export class BrushTool extends MaskTool {
  #erases;
  /** @type {{points: import("./tool.js").Corner[], operation: import("./tool.js").Operation} | null} */
  #drawn = null;
  /** Where the last stroke ended. @type {import("./tool.js").Corner | null} */
  #last = null;

  /** @param {import("./tool.js").Board} board @param {boolean} erases */
  constructor(board, erases) {
    super(board);
    this.#erases = erases;
  }

  get cursor() {
    return { diameter: this.board.brush, color: "#fff" };
  }

  /** @param {import("./tool.js").Modifiers} event @returns {import("./tool.js").Operation} */
  #operation(event) {
    // A stroke of many is no new mask.
    return this.#erases || this.board.operation(event) === "subtract" ? "subtract" : "add";
  }

  /** Where a stroke begins. @param {import("./tool.js").Corner} at @param {import("./tool.js").Modifiers} event @returns {import("./tool.js").Corner[]} */
  #begin(at, event) {
    return event.shiftKey && this.#last !== null ? [this.#last, at] : [at];
  }

  /** @param {import("./tool.js").Place} at @param {import("./tool.js").Modifiers} event @returns {import("./tool.js").Drag} */
  press(at, event) {
    const drawn = { points: this.#begin(cornerAt(at), event), operation: this.#operation(event) };
    const { zoom } = this.board;
    this.#drawn = drawn;
    this.board.repaint();
    return {
      move: (to) => {
        const corner = cornerAt(to);
        if (away(drawn.points[drawn.points.length - 1], corner) * zoom >= STEP) drawn.points.push(corner);
        this.board.repaint();
      },
      end: () => {
        this.#drawn = null;
        this.#finish(drawn.points, drawn.operation);
      },
      cancel: () => {
        this.#drawn = null;
        this.board.repaint();
      },
    };
  }

  /** @param {import("./tool.js").Place} at @param {import("./tool.js").Modifiers} event */
  click(at, event) {
    if (!this.board.aimed) return this.board.say("Move the crosshair with the arrows, then press Enter.");
    this.#finish(this.#begin(cornerAt(at), event), this.#operation(event));
  }

  /** @param {import("./tool.js").Corner[]} points @param {import("./tool.js").Operation} operation */
  #finish(points, operation) {
    this.#last = points[points.length - 1];
    void this.board.combine({ stroke: { points, width: this.board.brush } }, operation, this.#erases ? "erase" : "brush");
  }

  /** @returns {import("./tool.js").Shown} */
  overlay() {
    if (this.#drawn === null) return {};
    const { points, operation } = this.#drawn;
    return { strokes: [{ points, width: this.board.brush, color: colorOf(operation, this.board.color), opacity: 0.5 }] };
  }
}
