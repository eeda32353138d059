/** What the outlines give so far: asked anew while one draws, one question at a time, of which only the newest counts. */

import { paced } from "../../lib/paced.js";
import { computed, effect, signal } from "../../lib/view.js";
import * as store from "../../store.js";
import { drawing } from "./drawing.js";
import { panes } from "./panes.js";
import { options, subject } from "./subject.js";

/** @typedef {import("../../store.js").HullPreview} HullPreview */
/** @typedef {{key: string, views: import("../../store.js").MaskView[], options: import("../../store.js").HullOptions, show_in: number[]}} Wish */

/** Milliseconds between two questions. */
const GAP = 60;
/** Of masks whose hull is asked for while one draws; the server takes no more. */
const MOST_VIEWS = 32;

/** `blind`: the frames asked for that cannot show the object. */
const told = signal(/** @type {{key: string, preview: HullPreview, blind: readonly number[]} | null} */ (null));
/** Why the server does not say, in words. */
export const trouble = signal(/** @type {string | null} */ (null));

/** Of the object that is outlined; null: nothing is known of it. */
export const guidance = computed(() => (told.value !== null && told.value.key === subject.value?.key ? told.value.preview : null));

/** Whether a frame cannot show the object, by its outlines in others. @param {number} frame */
export function isBlind(frame) {
  return guidance.value !== null && guidance.value.problem === null && (told.value?.blind.includes(frame) ?? false);
}

/** The frames in which nothing of where the object lies is within the image. @param {HullPreview} preview @param {readonly number[]} frames */
async function outOfSight({ overlays }, frames) {
  const cameras = await Promise.all(frames.map((frame) => store.actions.cameraOf(frame)));
  return frames.filter((frame, i) => {
    const { width, height } = cameras[i];
    const seen = overlays.some((one) => one.frame === frame && one.polygons.some(({ outer }) => {
      const [xs, ys] = [outer.map(([x]) => x), outer.map(([, y]) => y)];
      return Math.min(...xs) < width && Math.max(...xs) > 0 && Math.min(...ys) < height && Math.max(...ys) > 0;
    }));
    // By its own outline alone, nothing is told of a frame.
    return !seen && views.peek().some((view) => view.frame !== frame);
  });
}

/** The outlines as they are seen now: what is drawn in the panes, and what is stored for other frames. */
export const views = computed(() => {
  const now = subject.value;
  if (now === null) return [];
  /** @type {Map<number, readonly import("../../store.js").Polygon[]>} */
  const found = new Map();
  for (const { frame, polygons, accepted } of store.masksOfSelected.value) if (accepted) found.set(frame, polygons);
  for (const { frame } of panes.value) {
    const drawn = seen(drawing.of(now.key, frame));
    const proposed = store.masksOfSelected.value.some((mask) => mask.frame === frame && !mask.accepted);
    if (drawn.length === 0) found.delete(frame);
    else if (!proposed) found.set(frame, drawn);
  }
  return [...found].map(([frame, polygons]) => ({ frame, polygons })).sort((a, b) => a.frame - b.frame);
});

/** With the ring that is being drawn, as if it were closed. @param {import("../../lib/mask_sheet.js").MaskSheet} sheet */
function seen({ polygons, open, operation }) {
  const ring = open.value;
  if (ring === null || ring.length < 3 || operation === "subtract") return polygons.value;
  return [...(operation === "new" ? [] : polygons.value), { outer: [...ring], holes: [] }];
}

/** Begin to ask. Returns the way to stop. */
export function connect() {
  let wanted = false;
  const pace = paced(async (/** @type {Wish} */ { key, views, options, show_in }) => {
    try {
      const preview = await store.actions.previewHull(views, options, show_in);
      const blind = await outOfSight(preview, show_in);
      if (!wanted) return;
      told.value = { key, preview, blind };
      trouble.value = null;
    } catch (error) {
      if (wanted) trouble.value = /** @type {Error} */ (error).message;
    }
  }, GAP);
  const stop = effect(() => {
    const now = subject.value;
    const seen = views.value;
    const show_in = [...new Set(panes.value.map(({ frame }) => frame))];
    wanted = now !== null && seen.length > 0;
    if (now === null || !wanted) {
      pace.stop();
      told.value = null;
      trouble.value = null;
    } else pace.ask({ key: now.key, views: fewer(seen, show_in), options: options.value, show_in });
  });
  return () => {
    wanted = false;
    stop();
    pace.stop();
    told.value = null;
  };
}

/** Those in sight, and of the others as many as may be asked for, evenly. @param {import("../../store.js").MaskView[]} all @param {number[]} inSight */
function fewer(all, inSight) {
  if (all.length <= MOST_VIEWS) return all;
  const first = all.filter(({ frame }) => inSight.includes(frame));
  const rest = all.filter(({ frame }) => !inSight.includes(frame));
  const room = MOST_VIEWS - first.length;
  return [...first, ...Array.from({ length: room }, (_, i) => rest[Math.floor((i * rest.length) / room)])];
}
