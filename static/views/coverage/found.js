/** What the server says of the coverage, asked anew whenever what is counted or the session changes. */

import { signal, useSignalEffect } from "../../lib/view.js";
import { actions, counting, direction, line, revision, seen } from "../../store.js";

/** @typedef {import("../../store.js").Coverage} Coverage */
/** @typedef {import("../../store.js").Schemas["ObjectCoverage"]} ObjectCoverage */
/** @typedef {import("../../store.js").Schemas["BinFrames"]} BinFrames */

/** Milliseconds without a change before the server is asked. */
const PAUSE = 200;

/**
 * An answer that stays, marked as stale, until the next one is there.
 * @template T
 */
class Answer {
  value = signal(/** @type {T | null} */ (null));
  /** Whether it is of what is asked for now. */
  isCurrent = signal(false);
  problem = signal(/** @type {string | null} */ (null));
  #again = signal(0);

  /** Ask once more, without any change. */
  retry() {
    this.#again.value += 1;
  }

  /**
   * Keep it up to date while who calls this is shown.
   * @param {() => ((stop: AbortSignal) => Promise<T>) | null} wish reads what it depends on; null: there is nothing to ask
   * @param {number} [pause]
   */
  use(wish, pause = PAUSE) {
    useSignalEffect(() => {
      void this.#again.value;
      const ask = wish();
      this.isCurrent.value = false;
      if (ask === null) {
        this.value.value = null;
        this.problem.value = null;
        return;
      }
      const stop = new AbortController();
      const timer = setTimeout(() => void this.#ask(ask, stop.signal), this.value.peek() === null ? 0 : pause);
      return () => {
        clearTimeout(timer);
        stop.abort();
      };
    });
  }

  /** @param {(stop: AbortSignal) => Promise<T>} ask @param {AbortSignal} stop */
  async #ask(ask, stop) {
    try {
      const found = await ask(stop);
      if (stop.aborted) return;
      this.value.value = found;
      this.isCurrent.value = true;
      this.problem.value = null;
    } catch (error) {
      if (!stop.aborted) this.problem.value = /** @type {Error} */ (error).message;
    }
  }
}

/** Of the object or class that is looked at; with the kind of counting that it is of. */
export const coverage = /** @type {Answer<Coverage>} */ (new Answer());
/** Of all objects and classes. */
export const objects = /** @type {Answer<readonly ObjectCoverage[]>} */ (new Answer());
/** Of the chosen direction; `of`: the one that was asked about. */
export const binFrames = /** @type {Answer<BinFrames & {of: import("../../store.js").Direction}>} */ (new Answer());

/** What all answers depend on: a line that comes back may have missed an edit that is not told yet. */
function state() {
  void revision.value;
  void line.value;
}

export function useCoverage() {
  coverage.use(() => {
    const [of, how] = [seen.value, counting.value];
    state();
    return of === null ? null : (stop) => actions.coverage(of, how, stop);
  });
}

export function useObjects() {
  objects.use(() => {
    const how = counting.value;
    state();
    return seen.value === null ? null : (stop) => actions.coverageOfObjects(how, stop);
  });
}

export function useBinFrames() {
  binFrames.use(() => {
    const [of, how, where] = [seen.value, counting.value, direction.value];
    state();
    return of === null || where === null ? null : async (stop) => ({ ...(await actions.coverageFrames(of, how, where, stop)), of: where });
  }, 0);
}
