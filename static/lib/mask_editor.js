/**
 * A pane in which a mask is drawn: an image pane, the tools, and what they share. All places are image coordinates.
 *
 *     const editor = new MaskEditor(element, host);
 *     await editor.show(address);
 *     editor.work(sheet, { color: "#e69f00", guidance: [], locked: false });
 *     editor.stop();
 *
 * It takes no key of the page's: what is pressed anywhere for the pane at hand goes to `key`.
 */

import { ImagePane } from "./image_pane.js";
import { MaskSheet } from "./mask_sheet.js";
import { BrushTool } from "./mask_tools/brush_tool.js";
import { Corners } from "./mask_tools/corners.js";
import { LassoTool } from "./mask_tools/lasso_tool.js";
import { OpenRing } from "./mask_tools/open_ring.js";
import { PolygonTool } from "./mask_tools/polygon_tool.js";
import { RectangleTool } from "./mask_tools/rectangle_tool.js";
import { SelectTool } from "./mask_tools/select_tool.js";
import { SmartTool } from "./mask_tools/smart_tool.js";
import { colorOf } from "./mask_tools/tool.js";
import { allRings } from "./rings.js";
import { effect, signal } from "./view.js";

/** @typedef {import("./rings.js").Polygon} Polygon */
/** @typedef {import("./rings.js").Polygons} Polygons */
/** @typedef {import("./mask_sheet.js").Operation} Operation */
/** @typedef {import("./mask_tools/tool.js").Shape} Shape */
/** @typedef {import("./mask_tools/tool.js").Place} Place */
/** @typedef {"polygon" | "lasso" | "brush" | "eraser" | "rectangle" | "smart" | "select"} ToolName */

/**
 * @typedef {object} Host
 * @property {import("./view.js").ReadonlySignal<ToolName>} tool
 * @property {import("./view.js").ReadonlySignal<number>} brush its diameter, image pixels
 * @property {import("./view.js").ReadonlySignal<Operation>} operation
 * @property {(polygons: Polygons, shape: Shape, operation: "add" | "subtract") => Promise<Polygons>} combine
 * @property {(prompt: import("./mask_tools/smart_tool.js").Prompt) => Promise<Polygons>} segment
 * @property {() => void} onNew a shape has taken the place of the mask, as the operation said
 * @property {(text: string | null) => void} onFailure
 * @property {(text: string) => void} onSay for who does not see it
 * @property {(view: import("./image_view.js").View) => void} onView
 */

/**
 * @typedef {object} Look
 * @property {string} color of the object
 * @property {readonly {polygons: Polygons, kind: "band" | "hull"}[]} guidance where the object must lie, or is seen by other views
 * @property {boolean} locked nothing can be changed
 */

/** Opacity of what is inside a mask. */
const FILL = 0.18;
const BAND = "#4aa8ff";
const HULL = "#ffffff";

export class MaskEditor {
  #host;
  #sheet = new MaskSheet(() => {});
  /** @type {Look} */
  #look = { color: BAND, guidance: [], locked: true };
  #pane;
  #zoom = 1;
  #aimed = false;
  /** Whether the point that was pressed last is not there any more. */
  #isGone = () => false;
  /** Shapes that the server is joining to a mask. @type {Set<{sheet: MaskSheet, shape: Shape, operation: Operation}>} */
  #pending = new Set();
  /** What is to be joined to a mask waits for what comes before it. @type {WeakMap<MaskSheet, Promise<unknown>>} */
  #queues = new WeakMap();
  #tools;
  ring;
  corners;
  smart;
  /** Whether the server is still joining something. */
  busy = signal(false);
  #stopWatching = () => {};
  #stopped = false;

  /** @param {HTMLElement} element @param {Host} host */
  constructor(element, host) {
    this.#host = host;
    const editor = this;
    /** @type {import("./mask_tools/tool.js").Board} */
    const board = {
      get sheet() {
        return editor.#sheet;
      },
      get zoom() {
        return editor.#zoom;
      },
      get color() {
        return editor.#look.color;
      },
      get brush() {
        return host.brush.peek();
      },
      get aimed() {
        return editor.#aimed;
      },
      get ring() {
        return ring;
      },
      get corners() {
        return corners;
      },
      operation: ({ altKey }) => (altKey ? "subtract" : host.operation.peek()),
      combine: (shape, operation, step) => this.#combine(shape, operation, step),
      segment: host.segment,
      joined: async (_sheet, base, shapes, operation) => {
        let now = base;
        for (const polygon of shapes) now = await host.combine(now, { polygon }, operation);
        return now;
      },
      say: host.onSay,
      fail: host.onFailure,
      repaint: () => this.#paint(),
    };
    const ring = new OpenRing(board);
    const corners = new Corners(board);
    this.ring = ring;
    this.corners = corners;
    this.smart = new SmartTool(board);
    /** @type {Record<ToolName, import("./mask_tools/tool.js").MaskTool>} */
    this.#tools = {
      polygon: new PolygonTool(board),
      lasso: new LassoTool(board),
      rectangle: new RectangleTool(board),
      brush: new BrushTool(board, false),
      eraser: new BrushTool(board, true),
      smart: this.smart,
      select: new SelectTool(board),
    };
    this.#pane = new ImagePane(
      element,
      {
        onPress: (at, event) => this.#press(at, event),
        onClick: (at, event) => this.#click(at, event),
        onDoubleClick: () => !this.#look.locked && this.#tool.doubleClick(),
        onHover: (at, by) => {
          this.#aimed ||= by === "keys" && at !== null;
          this.#tool.hover(at, by);
        },
        onChoosePoint: (id) => {
          this.#isGone = this.#watchReplaced();
          if (corners.owns(id)) corners.choose(id);
        },
        onClickPoint: (id) => ring.owns(id) && ring.clicked(id),
        onMovePoint: (id, to, phase) => {
          if (this.#isGone()) return;
          if (ring.owns(id)) ring.moved(id, to);
          else if (corners.owns(id)) corners.move(id, to, phase);
        },
        onStepPoint: (id, to) => corners.owns(id) && corners.step(id, to),
        onView: (view) => {
          this.#zoom = view.zoom;
          this.#paint();
          host.onView(view);
        },
      },
      { loupe: "fingers" },
    );
    this.#watch();
  }

  stop() {
    this.corners.settle();
    this.#stopped = true;
    this.#stopWatching();
    this.#pane.stop();
  }

  /** @param {string} address of the image */
  show(address) {
    return this.#pane.show(address);
  }

  /** The whole image; where that is seen already, as much of it as fills the pane. */
  fit() {
    if (this.#pane.fits) this.#pane.fill();
    else this.#pane.fit();
  }

  get light() {
    return this.#pane.light;
  }

  set light(light) {
    this.#pane.light = light;
  }

  /** Draw this from now on. @param {MaskSheet} sheet @param {Look} look */
  work(sheet, look) {
    this.#look = look;
    if (sheet !== this.#sheet) {
      this.corners.settle();
      this.corners.forget();
      this.smart.finish();
      this.#sheet = sheet;
      this.#watch();
    }
    this.#paint();
  }

  /** Back out one step. @returns {boolean} whether there was one */
  cancel() {
    return this.#tool.cancel() || this.ring.drop() || this.corners.release();
  }

  /** Take back the last mark of what is not finished, else the last step. @returns {boolean} whether there was one */
  undo() {
    if (this.#look.locked) return false;
    this.corners.settle();
    if (this.ring.back() || this.ring.restore()) return true;
    if (!this.#sheet.canUndo.peek()) return false;
    this.smart.finish();
    this.corners.release();
    this.#host.onSay(`Undone: ${this.#sheet.undoes.peek()}.`);
    this.#sheet.undo();
    return true;
  }

  /** @returns {boolean} */
  redo() {
    if (this.#look.locked || !this.#sheet.canRedo.peek()) return false;
    this.smart.finish();
    this.corners.forget();
    this.#host.onSay(`Done again: ${this.#sheet.redoes.peek()}.`);
    this.#sheet.redo();
    return true;
  }

  /**
   * A key that was pressed in the pane; arrows, Enter and zoom it takes itself. But for Delete, where nothing is chosen,
   * what takes back or moves something is never the page's.
   * @param {KeyboardEvent} event
   * @returns {boolean} whether it stood for something
   */
  key(event) {
    const { key } = event;
    const edits = ["Backspace", "PageUp", "PageDown", "Insert"].includes(key);
    if (this.#look.locked || event.altKey) return edits;
    if (event.ctrlKey || event.metaKey) {
      if (key.toLowerCase() === "z") return event.shiftKey ? this.redo() : this.undo();
      return key.toLowerCase() === "y" && this.redo();
    }
    const { showsCorners } = this.#tool;
    if (key === "Backspace" || key === "Delete") {
      const isDone = this.ring.back() || (showsCorners && (event.shiftKey ? this.corners.removeRing() : this.corners.remove()));
      return isDone || edits;
    }
    if (showsCorners && (key === "PageDown" || key === "PageUp")) this.corners.walk(key === "PageDown" ? 1 : -1);
    else if (showsCorners && key === "Insert") this.corners.insert();
    return edits;
  }

  get #tool() {
    return this.#tools[this.#host.tool.peek()];
  }

  /** @returns {() => boolean} whether what was on the sheet is another's by then, or the sheet is another */
  #watchReplaced() {
    const sheet = this.#sheet;
    const replaced = sheet.replaced.peek();
    return () => sheet !== this.#sheet || replaced !== sheet.replaced.peek();
  }

  /** @param {Place} at @param {PointerEvent} event @returns {import("./pane_gestures.js").Drag | null} */
  #press(at, event) {
    if (this.#look.locked) return null;
    this.#begin();
    const isGone = this.#watchReplaced();
    const drag = this.#tool.press(at, event);
    if (drag === null) return null;
    return {
      move: (to) => (isGone() ? drag.cancel() : drag.move(to)),
      end: (to) => (isGone() ? drag.cancel() : drag.end(to)),
      cancel: () => drag.cancel(),
    };
  }

  /** @param {Place} at @param {import("./image_pane.js").Modifiers} event */
  #click(at, event) {
    if (this.#look.locked) return;
    this.#host.onFailure(null);
    if (!(event instanceof KeyboardEvent)) this.#aimed = false;
    this.#tool.click(at, event);
  }

  /** Before something is drawn. */
  #begin() {
    this.#aimed = false;
    this.corners.settle();
    this.#host.onFailure(null);
  }

  /** Paint anew whenever something changes that is seen. */
  #watch() {
    this.#stopWatching();
    const sheet = this.#sheet;
    const { tool, brush, operation } = this.#host;
    let last = tool.peek();
    let replaced = sheet.replaced.peek();
    this.#stopWatching = effect(() => {
      void [sheet.polygons.value, sheet.open.value, brush.value, operation.value, this.corners.chosen.value];
      void [this.smart.marks.value, this.smart.chosen.value];
      if (last !== tool.value) {
        this.#tools[last].cancel();
        if (!this.#tool.showsCorners) this.corners.release();
        last = tool.value;
      }
      if (replaced !== sheet.replaced.value) {
        replaced = sheet.replaced.value;
        this.corners.forget();
        this.smart.finish();
      }
      this.#paint();
    });
  }

  /**
   * @param {Shape} shape @param {Operation} operation @param {string} step
   * @returns {Promise<boolean>} whether it was done
   */
  #combine(shape, operation, step) {
    const sheet = this.#sheet;
    const pending = { sheet, shape, operation };
    this.#pending.add(pending);
    this.busy.value = true;
    this.#paint();
    const before = this.#queues.get(sheet) ?? Promise.resolve();
    const done = before.then(() => this.#join(sheet, shape, operation, step)).finally(() => {
      this.#pending.delete(pending);
      this.busy.value = this.#pending.size > 0;
      this.#paint();
    });
    this.#queues.set(sheet, done);
    return done;
  }

  /** @param {MaskSheet} sheet @param {Shape} shape @param {Operation} operation @param {string} step */
  async #join(sheet, shape, operation, step) {
    for (;;) {
      const base = operation === "new" ? [] : sheet.settled;
      if (operation === "subtract" && base.length === 0) {
        this.#host.onFailure("There is nothing to cut out of yet: outline the object first.");
        return true;
      }
      try {
        // A first outline stays as it was drawn, corner by corner.
        const result = base.length === 0 && "polygon" in shape ? [shape.polygon] : await this.#host.combine(base, shape, operation === "subtract" ? "subtract" : "add");
        // Another step may have come meanwhile, of somebody else's or by undo: then on top of that.
        if (operation !== "new" && sheet.settled !== base) continue;
        this.#host.onFailure(null);
        sheet.set(result, step);
        if (operation === "new") this.#host.onNew();
        return true;
      } catch (error) {
        this.#host.onFailure(`This was not drawn: ${/** @type {Error} */ (error).message}`);
        return false;
      }
    }
  }

  #paint() {
    if (this.#stopped) return;
    const { color, guidance, locked } = this.#look;
    const tool = this.#tool;
    const polygons = this.#sheet.polygons.peek();
    /** @type {import("./mask_tools/tool.js").Shown} */
    const own = locked ? {} : tool.overlay();
    const pending = [...this.#pending].filter(({ sheet }) => sheet === this.#sheet);
    /** @type {import("./mask_tools/tool.js").Shown} */
    const ring = locked || own.lines !== undefined || this.ring.corners === null ? {} : this.ring.overlay(false);
    this.#pane.brush = locked ? null : tool.cursor;
    this.#pane.overlay = {
      regions: [
        ...guidance.map((one) => guidanceRegion(one)),
        ...(polygons.length > 0 ? [{ rings: allRings(polygons), color, fill: FILL }] : []),
        ...pending.flatMap(({ shape, operation }) =>
          "polygon" in shape ? [{ rings: [shape.polygon.outer], color: colorOf(operation, color), fill: FILL }] : [],
        ),
        ...(own.regions ?? []),
      ],
      strokes: [
        ...pending.flatMap(({ shape, operation }) => ("stroke" in shape ? [{ ...shape.stroke, color: colorOf(operation, color), opacity: 0.5 }] : [])),
        ...(own.strokes ?? []),
      ],
      lines: [...(own.lines ?? []), ...(ring.lines ?? [])],
      points: [...(tool.showsCorners && !locked ? this.corners.points() : []), ...(own.points ?? []), ...(ring.points ?? [])],
    };
  }
}

/** @param {Look["guidance"][number]} guidance @returns {import("./pane_painting.js").Region} */
function guidanceRegion({ polygons, kind }) {
  const rings = allRings(polygons);
  return kind === "band"
    ? { rings, color: BAND, fill: 0.1, width: 1.5, dash: [8, 6], inside: true }
    : { rings, color: HULL, fill: 0.06, width: 1, inside: true };
}
