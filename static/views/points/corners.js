/**
 * The four corners that are being clicked, each in two frames or more, and where that puts them in the world.
 *
 * They are the page's own until the box is made, and stay when another tool is taken meanwhile.
 */

import { batch, computed, effect, signal } from "../../lib/view.js";
import { actions } from "../../store.js";

/** @typedef {import("../../lib/image_view.js").Place} Place */
/** @typedef {import("../../store.js").Schemas["PointAnswer"]} PointAnswer */
/** Where a corner is seen: image coordinates by frame. @typedef {ReadonlyMap<number, Place>} Sightings */
/**
 * `of`: the sightings that it follows from; of older ones while the answer for newer ones is under way.
 * @typedef {{of: Sightings, answer: PointAnswer | null, problem: string | null}} Location
 */

export const CORNERS = /** @type {const} */ ([0, 1, 2, 3]);
/** Frames that a corner must be seen in. */
export const NEEDED = 2;

/** @type {readonly Sightings[]} */
const NONE = CORNERS.map(() => new Map());

export const corners = signal(NONE);
/** In the order of their clicks. */
const clicks = signal(/** @type {readonly {corner: number, frame: number}[]} */ ([]));
/** The corner that somebody went back to; null: the next that is wanting. */
const chosen = signal(/** @type {number | null} */ (null));
export const locations = signal(/** @type {readonly (Location | null)[]} */ (CORNERS.map(() => null)));

/** The first corner that is not seen often enough; null: none. */
const wanting = computed(() => CORNERS.find((corner) => corners.value[corner].size < NEEDED) ?? null);
/** The corner that the next click is for. */
export const current = computed(() => chosen.value ?? wanting.value ?? 3);
export const begun = computed(() => clicks.value.length > 0);
/** The corners in the world, once all four are known. */
export const points = computed(() => {
  const found = locations.value.map((location, corner) =>
    location !== null && location.of === corners.value[corner] ? (location.answer?.point ?? null) : null,
  );
  return found.every((point) => point !== null) ? /** @type {[number, number, number][]} */ (found) : null;
});

/** @param {number} corner @param {(sightings: Map<number, Place>) => void} change */
function change(corner, change) {
  const sightings = new Map(corners.value[corner]);
  change(sightings);
  corners.value = corners.value.map((before, i) => (i === corner ? sightings : before));
}

/** The current corner is seen here. @param {number} frame @param {Place} at */
export function mark(frame, at) {
  batch(() => {
    const corner = current.value;
    const complete = corners.value[corner].size >= NEEDED;
    if (!corners.value[corner].has(frame)) clicks.value = [...clicks.value, { corner, frame }];
    change(corner, (sightings) => sightings.set(frame, at));
    // On to the next, unless it is a finished one that is being mended.
    if (!complete && corners.value[corner].size >= NEEDED) chosen.value = null;
  });
}

/** @param {number} corner @param {number} frame @param {Place} at */
export function move(corner, frame, at) {
  if (corners.value[corner].has(frame)) change(corner, (sightings) => sightings.set(frame, at));
}

/** @param {number} corner the next click is for it */
export function choose(corner) {
  chosen.value = corner === wanting.value ? null : corner;
}

/** Take back the last click; whether there was one. */
export function takeBack() {
  const last = clicks.value.at(-1);
  if (last === undefined) return false;
  batch(() => {
    clicks.value = clicks.value.slice(0, -1);
    change(last.corner, (sightings) => sightings.delete(last.frame));
    chosen.value = null;
  });
  return true;
}

/** Go one step back: from a corner gone back to, else by the last click. Whether there was a step to go. */
export function stepBack() {
  if (chosen.value === null || wanting.value === null) return takeBack();
  chosen.value = null;
  return true;
}

export function startOver() {
  batch(() => {
    corners.value = NONE;
    clicks.value = [];
    chosen.value = null;
  });
}

/** Corners whose place is being asked for. @type {Set<number>} */
const asking = new Set();

effect(() => {
  for (const corner of CORNERS) {
    const sightings = corners.value[corner];
    if (sightings.size < NEEDED) {
      if (locations.peek()[corner] !== null) setLocation(corner, null);
    } else if (locations.peek()[corner]?.of !== sightings) void locate(corner);
  }
});

/**
 * Ask where a corner is, again as long as it was moved meanwhile: one request at a time.
 * @param {number} corner
 */
async function locate(corner) {
  if (asking.has(corner)) return;
  asking.add(corner);
  for (;;) {
    const of = corners.peek()[corner];
    if (of.size < NEEDED || locations.peek()[corner]?.of === of) break;
    const sightings = [...of].map(([frame, { x, y }]) => ({ frame, x, y }));
    const found = await actions.locatePoint(sightings).then(
      (answer) => ({ of, answer, problem: null }),
      (/** @type {Error} */ error) => ({ of, answer: null, problem: error.message }),
    );
    if (corners.peek()[corner].size >= NEEDED) setLocation(corner, found);
  }
  asking.delete(corner);
}

/** @param {number} corner @param {Location | null} found */
function setLocation(corner, found) {
  locations.value = locations.peek().map((before, i) => (i === corner ? found : before));
}
