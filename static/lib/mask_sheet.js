/** One object's mask in one image while it is drawn: its polygons, the ring that is open, and the steps back and forth. */

import { batch, computed, signal } from "./view.js";
import { LEAST, polygonOf, same } from "./rings.js";

/** @typedef {import("./rings.js").Polygon} Polygon */
/** @typedef {import("./rings.js").Polygons} Polygons */
/** @typedef {import("./rings.js").Corner} Corner */
/** Who made it. @typedef {"drawn" | "smart" | "proposed"} Origin */
/** What a shape does to a mask: it takes its place, joins it, or is cut out of it. @typedef {"new" | "add" | "subtract"} Operation */
/** @typedef {{polygons: Polygons, origin: Origin, step: string}} Step */

/** Steps that can be taken back. */
const MOST_STEPS = 200;

export class MaskSheet {
  /** As it is seen, also in the midst of a drag. */
  polygons = signal(/** @type {Polygons} */ ([]));
  /** A ring that is being drawn. */
  open = signal(/** @type {readonly Corner[] | null} */ (null));
  /** Whether somebody drew what nobody has said is stored. */
  dirty = signal(false);
  /** Grows whenever what was drawn is replaced from elsewhere, so that nobody goes on with what is gone. */
  replaced = signal(0);
  /** States to go back to, the last of them first to be taken, each with the step that led from it. */
  #past = signal(/** @type {readonly Step[]} */ ([]));
  #future = signal(/** @type {readonly Step[]} */ ([]));
  canUndo = computed(() => this.#past.value.length > 0);
  canRedo = computed(() => this.#future.value.length > 0);
  /** What undo takes back, and redo does again, in words. */
  undoes = computed(() => this.#past.value.at(-1)?.step ?? null);
  redoes = computed(() => this.#future.value.at(-1)?.step ?? null);
  /** @type {Origin} */
  #origin = "drawn";
  /** @type {Operation} */
  #operation = "add";
  /** Before the drag that is under way. @type {Polygons | null} */
  #before = null;
  #tell;

  /** @param {(polygons: Polygons, phase: "live" | "done") => void} tell */
  constructor(tell) {
    this.#tell = tell;
  }

  /** Who made what is there now. */
  get origin() {
    return this.#origin;
  }

  /** The polygons without what is only being dragged. @returns {Polygons} */
  get settled() {
    return this.#before ?? this.polygons.peek();
  }

  /** One step. @param {Polygons} polygons @param {string} step in words @param {Origin} [origin] */
  set(polygons, step, origin = "drawn") {
    batch(() => {
      const before = { polygons: this.settled, origin: this.#origin, step };
      this.#past.value = [...this.#past.peek(), before].slice(-MOST_STEPS);
      this.#future.value = [];
      this.#put(polygons, origin);
    });
  }

  /** In the midst of a step: shown, and no step yet. @param {Polygons} polygons */
  preview(polygons) {
    this.#before ??= this.polygons.peek();
    this.polygons.value = polygons;
    this.#tell(polygons, "live");
  }

  /** As it was before what was previewed. */
  revert() {
    if (this.#before === null) return;
    const before = this.#before;
    this.#before = null;
    this.polygons.value = before;
    this.#tell(before, "live");
  }

  /** @param {readonly Corner[] | null} ring that is being drawn @param {Operation} [operation] what is to be done with it; as before */
  draw(ring, operation = this.#operation) {
    this.#operation = operation;
    this.open.value = ring;
    if (ring === null || ring.length < LEAST || operation === "subtract") return;
    this.#tell([...(operation === "new" ? [] : this.polygons.peek()), polygonOf(ring)], "live");
  }

  /** What is to be done with the open ring. */
  get operation() {
    return this.#operation;
  }

  undo() {
    this.revert();
    const back = this.#past.peek().at(-1);
    if (back === undefined) return;
    batch(() => {
      this.#future.value = [...this.#future.peek(), { polygons: this.polygons.peek(), origin: this.#origin, step: back.step }];
      this.#past.value = this.#past.peek().slice(0, -1);
      this.#put(back.polygons, back.origin);
    });
  }

  redo() {
    this.revert();
    const forth = this.#future.peek().at(-1);
    if (forth === undefined) return;
    batch(() => {
      this.#past.value = [...this.#past.peek(), { polygons: this.polygons.peek(), origin: this.#origin, step: forth.step }];
      this.#future.value = this.#future.peek().slice(0, -1);
      this.#put(forth.polygons, forth.origin);
    });
  }

  /** Told from elsewhere: what is stored now. Steps back would bring back what others changed, so there are none. @param {Polygons} polygons */
  replace(polygons) {
    batch(() => {
      this.dirty.value = false;
      if (same(polygons, this.settled)) return;
      this.#before = null;
      this.#past.value = [];
      this.#future.value = [];
      this.#origin = "drawn";
      this.polygons.value = polygons;
      this.replaced.value = this.replaced.peek() + 1;
    });
  }

  /** @param {Polygons} polygons @param {Origin} origin */
  #put(polygons, origin) {
    this.#before = null;
    this.#origin = origin;
    this.polygons.value = polygons;
    this.dirty.value = true;
    this.#tell(polygons, "done");
  }
}
