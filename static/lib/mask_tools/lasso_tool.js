/** Freehand: what is drawn round in one go; by keys, corner by corner. */

import { LEAST, away, cornerAt, polygonOf, simplified } from "../rings.js";
import { MaskTool, colorOf } from "./tool.js";

/** CSS pixels from one corner to the next, at least. */
const STEP = 2;
/** By how much a line may be off once it is simplified, CSS pixels. */
const TOLERANCE = 0.75;

export class LassoTool extends MaskTool {
  /** @type {{path: import("./tool.js").Corner[], operation: import("./tool.js").Operation} | null} */
  #drawn = null;

  /** @param {import("./tool.js").Place} at @param {import("./tool.js").Modifiers} event @returns {import("./tool.js").Drag} */
  press(at, event) {
    const { zoom, combine } = this.board;
    const drawn = { path: [cornerAt(at)], operation: this.board.operation(event) };
    this.#drawn = drawn;
    return {
      move: (to) => {
        const corner = cornerAt(to);
        if (away(drawn.path[drawn.path.length - 1], corner) * zoom >= STEP) drawn.path.push(corner);
        this.board.repaint();
      },
      end: () => {
        this.#drawn = null;
        const ring = simplified(drawn.path, TOLERANCE / zoom);
        if (ring.length >= LEAST) void combine({ polygon: polygonOf(ring) }, drawn.operation, drawn.operation === "subtract" ? "cut out" : "lasso");
        this.board.repaint();
      },
      cancel: () => {
        this.#drawn = null;
        this.board.repaint();
      },
    };
  }

  /** @param {import("./tool.js").Place} at @param {import("./tool.js").Modifiers} event */
  click(at, event) {
    this.board.ring.click(at, event);
  }

  /** @param {import("./tool.js").Place | null} at @param {"pointer" | "finger" | "keys"} by */
  hover(at, by) {
    this.board.ring.hover(at, by);
  }

  doubleClick() {
    void this.board.ring.close();
  }

  /** @returns {import("./tool.js").Shown} */
  overlay() {
    if (this.#drawn === null) return this.board.ring.overlay(true);
    const { path, operation } = this.#drawn;
    return { regions: [{ rings: [path], color: colorOf(operation, this.board.color), fill: 0.2, width: 2 }] };
  }
}
