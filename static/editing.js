/**
 * The page's changes to the session: shown at once, sent in order, each exactly once, and never lost in silence.
 *
 * Changes to one box wait for each other, so that each is sent with the revision that the one before it made.
 */

import * as api from "./api.js";
import { effect } from "./lib/view.js";
import { rotated, rotatedByDegrees } from "./lib/rotation.js";
import * as store from "./store.js";

/** @typedef {import("./store.js").Box} Box */
/** @typedef {import("./store.js").BoxPreview} BoxPreview */
/** @typedef {{T_world_box: import("./store.js").Transform, size: [number, number, number]}} Place */

/** Milliseconds without another step before a stepped edit is stored: held keys become one edit. */
const QUIET = 350;

/** @type {(message: object) => void} */
let tell = () => {};
/** Changes under way, by what they change. @type {Map<string, Promise<unknown>>} */
const queues = new Map();
/** `from`: the box as it was seen before the first step. @type {{id: number, place: Place, from: Box, timer: ReturnType<typeof setTimeout> | undefined} | null} */
let held = null;
/** The revision of each box that this page made last. @type {Map<number, number>} */
const made = new Map();

/** @param {(message: object) => void} send to the scene, over the live line */
export function connect(send) {
  tell = send;
  let newest = 0;
  effect(() => {
    // The server went back to an earlier state: what this page has made since is no part of it.
    if (store.revision.value < newest) made.clear();
    newest = store.revision.value;
  });
}

/**
 * Run `work` after what is already under way for `what`; count it as unsaved until it is done.
 * @template T
 * @param {string} what
 * @param {() => Promise<T>} work
 * @returns {Promise<T>}
 */
export function inTurn(what, work) {
  store.unsaved.value += 1;
  const before = queues.get(what) ?? Promise.resolve();
  const done = before.then(work, work).finally(() => (store.unsaved.value -= 1));
  queues.set(what, done.catch(() => {}));
  return done;
}

/** @param {Box} box the server's answer; the same edit may have come over the live line already */
export function takeBox(box) {
  const known = store.boxes.value.get(box.id);
  if (known !== undefined && known.revision >= box.revision) return;
  store.boxes.value = new Map(store.boxes.value).set(box.id, box);
  store.revision.value = Math.max(store.revision.value, box.revision);
}

/** @param {number} id */
function existing(id) {
  const box = store.boxes.value.get(id);
  if (box === undefined) throw new api.ApiError("This box has been deleted.", 404);
  return box;
}

/** @param {number} id @param {Partial<Pick<Box, "class_id" | "name" | "locked" | "T_world_box" | "size">>} changes */
export async function changeBox(id, changes) {
  if (held?.id === id) await finishEdit();
  await change(existing(id), changes);
}

/** @param {Box} seen the box that the change is made to @param {Partial<Box>} changes */
async function change(seen, changes) {
  const { id } = seen;
  const moves = changes.T_world_box !== undefined || changes.size !== undefined;
  const shown = store.shownBoxes.value.get(id) ?? seen;
  const preview = { box_id: id, T_world_box: changes.T_world_box ?? shown.T_world_box, size: changes.size ?? shown.size };
  if (moves) showPreview(preview);
  try {
    await inTurn(`box ${id}`, async () => {
      const box = await stored(seen, changes);
      made.set(id, box.revision);
      takeBox(box);
    });
  } catch (error) {
    if (!(error instanceof api.ApiError) || error.status !== 412 || !moves) throw error;
    const current = /** @type {Box | null} */ (error.current ?? null);
    if (current !== null) takeBox(current);
    store.conflict.value = { box_id: id, detail: error.message, yours: preview, current };
  } finally {
    if (moves) endPreview(preview);
  }
}

/**
 * Store a change. Where the server does not answer, wait until it is back: what was typed must not be lost with it.
 * @param {Box} seen
 * @param {Partial<Box>} changes
 * @returns {Promise<Box>}
 */
async function stored({ id, revision: seen }, changes) {
  // What it was made to, also once others have been at it meanwhile: their edit is not to be lost. Only this page's own
  // edits, which waited before it, may have come between.
  const revision = Math.max(seen, made.get(id) ?? 0);
  for (let repeated = false; ; repeated = true) {
    try {
      return await api.changeBox(store.sid.value, id, revision, changes);
    } catch (error) {
      if (!(error instanceof api.ApiError)) throw error;
      // The first attempt may have been stored, and only its answer lost.
      const current = /** @type {Box | undefined} */ (error.current);
      if (repeated && error.status === 412 && current && holds(current, changes)) return current;
      if (error.status !== 0) throw error;
      await lineIs("open");
    }
  }
}

/** Whether a box is what the changes make of it; its rotation may differ in the last digits. @param {Box} box @param {Partial<Box>} changes */
function holds(box, { T_world_box: place, ...others }) {
  if (JSON.stringify({ ...box, ...others }) !== JSON.stringify(box)) return false;
  if (place === undefined) return true;
  const { position, wxyz } = box.T_world_box;
  const cosine = wxyz.reduce((sum, value, i) => sum + value * place.wxyz[i], 0);
  return position.every((value, i) => value === place.position[i]) && Math.abs(Math.abs(cosine) - 1) < 1e-12;
}

/** @param {"open"} state @returns {Promise<void>} */
function lineIs(state) {
  // Before the line is known to be lost it still says open: give it time to notice.
  return new Promise((resolve) => {
    setTimeout(() => {
      const stop = effect(() => {
        if (store.line.value !== state) return;
        resolve();
        queueMicrotask(() => stop());
      });
    }, 1000);
  });
}

/** @param {number} id @param {Place} place @param {boolean} [hold] store it only by `finishEdit`: a button is held */
export function editBox(id, place, hold = false) {
  if (held !== null && held.id !== id) void finishEdit();
  // As it is seen, since an edit that is on its way to the server is where this one goes on from.
  const from = held?.from ?? { ...existing(id), ...store.shownBoxes.value.get(id) };
  if (from.locked) {
    store.setProblem(`box:${id}`, `${from.name} is locked: unlock it to move it.`);
    return;
  }
  store.setProblem(`box:${id}`, null);
  if (held !== null) clearTimeout(held.timer);
  held = { id, place, from, timer: hold ? undefined : setTimeout(() => void finishEdit(), QUIET) };
  showPreview({ box_id: id, ...place });
}

export async function finishEdit() {
  if (held === null) return;
  const { id, place, from, timer } = held;
  clearTimeout(timer);
  held = null;
  const changes = { ...(samePose(place, from) ? {} : { T_world_box: place.T_world_box }), ...(sameSize(place, from) ? {} : { size: place.size }) };
  if (Object.keys(changes).length === 0) return endPreview(store.typed.value);
  try {
    await change(from, changes);
  } catch (error) {
    if (!(error instanceof api.ApiError)) throw error;
    store.setProblem(`box:${id}`, error.message);
  }
}

/** @param {[number, number, number]} translate metres @param {[number, number, number]} rotate degrees */
export function nudge(translate, rotate) {
  const box = store.selectedBox.value;
  if (box === null) return;
  const { position, wxyz } = box.T_world_box;
  const own = store.axes.value === "box";
  const step = own ? rotated(wxyz, translate) : translate;
  const turn = store.upright.value ? /** @type {[number, number, number]} */ ([0, 0, rotate[2]]) : rotate;
  editBox(box.id, {
    size: box.size,
    T_world_box: {
      position: [position[0] + step[0], position[1] + step[1], position[2] + step[2]],
      wxyz: rotatedByDegrees(wxyz, turn, store.upright.value ? "world" : store.axes.value),
    },
  });
}

/** @param {number} id */
export async function deleteBox(id) {
  if (held?.id === id) await finishEdit();
  await inTurn(`box ${id}`, () => api.deleteBox(store.sid.value, id, existing(id).revision));
}

/** @param {number} id */
export async function duplicateBox(id) {
  await finishEdit();
  const copy = await inTurn(`box ${id}`, () => api.duplicateBox(store.sid.value, id));
  takeBox(copy);
  store.selected.value = copy.id;
}

/** @param {number} id */
export async function restOnGround(id) {
  if (held?.id === id) await finishEdit();
  const box = await inTurn(`box ${id}`, () => api.restOnGround(store.sid.value, id, existing(id).revision));
  made.set(id, box.revision);
  takeBox(box);
}

/** @param {number} classId @param {[number, number, number][]} points */
export async function boxFromPoints(classId, points) {
  const made = await inTurn("boxes", () => api.boxFromPoints(store.sid.value, classId, points));
  takeBox(made);
  store.selected.value = made.id;
  return made.residual_degrees;
}

/** @param {string} name */
export async function addClass(name) {
  const made = await inTurn("classes", () => api.addClass(store.sid.value, name));
  takeClass(made);
  return made;
}

/** @param {number} id */
function existingClass(id) {
  const known = store.classes.value.get(id);
  if (known === undefined) throw new api.ApiError("This class has been deleted.", 404);
  return known;
}

/** @param {number} id @param {object} changes */
export async function changeClass(id, changes) {
  await inTurn("classes", async () => {
    takeClass(await api.changeClass(store.sid.value, id, existingClass(id).revision, changes));
  });
}

/** @param {number} id @param {FormData} form the file, and what its numbers mean */
export async function putClassMesh(id, form) {
  return inTurn("classes", async () => {
    const { notes, ...made } = await api.putClassMesh(store.sid.value, id, existingClass(id).revision, form);
    takeClass(made);
    return notes;
  });
}

/** @param {number} id */
export async function deleteClassMesh(id) {
  await inTurn("classes", async () => {
    takeClass(await api.deleteClassMesh(store.sid.value, id, existingClass(id).revision));
  });
}

/** What edits do not tell of a class: how large its mesh is, and where it came from. @param {number} id */
export async function completeClass(id) {
  takeClass(await api.classOf(store.sid.value, id));
}

/** @param {number} id */
export async function deleteClass(id) {
  await inTurn("classes", async () => {
    const known = store.classes.value.get(id);
    if (known !== undefined) await api.deleteClass(store.sid.value, id, known.revision);
  });
}

/** @param {import("./store.js").ObjectClass} made */
function takeClass(made) {
  const known = store.classes.value.get(made.id);
  // The same edit may have come over the live line already, which tells less of a mesh.
  if (known === undefined || known.revision <= made.revision) {
    store.classes.value = new Map(store.classes.value).set(made.id, made);
  }
}

/** @param {BoxPreview} yours */
export async function overrule(yours) {
  const now = store.conflict.value?.current;
  if (now === null) throw new api.ApiError("The box was deleted meanwhile: undo that first, in the history.", 412);
  store.conflict.value = null;
  await changeBox(yours.box_id, { T_world_box: yours.T_world_box, size: yours.size });
}

/** @param {"undo" | "redo"} which */
export async function stepHistory(which) {
  await finishEdit();
  // What is under way is part of the history that is stepped through.
  await Promise.all(queues.values());
  store.setProblem("history", null);
  try {
    await inTurn("history", () => api[which](store.sid.value));
  } catch (error) {
    if (!(error instanceof api.ApiError)) throw error;
    store.setProblem("history", error.message);
    // Somebody else changed the same thing since: the history says who, and what of it stands.
    if (error.current !== undefined) store.sidePanel.value = "history";
  }
}

/** @param {string} name */
export async function renameSession(name) {
  await inTurn("name", async () => {
    // The name's revision is the session's, which any edit moves on: ask for the newest.
    const now = await api.session(store.sid.value);
    store.session.value = await api.renameSession(store.sid.value, now.revision, name);
  });
}

/** @param {BoxPreview} preview */
function showPreview(preview) {
  store.typed.value = preview;
  tell({ type: "preview", ...preview });
}

/** Take a preview back, unless a newer one has taken its place. @param {BoxPreview | null} preview */
function endPreview(preview) {
  if (preview === null || store.typed.value !== preview) return;
  store.typed.value = null;
  tell({ type: "preview", box_id: null });
}

/** @param {Place} a @param {Place} b */
function samePose(a, b) {
  return [...a.T_world_box.position, ...a.T_world_box.wxyz].every(
    (value, i) => value === [...b.T_world_box.position, ...b.T_world_box.wxyz][i],
  );
}

/** @param {Place} a @param {Place} b */
function sameSize(a, b) {
  return a.size.every((value, i) => value === b.size[i]);
}
