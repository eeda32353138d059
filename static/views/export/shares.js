/** The shares of training, validation and test, which always make one whole. */

/** In the order in which the others give way. */
const NAMES = ["split.train", "split.val", "split.test"];

/** Shares are whole numbers of these, so that adding them leaves no dust. */
const PARTS = 10_000;

/** @param {string} name */
export function isShareOfSplit(name) {
  return NAMES.includes(name);
}

/**
 * All three shares once one is changed: training gives way first, then validation, then test.
 * @param {(name: string) => unknown} valueOf
 * @param {string} changed
 * @param {number} share
 * @returns {[name: string, share: number][]}
 */
export function balanced(valueOf, changed, share) {
  const parts = new Map(NAMES.map((name) => [name, Math.round(Number(valueOf(name)) * PARTS)]));
  parts.set(changed, Math.round(share * PARTS));
  let missing = PARTS - [...parts.values()].reduce((sum, one) => sum + one, 0);
  for (const name of NAMES) {
    if (name === changed) continue;
    const now = /** @type {number} */ (parts.get(name));
    const next = Math.max(0, now + missing);
    missing -= next - now;
    parts.set(name, next);
  }
  return NAMES.map((name) => [name, /** @type {number} */ (parts.get(name)) / PARTS]);
}
