/**
 * What is drawn is stored as soon as a stroke is done, and what is stored is shown: masks that others change, and those
 * that undo brings back, come into the drawings.
 */

import { batch, effect, signal } from "../../lib/view.js";
import * as store from "../../store.js";
import { drawing } from "./drawing.js";
import { adopt, disown, idOf, keyOf } from "./subject.js";

/** @typedef {import("../../store.js").Polygon} Polygon */

/**
 * What is wrong with the outlines of an object, by `place`; they are drawn, and not stored.
 */
export const refused = signal(/** @type {ReadonlyMap<string, string>} */ (new Map()));

/** Milliseconds until what the server did not answer is sent again. */
const AGAIN = 2000;

/** What each drawing was last made equal to, as the revision of a mask. @type {Map<string, number>} */
const shown = new Map();
/** Drawings that are on their way to the server, with what they are by now. @type {Map<string, readonly Polygon[]>} */
const going = new Map();
/** So that masks are looked at again once a drawing is stored. */
const arrivals = signal(0);
/** The class of each object that was drawn here. @type {Map<string, number>} */
const classOf = new Map();
/** Drawings that the server did not answer for, and that are sent again. @type {Map<string, ReturnType<typeof setTimeout>>} */
const unsent = new Map();
/** One after the other for each object: the first mask of a new one tells its id. @type {Map<string, Promise<void>>} */
const queues = new Map();

/** @param {string} key of an object @param {number} frame */
export function place(key, frame) {
  return `${key}:${frame}`;
}

/** Begin to store and to show. Returns the way to stop. */
export function connect() {
  const unhear = drawing.onChange((key, frame, polygons, phase) => {
    if (phase === "done") void save(key, frame, polygons);
  });
  const stop = effect(showStored);
  return () => {
    unhear();
    stop();
  };
}

/** The class of what is drawn next for an object without a mask. @param {string} key @param {number} class_id */
export function knowClass(key, class_id) {
  classOf.set(key, class_id);
}

/** @param {string} key @param {number} frame */
function stored(key, frame) {
  const id = idOf(key);
  if (id === null) return undefined;
  for (const mask of store.masks.peek().values()) if (mask.box_id === id && mask.frame === frame) return mask;
  return undefined;
}

/** @param {string} key @param {number} frame @param {readonly Polygon[]} polygons */
async function save(key, frame, polygons) {
  const at = place(key, frame);
  if (unsent.has(at)) {
    clearTimeout(unsent.get(at));
    unsent.delete(at);
    store.unsaved.value -= 1;
  }
  const isFirst = !going.has(at);
  going.set(at, polygons);
  // What is under way takes the newest when its turn comes.
  if (!isFirst) return;
  const before = queues.get(key) ?? Promise.resolve();
  const next = () => send(key, frame);
  const done = before.then(next, next);
  queues.set(key, done);
  await done;
}

/** @param {string} key @param {number} frame */
async function send(key, frame) {
  const at = place(key, frame);
  const sheet = drawing.of(key, frame);
  /** @type {any} */
  let failure = null;
  try {
    for (let sent = null; going.get(at) !== sent; ) {
      sent = /** @type {readonly Polygon[]} */ (going.get(at));
      const known = stored(key, frame);
      if (sent.length === 0) {
        if (known !== undefined) {
          const id = known.box_id;
          const isLast = !store.boxes.peek().has(id) && [...store.masks.peek().values()].every((mask) => mask.id === known.id || mask.box_id !== id);
          if (isLast && keyOf(id) === key && !key.startsWith("box-")) disown(key, id, known.class_id);
          await store.actions.deleteMask(known.id);
        }
        shown.delete(at);
      } else if (known === undefined || !known.accepted || !same(known.polygons, sent)) {
        const id = idOf(key);
        const class_id = known?.class_id ?? classOf.get(key) ?? store.boxes.peek().get(id ?? -1)?.class_id;
        if (class_id === undefined) throw new Error(`nobody said of which class ${key} is`);
        const mask = await store.actions.putMask({ box_id: id, class_id }, frame, sent, sheet.origin);
        if (id === null) adopt(key, mask.box_id);
        shown.set(at, mask.revision);
      }
      // It is stored as it is, unless somebody has gone on meanwhile.
      if (sheet.settled === sent) sheet.replace(sent);
    }
    clearRefused(key);
  } catch (error) {
    if (!(error instanceof Error) || !("status" in error)) throw error;
    failure = error;
  } finally {
    going.delete(at);
    arrivals.value += 1;
  }
  // Where somebody else's outline came between, it is shown by now.
  if (failure === null) return;
  refuse(key, frame, failure);
  if (failure.status !== 0) return;
  store.unsaved.value += 1;
  unsent.set(at, setTimeout(() => void save(key, frame, sheet.settled), AGAIN));
}

/**
 * @param {string} key @param {number} frame
 * @param {{message: string, views?: readonly {frame: number, misfit_px: number | null}[]}} error
 */
function refuse(key, frame, { message, views = [] }) {
  const next = new Map(refused.value).set(place(key, frame), `Not stored: ${message}`);
  for (const { frame: concerned, misfit_px } of views) {
    const words = misfitWords(misfit_px, message);
    next.set(place(key, concerned), concerned === frame ? `Not stored: ${words}` : words);
  }
  refused.value = next;
}

/** What is said on a view that disagrees with others. @param {number | null} px @param {string} detail of all that is wrong */
export function misfitWords(px, detail) {
  return px === null ? detail : `this outline misses the others by ${px.toFixed(px < 10 ? 1 : 0)} px: mend it, or the one that it disagrees with`;
}

/** @param {string} key */
function clearRefused(key) {
  const kept = [...refused.value].filter(([at]) => !at.startsWith(`${key}:`));
  if (kept.length < refused.value.size) refused.value = new Map(kept);
}

/** Take over what was stored elsewhere: by others, by undo, by the machine. */
function showStored() {
  void arrivals.value;
  const gone = new Set(shown.keys());
  /** @type {[key: string, frame: number, polygons: readonly Polygon[]][]} */
  const changed = [];
  for (const mask of store.masks.value.values()) {
    const key = keyOf(mask.box_id);
    const at = place(key, mask.frame);
    gone.delete(at);
    if (going.has(at) || shown.get(at) === mask.revision) continue;
    shown.set(at, mask.revision);
    changed.push([key, mask.frame, mask.polygons]);
  }
  for (const at of gone) {
    if (going.has(at)) continue;
    shown.delete(at);
    const cut = at.lastIndexOf(":");
    changed.push([at.slice(0, cut), Number(at.slice(cut + 1)), []]);
  }
  if (changed.length === 0) return;
  batch(() => {
    for (const [key, frame, polygons] of changed) {
      drawing.of(key, frame).replace(polygons);
      clearRefused(key);
    }
  });
}

/** Whether outlines are the same; the server keeps thousandths of a pixel. @param {readonly Polygon[]} a @param {readonly Polygon[]} b */
function same(a, b) {
  const rings = (/** @type {readonly Polygon[]} */ of) => of.map(({ outer, holes }) => [outer, ...holes]);
  const text = (/** @type {readonly Polygon[]} */ of) => JSON.stringify(rings(of), (_, value) => (typeof value === "number" ? Math.round(value * 1000) : value));
  return text(a) === text(b);
}
