/** Corner by corner: a click adds one, the first one, Enter or a double click closes; closed rings are mended as they are. */

import { MaskTool } from "./tool.js";

export class PolygonTool extends MaskTool {
  /** @type {import("./tool.js").Place | null} */
  #pointer = null;

  get showsCorners() {
    return this.board.ring.corners === null;
  }

  /** @param {import("./tool.js").Place} at @param {import("./tool.js").Modifiers} event */
  press(at, event) {
    return this.board.ring.corners === null && !event.altKey ? this.board.corners.press(at) : null;
  }

  /** @param {import("./tool.js").Place} at @param {import("./tool.js").Modifiers} event */
  click(at, event) {
    this.board.corners.release();
    this.board.ring.click(at, event);
  }

  /** @param {import("./tool.js").Place | null} at @param {"pointer" | "finger" | "keys"} by */
  hover(at, by) {
    this.#pointer = at;
    this.board.ring.hover(at, by);
  }

  doubleClick() {
    void this.board.ring.close();
  }

  /** @returns {import("./tool.js").Shown} */
  overlay() {
    const { ring, corners } = this.board;
    return ring.corners === null ? { points: corners.ghost(this.#pointer) } : ring.overlay(true);
  }
}
