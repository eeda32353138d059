/** The object that is outlined: the selected one, which may have no box yet, or be new with nothing of it stored. */

import { batch, computed, signal } from "../../lib/view.js";
import * as store from "../../store.js";

/**
 * @typedef {object} Subject
 * @property {string} key its name in the drawings of this page; it stays when the object gets its id
 * @property {number | null} id null: nothing of it is stored
 * @property {number} class_id
 * @property {string} name
 * @property {string} color
 * @property {import("../../store.js").Box | null} box null: it is not made yet
 */

/** What pixels an outline is expected to be off by, until somebody says otherwise. */
const MASK_ERROR = 1;
const USUAL = /** @type {import("../../store.js").HullOptions} */ ({ orientation: "world", widen_px: MASK_ERROR, ground: null });

/** The keys of objects that got their ids on this page. */
const keys = signal(/** @type {ReadonlyMap<number, string>} */ (new Map()));
const newKey = signal("new-0");
let begun = 0;
/** What was said on this page of objects without a box, by their keys. */
const wishes = signal(/** @type {ReadonlyMap<string, import("../../store.js").HullOptions>} */ (new Map()));

/** @param {number} id */
export function keyOf(id) {
  return keys.value.get(id) ?? `box-${id}`;
}

/** @type {import("../../lib/view.js").ReadonlySignal<Subject | null>} */
export const subject = computed(() => {
  const id = store.selected.value;
  if (id === null) return null;
  const box = store.boxes.value.get(id) ?? null;
  const class_id = box?.class_id ?? (id === store.NEW ? store.newClass.value : store.drafts.value.find((draft) => draft.id === id)?.class_id);
  if (class_id === undefined || class_id === null) return null;
  const { name = "object", color = "#ffffff" } = store.classes.value.get(class_id) ?? {};
  const isNew = id === store.NEW;
  return { key: isNew ? newKey.value : keyOf(id), id: isNew ? null : id, class_id, name: box?.name ?? name, color, box };
});

/** Begin another object. @param {number} class_id */
export function begin(class_id) {
  batch(() => {
    begun += 1;
    newKey.value = `new-${begun}`;
    store.chosenClass.value = class_id;
    store.newClass.value = class_id;
    store.selected.value = store.NEW;
  });
}

/** Let go of a new object of which nothing is stored. */
export function giveUp() {
  if (store.selected.value !== store.NEW) return;
  batch(() => {
    store.selected.value = null;
    store.newClass.value = null;
  });
}

/** The new object of `key` got its id with its first mask. @param {string} key @param {number} id */
export function adopt(key, id) {
  batch(() => {
    keys.value = new Map(keys.value).set(id, key);
    if (store.selected.value !== store.NEW || newKey.value !== key) return;
    store.selected.value = id;
    store.newClass.value = null;
  });
}

/** The new object of `key` is about to lose the last that is stored of it: it is new again, with the same drawing. @param {string} key @param {number} id @param {number} class_id */
export function disown(key, id, class_id) {
  batch(() => {
    const left = new Map(keys.value);
    left.delete(id);
    keys.value = left;
    if (store.selected.value !== id) return;
    newKey.value = key;
    store.newClass.value = class_id;
    store.selected.value = store.NEW;
  });
}

/** The id of an object by its key, or null where nothing of it is stored. @param {string} key */
export function idOf(key) {
  for (const [id, own] of keys.value) if (own === key) return id;
  return key.startsWith("box-") ? Number(key.slice(4)) : null;
}

/** How the subject's hull is made: as its box was, else as was said here, else as usual. */
export const options = computed(() => {
  const now = subject.value;
  return (now === null ? undefined : (made(now.box) ?? wishes.value.get(now.key))) ?? USUAL;
});

/** How a box was made of masks; undefined: it was not. @param {import("../../store.js").Box | null} box @returns {import("../../store.js").HullOptions | undefined} */
export function made(box) {
  return box?.hull_options ?? undefined;
}

/** Of an object whose box is not made yet, or not of masks: for when it is. @param {Partial<import("../../store.js").HullOptions>} changes */
export function wish(changes) {
  const now = subject.value;
  if (now !== null) wishes.value = new Map(wishes.value).set(now.key, { ...options.value, ...changes });
}
