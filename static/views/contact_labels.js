/** How all boxes are drawn in many frames, asked for in batches and kept until a box changes. */

import { signal } from "../lib/view.js";
import { actions, shownBoxes } from "../store.js";

/** What the API takes at once. */
const BOXES_AT_ONCE = 50;
const FRAMES_AT_ONCE = 100;

/** @typedef {{boxId: number, classId: number, wireframe: readonly (readonly (readonly [number, number])[])[], inImage: boolean}} Drawn */

/**
 * The boxes of a session as frames show them. Answers of an older state stay to be drawn until the new ones are there,
 * so that nothing flickers while a box is dragged.
 */
export class ContactLabels {
  /** By frame. @type {Map<number, {of: string, drawn: Drawn[]}>} */
  #known = new Map();
  /** One more with each answer: who draws reads it. */
  version = signal(0);
  /** Why labels could not be had; null: they could. */
  problem = signal(/** @type {string | null} */ (null));
  /** @type {readonly number[]} in the order in which they are wanted */
  #wanted = [];
  #asking = false;

  /** What the answers depend on: a change of it makes them stale. */
  get #state() {
    return JSON.stringify([...shownBoxes.peek().values()].map(({ id, class_id, T_world_box, size }) => [id, class_id, T_world_box, size]));
  }

  /** @param {number} frame @returns {readonly Drawn[] | null} null: not asked yet */
  of(frame) {
    return this.#known.get(frame)?.drawn ?? null;
  }

  /** How many of these have no answer of the boxes as they are now. @param {readonly number[]} frames */
  countMissing(frames) {
    const state = this.#state;
    return frames.reduce((sum, frame) => sum + (this.#known.get(frame)?.of === state ? 0 : 1), 0);
  }

  /**
   * Ask for what of these is missing or stale; what was wanted before and has not been asked for is dropped.
   * @param {readonly number[]} frames the most wanted first
   */
  want(frames) {
    this.#wanted = frames;
    if (!this.#asking) void this.#ask();
  }

  async #ask() {
    this.#asking = true;
    for (;;) {
      const state = this.#state;
      const missing = this.#wanted.filter((frame) => this.#known.get(frame)?.of !== state).slice(0, FRAMES_AT_ONCE);
      if (missing.length === 0) break;
      try {
        await this.#fetch(missing, state);
        this.problem.value = null;
      } catch (error) {
        this.problem.value = error instanceof Error ? error.message : String(error);
        break;
      }
      this.version.value += 1;
    }
    this.#asking = false;
  }

  /** @param {readonly number[]} frames @param {string} state */
  async #fetch(frames, state) {
    const boxes = [...shownBoxes.peek().values()];
    /** @type {Map<number, Drawn[]>} */
    const found = new Map(frames.map((frame) => [frame, []]));
    for (let i = 0; i < boxes.length; i += BOXES_AT_ONCE) {
      const some = boxes.slice(i, i + BOXES_AT_ONCE);
      const places = some.map(({ T_world_box, size }) => ({ T_world_box, size }));
      for (const { frame, labels } of await actions.labelsOf(places, [...frames])) {
        labels.forEach(({ bbox, wireframe }, j) =>
          found.get(frame)?.push({ boxId: some[j].id, classId: some[j].class_id, wireframe, inImage: bbox !== null }),
        );
      }
    }
    for (const [frame, drawn] of found) this.#known.set(frame, { of: state, drawn });
  }
}
