/** What can be done to one box of the list. What goes wrong is shown at the box. */

import { command } from "./commands.js";
import * as store from "../store.js";

/** @typedef {import("../store.js").Box} Box */
/** @typedef {import("../lib/menu.js").MenuItem} MenuItem */

/**
 * @param {Box} box
 * @param {{rename: () => void, chooseClass: () => void}} ask
 * @returns {(MenuItem | null)[]}
 */
export function boxMenu(box, { rename, chooseClass }) {
  const keys = (/** @type {string} */ id) => command(id).keys[0];
  const { locked, id } = box;
  return [
    { title: "Rename", keys: "F2", run: rename },
    { title: "Class…", run: chooseClass, disabled: locked || store.classes.value.size < 2 },
    { title: "Duplicate", keys: keys("duplicate"), run: () => at(id, () => store.actions.duplicateBox(id)) },
    { title: "Rest on ground", keys: keys("ground"), run: () => at(id, () => store.actions.restOnGround(id)), disabled: locked },
    { title: locked ? "Unlock" : "Lock", keys: keys("lock"), run: () => toggleLock(box) },
    { title: store.hidden.value.has(id) ? "Show" : "Hide", keys: keys("hide"), run: () => toggleHidden(id) },
    null,
    { title: "Delete", keys: keys("delete"), run: () => at(id, () => store.actions.deleteBox(id)), disabled: locked, bad: true },
  ];
}

/** @param {Box} box @returns {MenuItem[]} */
export function classMenu(box) {
  return [...store.classes.value.values()].map((one) => ({
    title: one.id === box.class_id ? `${one.name} (now)` : one.name,
    disabled: one.id === box.class_id,
    run: () => at(box.id, () => store.actions.changeBox(box.id, { class_id: one.id })),
  }));
}

/** @param {Box} box */
export function toggleLock(box) {
  at(box.id, () => store.actions.changeBox(box.id, { locked: !box.locked }));
}

/** @param {number} id */
export function toggleHidden(id) {
  const next = new Set(store.hidden.value);
  if (!next.delete(id)) next.add(id);
  store.hidden.value = next;
}

/** @param {number} id @param {() => Promise<void>} work */
function at(id, work) {
  void store.attempt(`box:${id}`, work);
}
