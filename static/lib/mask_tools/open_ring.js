/** The ring that is being drawn corner by corner: grown, taken back, closed, given up. */

import { LEAST, away, cornerAt, polygonOf } from "../rings.js";
import { colorOf } from "./tool.js";

/** @typedef {import("./tool.js").Corner} Corner */
/** @typedef {import("./tool.js").Place} Place */
/** @typedef {import("./tool.js").Operation} Operation */

const ID = "open:";
/** How near a press means a corner of it, CSS pixels: the first, which closes it, more than the others. */
const REACH_FIRST = 10;
const REACH = 5;

export class OpenRing {
  #board;
  /** To which the ring is drawn out. @type {Place | null} */
  #pointer = null;
  /** Whether arrow keys moved it since the last corner. */
  #aimed = false;
  /** Given up last: it can be had back. @type {{sheet: object, ring: readonly Corner[], operation: Operation} | null} */
  #dropped = null;

  /** @param {import("./tool.js").Board} board */
  constructor(board) {
    this.#board = board;
  }

  get #sheet() {
    return this.#board.sheet;
  }

  get corners() {
    return this.#sheet.open.peek();
  }

  /** @param {Place | null} at @param {"pointer" | "finger" | "keys"} by */
  hover(at, by) {
    this.#pointer = at;
    // A pointer that only passes by changes nothing of where Enter goes.
    this.#aimed ||= by === "keys" && at !== null;
    this.#board.repaint();
  }

  /** Enter closes, unless arrow keys have gone on to another place. @param {Place} at @param {import("./tool.js").Modifiers} event */
  click(at, event) {
    if (event instanceof KeyboardEvent && !this.#aimed && this.corners !== null) void this.close();
    else this.add(at, this.#board.operation(event));
    this.#aimed = false;
  }

  /** @param {Place} at @param {Operation} operation for a ring that begins here */
  add(at, operation) {
    const corner = cornerAt(at);
    const ring = this.corners;
    this.#dropped = null;
    if (ring === null) return this.#sheet.draw([corner], operation);
    if (away(ring[ring.length - 1], corner) > 0) this.#sheet.draw([...ring, corner]);
  }

  /** @returns {Promise<void>} once it is part of the mask, or open again, where that could not be */
  async close() {
    const ring = this.corners;
    if (ring === null) return;
    if (ring.length < LEAST) return this.#board.say(`An outline needs ${LEAST} points, this one has ${ring.length}.`);
    const sheet = this.#sheet;
    const { operation } = sheet;
    sheet.draw(null);
    const done = await this.#board.combine({ polygon: polygonOf(ring) }, operation, operation === "subtract" ? "cut out" : "polygon");
    if (!done && sheet.open.peek() === null) sheet.draw(ring, operation);
  }

  /** Take the last corner back. @returns {boolean} */
  back() {
    const ring = this.corners;
    if (ring === null) return false;
    this.#sheet.draw(ring.length > 1 ? ring.slice(0, -1) : null);
    return true;
  }

  /** @returns {boolean} */
  drop() {
    const ring = this.corners;
    if (ring === null) return false;
    this.#dropped = { sheet: this.#sheet, ring, operation: this.#sheet.operation };
    this.#sheet.draw(null);
    this.#board.say("Outline given up. Undo brings it back.");
    return true;
  }

  /** What was given up, again. @returns {boolean} whether there was such a thing */
  restore() {
    if (this.#dropped?.sheet !== this.#sheet || this.corners !== null) return false;
    this.#sheet.draw(this.#dropped.ring, this.#dropped.operation);
    this.#dropped = null;
    return true;
  }

  /** @param {string} id of a point that the pane shows */
  owns(id) {
    return id.startsWith(ID);
  }

  /** @param {string} id */
  clicked(id) {
    if (id === `${ID}0` && (this.corners?.length ?? 0) >= LEAST) void this.close();
  }

  /** @param {string} id @param {Place} to */
  moved(id, to) {
    const which = Number(id.slice(ID.length));
    if (this.corners !== null) this.#sheet.draw(this.corners.map((corner, i) => (i === which ? cornerAt(to) : corner)));
  }

  /** @param {boolean} grows the next click adds to it @returns {import("./tool.js").Shown} */
  overlay(grows) {
    const pointer = grows ? this.#pointer : null;
    const ring = this.corners;
    if (ring === null) return {};
    const color = colorOf(this.#sheet.operation, this.#board.color);
    /** @type {Corner[]} */
    const ahead = pointer === null ? [] : [ring[ring.length - 1], [pointer.x, pointer.y]];
    return {
      lines: [
        ...(ring.length > 1 ? [{ points: ring, color, width: 2 }] : []),
        ...(ahead.length > 0 ? [{ points: ahead, color, width: 1.5, dash: [4, 4] }] : []),
      ],
      points: ring.map(([x, y], i) => {
        const closes = i === 0 && ring.length >= LEAST;
        return { id: `${ID}${i}`, x, y, color, shape: closes ? "target" : "handle", reach: closes ? REACH_FIRST : REACH };
      }),
    };
  }
}
