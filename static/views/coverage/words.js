/** Names and shares as people say them. */

import * as store from "../../store.js";

/** What is looked at: an object, or all of a class. */
export function seenName() {
  const of = store.seen.value;
  if (of === null) return "nothing";
  if ("box_id" in of) return store.boxes.value.get(of.box_id)?.name ?? "the object";
  return `all of ${store.classes.value.get(of.class_id)?.name ?? "the class"}`;
}

/** "62%"; never all or nothing where it is not. @param {number} share */
export function percent(share) {
  if (share > 0 && share < 0.005) return "<1%";
  if (share < 1 && share > 0.995) return ">99%";
  return `${Math.round(100 * share)}%`;
}
