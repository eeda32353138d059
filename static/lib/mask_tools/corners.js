/** The corners of a mask's rings: shown as far as there is room, chosen, moved, put between others, removed. */

import { away, cornerAt, cornerOf, nearestEdge, ringsOf, spotsOf, withInserted, withMoved, withoutCorner, withoutRing } from "../rings.js";
import { signal } from "../view.js";

/** @typedef {import("../rings.js").Spot} Spot */
/** @typedef {import("./tool.js").Place} Place */

const ID = "corner:";
const REACH = 9;
/** How near an edge a press puts a corner on it, CSS pixels. */
export const REACH_EDGE = 6;
/** CSS pixels between handles: where corners are nearer, some are shown only once they are magnified. */
const ROOM = 12;
/** Milliseconds after which steps by keys are one step. */
const SETTLED = 500;

export class Corners {
  #board;
  /** What arrow keys move and Delete removes. */
  chosen = signal(/** @type {Spot | null} */ (null));
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #settling;

  /** @param {import("./tool.js").Board} board */
  constructor(board) {
    this.#board = board;
  }

  /** @param {string} id of a point that the pane shows */
  owns(id) {
    return id.startsWith(ID);
  }

  /** @param {string} id */
  choose(id) {
    this.settle();
    this.chosen.value = spotOf(id);
  }

  /** Choose none. @returns {boolean} whether one was */
  release() {
    this.settle();
    const had = this.chosen.peek() !== null;
    this.chosen.value = null;
    return had;
  }

  /** @param {string} id @param {Place} to @param {"move" | "end" | "cancel"} phase */
  move(id, to, phase) {
    const { sheet } = this.#board;
    if (phase === "cancel") return sheet.revert();
    const next = withMoved(sheet.polygons.peek(), spotOf(id), cornerAt(to));
    if (phase === "move") sheet.preview(next);
    else sheet.set(next, "move point");
  }

  /** By keys: several of them in a row are one step. @param {string} id @param {Place} to */
  step(id, to) {
    const { sheet } = this.#board;
    sheet.preview(withMoved(sheet.polygons.peek(), spotOf(id), cornerAt(to)));
    clearTimeout(this.#settling);
    this.#settling = setTimeout(() => this.settle(), SETTLED);
  }

  /** Make a step of what keys moved. */
  settle() {
    if (this.#settling === undefined) return;
    clearTimeout(this.#settling);
    this.#settling = undefined;
    const { sheet } = this.#board;
    sheet.set(sheet.polygons.peek(), "move point");
  }

  /** Forget what keys moved: it was replaced. */
  forget() {
    clearTimeout(this.#settling);
    this.#settling = undefined;
    this.chosen.value = null;
  }

  /** A press on an edge puts a corner there, and drags it. @param {Place} at @returns {import("./tool.js").Drag | null} */
  press(at) {
    const { sheet, zoom } = this.#board;
    this.settle();
    const before = sheet.polygons.peek();
    const found = nearestEdge(before, at, REACH_EDGE / zoom);
    if (found === null) return null;
    const { spot } = found;
    this.chosen.value = spot;
    sheet.preview(withInserted(before, spot, found.at));
    return {
      move: (to) => sheet.preview(withInserted(before, spot, cornerAt(to))),
      // Where it was only clicked, the corner lies on the edge, not beside it.
      end: (to) => sheet.set(withInserted(before, spot, away(cornerAt(to), cornerAt(at)) * zoom < 3 ? found.at : cornerAt(to)), "add point"),
      cancel: () => {
        sheet.revert();
        this.chosen.value = null;
      },
    };
  }

  /** @returns {boolean} whether there was one to remove */
  remove() {
    this.settle();
    const spot = this.chosen.peek();
    const { sheet } = this.#board;
    if (spot === null) return false;
    const before = sheet.polygons.peek();
    const left = ringsOf(before[spot.polygon])[spot.ring].length - 1;
    const next = withoutCorner(before, spot);
    this.chosen.value = left < 3 ? null : { ...spot, corner: (spot.corner + left - 1) % left };
    sheet.set(next, left < 3 ? "remove piece" : "remove point");
    this.#board.say(left < 3 ? "Piece removed." : `Point removed, ${left} left.`);
    return true;
  }

  /** The whole ring of the chosen corner. @returns {boolean} */
  removeRing() {
    this.settle();
    const spot = this.chosen.peek();
    const { sheet } = this.#board;
    if (spot === null) return false;
    this.chosen.value = null;
    sheet.set(withoutRing(sheet.polygons.peek(), spot), spot.ring > 0 ? "fill hole" : "remove piece");
    return true;
  }

  /** A corner halfway to the next one, which is then chosen. @returns {boolean} */
  insert() {
    this.settle();
    const spot = this.chosen.peek();
    const { sheet } = this.#board;
    if (spot === null) return false;
    const ring = ringsOf(sheet.polygons.peek()[spot.polygon])[spot.ring];
    const [a, b] = [ring[spot.corner], ring[(spot.corner + 1) % ring.length]];
    const next = { ...spot, corner: spot.corner + 1 };
    sheet.set(withInserted(sheet.polygons.peek(), next, cornerAt({ x: (a[0] + b[0]) / 2, y: (a[1] + b[1]) / 2 })), "add point");
    this.chosen.value = next;
    this.#tell(next);
    return true;
  }

  /** To the next corner, or the one before. @param {1 | -1} by @returns {boolean} */
  walk(by) {
    this.settle();
    const all = spotsOf(this.#board.sheet.polygons.peek());
    if (all.length === 0) return false;
    const now = this.chosen.peek();
    const at = now === null ? -1 : all.findIndex((spot) => idOf(spot) === idOf(now));
    const next = all[(at + by + (at < 0 && by < 0 ? 1 : 0) + all.length) % all.length];
    this.chosen.value = next;
    this.#tell(next);
    return true;
  }

  /** @param {Spot} spot */
  #tell(spot) {
    const polygons = this.#board.sheet.polygons.peek();
    const corner = cornerOf(polygons, spot);
    if (corner === undefined) return;
    const count = ringsOf(polygons[spot.polygon])[spot.ring].length;
    this.#board.say(`Point ${spot.corner + 1} of ${count}${spot.ring > 0 ? " of a hole" : ""}, at ${corner.map((value) => value.toFixed(1)).join(", ")}.`);
  }

  /** @returns {import("../image_pane.js").Point[]} */
  points() {
    const { sheet, zoom, color } = this.#board;
    const polygons = sheet.polygons.peek();
    const chosen = this.chosen.peek();
    const active = chosen === null ? "" : idOf(chosen);
    return polygons.flatMap((one, polygon) =>
      ringsOf(one).flatMap((ring, r) => {
        /** @type {import("../rings.js").Corner | null} */
        let last = null;
        return ring.flatMap((at, corner) => {
          const id = idOf({ polygon, ring: r, corner });
          const crowded = last !== null && away(last, at) * zoom < ROOM;
          if (crowded && id !== active) return [];
          last = at;
          return [{ id, x: at[0], y: at[1], color, shape: /** @type {const} */ ("handle"), active: id === active, reach: REACH }];
        });
      }),
    );
  }

  /** Where a press would put a corner. @param {Place | null} pointer @returns {import("../image_pane.js").Point[]} */
  ghost(pointer) {
    const { sheet, zoom, color } = this.#board;
    const found = pointer === null ? null : nearestEdge(sheet.polygons.peek(), pointer, REACH_EDGE / zoom);
    if (found === null) return [];
    const near = this.points().some(({ x, y }) => away([x, y], found.at) * zoom < REACH);
    return near ? [] : [{ id: "ghost", x: found.at[0], y: found.at[1], color, shape: "ghost", reach: -1 }];
  }
}

/** @param {Spot} spot */
const idOf = ({ polygon, ring, corner }) => `${ID}${polygon}:${ring}:${corner}`;

/** @param {string} id @returns {Spot} */
function spotOf(id) {
  const [polygon, ring, corner] = id.slice(ID.length).split(":").map(Number);
  return { polygon, ring, corner };
}
