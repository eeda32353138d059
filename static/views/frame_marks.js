/** How objects would be exported, frame by frame, as the server draws them: asked for only of frames in sight. */

import { signal } from "../lib/view.js";
import { actions, markFunction, markShape, revision } from "../store.js";

/** @typedef {import("../store.js").Schemas["MarkJson"]} Mark */

/** Questions under way at a time. */
const AT_ONCE = 3;

/**
 * The marks of a session's frames. Those of an older state stay to be drawn until the new ones are there, so that nothing
 * flickers; those of another way to draw do not.
 */
export class FrameMarks {
  /** By frame. @type {Map<number, {way: string, of: string, marks: readonly Mark[]}>} */
  #known = new Map();
  /** @type {Map<number, {of: string, stop: AbortController}>} */
  #going = new Map();
  /** @type {readonly number[]} in the order in which they are wanted */
  #wanted = [];
  /** One more with each answer: who draws reads it. */
  version = signal(0);
  /** Why marks could not be had; null: they could. */
  problem = signal(/** @type {string | null} */ (null));

  get #way() {
    return `${markFunction.peek()} ${markShape.peek()}`;
  }

  /** What the answers depend on. */
  get #state() {
    return `${this.#way} ${revision.peek()}`;
  }

  /** @param {number} frame @returns {readonly Mark[] | null} null: not there yet */
  of(frame) {
    const found = this.#known.get(frame);
    return found !== undefined && found.way === this.#way ? found.marks : null;
  }

  /** Ask for what of these is missing or stale; all else that is under way is ended. @param {readonly number[]} frames the most wanted first */
  want(frames) {
    this.problem.value = null;
    this.#wanted = frames;
    for (const [frame, { of, stop }] of this.#going) {
      if (frames.includes(frame) && of === this.#state) continue;
      stop.abort();
      this.#going.delete(frame);
    }
    this.#next();
  }

  #next() {
    const state = this.#state;
    for (const frame of this.#wanted) {
      if (this.#going.size >= AT_ONCE) return;
      if (this.#going.has(frame) || this.#known.get(frame)?.of === state) continue;
      const stop = new AbortController();
      this.#going.set(frame, { of: state, stop });
      void this.#ask(frame, state, stop.signal);
    }
  }

  /** @param {number} frame @param {string} state @param {AbortSignal} stop */
  async #ask(frame, state, stop) {
    const way = this.#way;
    try {
      const marks = await actions.frameMarks(frame, markFunction.peek(), markShape.peek(), stop);
      if (stop.aborted) return;
      this.#known.set(frame, { way, of: state, marks });
    } catch (error) {
      if (stop.aborted) return;
      this.problem.value = error instanceof Error ? error.message : String(error);
      this.#wanted = [];
    }
    this.#going.delete(frame);
    this.version.value += 1;
    this.#next();
  }
}
