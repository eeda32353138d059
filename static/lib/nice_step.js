/** Steps that people count in: 1, 2, 5, 10, 20, 50, … */

/**
 * The smallest such step that is at least as large.
 * @param {number} least
 */
export function niceStep(least) {
  let ten = 1;
  for (;;) {
    for (const step of [ten, 2 * ten, 5 * ten]) if (step >= least) return step;
    ten *= 10;
  }
}

/**
 * All such steps from 1 to the first that is at least as large as `last`.
 * @param {number} last
 */
export function niceSteps(last) {
  const steps = [1];
  for (;;) {
    const newest = /** @type {number} */ (steps.at(-1));
    if (newest >= last) return steps;
    steps.push(niceStep(newest + 1));
  }
}
