/** What comes up below the fold of its panel. */

/** For a `ref`: scroll only as far as is needed. @param {Element | null} told */
export function intoSight(told) {
  told?.scrollIntoView({ block: "nearest" });
}
