/** Work that is asked for faster than it can be done: only the newest wish counts, one at a time. */

/**
 * @template T
 * @param {(wish: T) => Promise<void>} work must not reject
 * @param {number} gap milliseconds between two starts, at least
 * @returns {{ask: (wish: T) => void, stop: () => void}}
 */
export function paced(work, gap) {
  /** @type {{wish: T} | null} */
  let next = null;
  let running = false;
  let free = 0;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;

  const start = () => {
    timer = undefined;
    if (running || next === null) return;
    const wait = free - performance.now();
    if (wait > 0) {
      timer = setTimeout(start, wait);
      return;
    }
    const { wish } = next;
    next = null;
    running = true;
    free = performance.now() + gap;
    void work(wish).finally(() => {
      running = false;
      start();
    });
  };
  return {
    ask: (wish) => {
      next = { wish };
      if (timer === undefined) start();
    },
    stop: () => {
      clearTimeout(timer);
      timer = undefined;
      next = null;
    },
  };
}
