/** Corners are moved, put on edges and removed, and whole pieces dragged; nothing new begins. */

import { cornerAt, polygonAt, withShifted } from "../rings.js";
import { MaskTool } from "./tool.js";

export class SelectTool extends MaskTool {
  /** @type {import("./tool.js").Place | null} */
  #pointer = null;

  get showsCorners() {
    return true;
  }

  /** @param {import("./tool.js").Place} at @returns {import("./tool.js").Drag | null} */
  press(at) {
    const { sheet, corners, zoom } = this.board;
    const onEdge = corners.press(at);
    if (onEdge !== null) return onEdge;
    const before = sheet.polygons.peek();
    const piece = polygonAt(before, at);
    if (piece < 0) return null;
    /** @param {import("./tool.js").Place} to */
    const shifted = (to) => {
      const [dx, dy] = cornerAt({ x: to.x - at.x, y: to.y - at.y });
      return withShifted(before, piece, dx, dy);
    };
    let moved = false;
    return {
      move: (to) => {
        moved ||= Math.hypot(to.x - at.x, to.y - at.y) * zoom > 3;
        if (moved) sheet.preview(shifted(to));
      },
      end: (to) => {
        if (moved) sheet.set(shifted(to), "move piece");
        else corners.chosen.value = { polygon: piece, ring: 0, corner: 0 };
      },
      cancel: () => sheet.revert(),
    };
  }

  click() {
    this.board.corners.release();
  }

  /** @param {import("./tool.js").Place | null} at */
  hover(at) {
    this.#pointer = at;
    this.board.repaint();
  }

  /** @returns {import("./tool.js").Shown} */
  overlay() {
    return { points: this.board.corners.ghost(this.#pointer) };
  }
}
