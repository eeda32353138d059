/**
 * The page's changes to masks: those of one object are sent one after the other, each with the revision that it was made
 * to, so that a hull is never made of outlines that came in the wrong order.
 */

import * as api from "./api.js";
import { batch } from "./lib/view.js";
import { inTurn, takeBox } from "./editing.js";
import * as store from "./store.js";

/** @typedef {import("./store.js").Mask} Mask */

const sid = () => store.sid.value;

/** @param {number} box_id @param {number} frame */
function maskAt(box_id, frame) {
  for (const mask of store.masks.value.values()) if (mask.box_id === box_id && mask.frame === frame) return mask;
  return undefined;
}

/** @param {Mask} mask the server's answer; the same edit may have come over the live line already */
function takeMask(mask) {
  const known = store.masks.value.get(mask.id);
  if (known !== undefined && known.revision >= mask.revision) return;
  batch(() => {
    store.masks.value = new Map(store.masks.value).set(mask.id, mask);
    store.revision.value = Math.max(store.revision.value, mask.revision);
  });
}

/** @type {import("./store.js").Actions["putMask"]} */
export function putMask({ box_id, class_id }, frame, polygons, origin) {
  return inTurn(turn(box_id), async () => {
    const known = box_id === null ? undefined : maskAt(box_id, frame);
    const mask =
      known === undefined
        ? await api.addMask(sid(), { box_id, class_id, frame, polygons, origin })
        : await api.changeMask(sid(), known.id, known.revision, { polygons, origin, accepted: true });
    takeMask(mask);
    return mask;
  });
}

/** @param {number} id */
export async function acceptMask(id) {
  const { box_id } = existing(id);
  await inTurn(turn(box_id), async () => takeMask(await api.changeMask(sid(), id, existing(id).revision, { accepted: true })));
}

/** @param {number} id */
export async function deleteMask(id) {
  const { box_id } = existing(id);
  await inTurn(turn(box_id), () => api.deleteMask(sid(), id, existing(id).revision));
}

/** @type {import("./store.js").Actions["makeHull"]} */
export async function makeHull(id, options) {
  await inTurn(turn(id), async () => {
    const { hull: _, ...box } = await api.makeHull(sid(), id, store.boxes.value.get(id)?.revision, options);
    takeBox(box);
  });
}

/** @type {import("./store.js").Actions["refineBox"]} */
export function refineBox(id, orientation) {
  return inTurn(turn(id), async () => {
    const box = store.boxes.value.get(id);
    if (box === undefined) throw new api.ApiError("This box has been deleted.", 404);
    const fitted = await api.refineBox(sid(), id, box.revision, { orientation });
    takeBox(fitted.box);
    return fitted;
  });
}

/** Masks change the box that is made of them: both wait for each other. @param {number | null} box_id */
function turn(box_id) {
  return `box ${box_id ?? store.NEW}`;
}

/** @param {number} id */
function existing(id) {
  const mask = store.masks.value.get(id);
  if (mask === undefined) throw new api.ApiError("This mask has been deleted.", 404);
  return mask;
}
