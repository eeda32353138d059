/**
 * The machine outlines: a rough box round the object is dragged, or marks are drawn on it and, with Shift, beside it. What it
 * finds is the mask at once; more marks mend it, another box begins again. Done with Enter or Escape, or by drawing on.
 */

import { away, cornerAt } from "../rings.js";
import { signal } from "../view.js";
import { boundsOf, isLarge, ringOf } from "./rectangle_tool.js";
import { CUT, MaskTool } from "./tool.js";

/** @typedef {import("./tool.js").Corner} Corner */
/** @typedef {import("./tool.js").Place} Place */
/** @typedef {"box" | "inside" | "outside"} Marking */
/** @typedef {{rectangle?: [number, number, number, number], inside?: Corner[][], outside?: Corner[][], brush_width?: number, start?: import("./tool.js").Polygon[]}} Prompt */
/**
 * What is known of the object so far.
 * @typedef {object} Marks
 * @property {[number, number, number, number] | null} rectangle
 * @property {readonly Corner[][]} inside
 * @property {readonly Corner[][]} outside
 */

/** CSS pixels from one point of a mark to the next, at least. */
const STEP = 2;
/** Marks are at most so wide, image pixels: a brush for painting may be far wider. */
const MOST_WIDTH = 12;
const BOX = "#4aa8ff";
const INSIDE = "#56d364";
const OUTSIDE = CUT;
/** @type {Marks} */
const NOTHING = { rectangle: null, inside: [], outside: [] };

export class SmartTool extends MaskTool {
  /** What the next drag is; null: what is wanting. */
  chosen = signal(/** @type {Marking | null} */ (null));
  marks = signal(NOTHING);
  busy = signal(false);
  /** What the marks began with, and whether what is found joins it. @type {{polygons: import("./tool.js").Polygons, operation: import("./tool.js").Operation} | null} */
  #begun = null;
  /** @type {{kind: Marking, points: Corner[], byKeys?: boolean} | null} */
  #drawn = null;
  /** Whether marks came while the machine was busy. */
  #again = false;
  /** Grows when marks are forgotten: what is found for them then comes too late. */
  #turn = 0;

  /** What the next drag is. @returns {Marking} */
  get marking() {
    return this.chosen.value ?? (this.#isBegun(this.marks.value) || this.board.sheet.polygons.value.length > 0 ? "inside" : "box");
  }

  /** @param {Marks} marks */
  #isBegun({ rectangle, inside, outside }) {
    return rectangle !== null || inside.length > 0 || outside.length > 0;
  }

  get #width() {
    return Math.min(MOST_WIDTH, this.board.brush);
  }

  get cursor() {
    return this.marking === "box" ? null : { diameter: this.#width, color: this.marking === "inside" ? INSIDE : OUTSIDE };
  }

  /** @param {Place} at @param {import("./tool.js").Modifiers} event @returns {import("./tool.js").Drag} */
  press(at, event) {
    const kind = event.shiftKey ? "outside" : this.marking;
    this.#drawn = { kind, points: [cornerAt(at)] };
    this.board.repaint();
    return { move: (to) => this.#stretch(to), end: () => this.#finish(event), cancel: () => this.#forget() };
  }

  /** By keys; where they aim at nothing, the outline is kept as it is. @param {Place} at @param {import("./tool.js").Modifiers} event */
  click(at, event) {
    if (!this.board.aimed) {
      if (!this.finish()) this.board.say("Move the crosshair with the arrows, then press Enter.");
      return;
    }
    if (this.#drawn?.byKeys) {
      this.#stretch(at);
      return this.#finish(event);
    }
    this.#drawn = { kind: event.shiftKey ? "outside" : this.marking, points: [cornerAt(at)], byKeys: true };
    if (this.#drawn.kind !== "box") this.#finish(event);
    else this.board.say("First corner. Move on and press Enter for the other.");
  }

  /** @param {Place | null} at */
  hover(at) {
    if (at !== null && this.#drawn?.byKeys) this.#stretch(at);
  }

  /** @param {Place} to */
  #stretch(to) {
    if (this.#drawn === null) return;
    const { kind, points } = this.#drawn;
    const corner = cornerAt(to);
    if (kind === "box") points[1] = corner;
    else if (away(points[points.length - 1], corner) * this.board.zoom >= STEP) points.push(corner);
    this.board.repaint();
  }

  /** @param {import("./tool.js").Modifiers} event */
  #finish(event) {
    if (this.#drawn === null) return;
    const { kind, points } = this.#drawn;
    this.#forget();
    const { sheet, zoom } = this.board;
    const before = this.marks.peek();
    if (kind === "box") {
      const bounds = points.length < 2 ? null : boundsOf(placeOf(points[0]), placeOf(points[1]));
      if (bounds === null || !isLarge(bounds, zoom)) return;
      this.#begun ??= { polygons: sheet.settled, operation: this.board.operation(event) };
      this.marks.value = { ...NOTHING, rectangle: bounds };
      this.chosen.value = null;
    } else {
      this.#begun ??= { polygons: sheet.settled, operation: "new" };
      this.marks.value = { ...before, [kind]: [...before[kind], points] };
    }
    void this.#ask();
  }

  async #ask() {
    if (this.busy.peek()) {
      this.#again = true;
      return;
    }
    this.busy.value = true;
    try {
      do {
        this.#again = false;
        await this.#find();
      } while (this.#again);
    } finally {
      this.busy.value = false;
    }
  }

  async #find() {
    const { board } = this;
    const { sheet } = board;
    const { rectangle, inside, outside } = this.marks.peek();
    const begun = this.#begun;
    const turn = this.#turn;
    if (begun === null) return;
    /** @type {Prompt} */
    const prompt = { inside: [...inside], outside: [...outside], brush_width: this.#width };
    if (rectangle !== null) prompt.rectangle = rectangle;
    else if (begun.polygons.length > 0) prompt.start = [...begun.polygons];
    board.fail(null);
    board.say("Finding the outline.");
    try {
      const found = await board.segment(prompt);
      if (turn !== this.#turn || this.#again) return;
      if (found.length === 0) return board.fail("Nothing was found: draw the box closer round the object, or mark a part of it as inside.");
      const joins = rectangle !== null && begun.operation !== "new" && begun.polygons.length > 0;
      const result = joins ? await board.joined(sheet, begun.polygons, found, begun.operation === "subtract" ? "subtract" : "add") : found;
      if (turn !== this.#turn || this.#again) return;
      sheet.set(result, "smart outline", "smart");
      board.say(`Outline found. Mark what is missing, or with Shift what is too much.`);
    } catch (error) {
      if (turn === this.#turn) board.fail(/** @type {Error} */ (error).message);
    }
  }

  #forget() {
    this.#drawn = null;
    this.board.repaint();
  }

  /** Done with this outline: it stays as it is, and the next drag begins another. @returns {boolean} whether there was one */
  finish() {
    const had = this.#begun !== null;
    this.#begun = null;
    this.#turn += 1;
    this.marks.value = NOTHING;
    this.chosen.value = null;
    this.#forget();
    return had;
  }

  cancel() {
    if (this.#drawn === null) return this.finish();
    this.#forget();
    return true;
  }

  /** @returns {import("./tool.js").Shown} */
  overlay() {
    const drawn = this.#drawn;
    const { rectangle, inside, outside } = this.marks.peek();
    const box = drawn?.kind === "box" && drawn.points.length > 1 ? boundsOf(placeOf(drawn.points[0]), placeOf(drawn.points[1])) : rectangle;
    const width = this.#width;
    /** @param {Marking} kind @param {readonly Corner[][]} marks @param {string} color */
    const strokes = (kind, marks, color) =>
      [...marks, ...(drawn?.kind === kind ? [drawn.points] : [])].map((points) => ({ points, width, color, opacity: 0.55 }));
    return {
      regions: box === null ? [] : [{ rings: [ringOf(box)], color: BOX, width: 1.5, dash: [6, 4] }],
      strokes: [...strokes("inside", inside, INSIDE), ...strokes("outside", outside, OUTSIDE)],
    };
  }
}

/** @param {Corner} corner @returns {Place} */
const placeOf = ([x, y]) => ({ x, y });
