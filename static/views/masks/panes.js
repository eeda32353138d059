/** Which frames are seen side by side, and which of them is at hand. */

import { batch, signal } from "../../lib/view.js";
import * as store from "../../store.js";

/** @typedef {{id: number, frame: number}} Pane `id`: the pane stays the same while its frame changes */

export const MOST = 4;
/** Of the image's sides: what is taken for the object while nothing is outlined. */
const MIDDLE = 0.25;
const PLAIN = /** @type {const} */ ({ orientation: "world", widen_px: 0, ground: null });

export const panes = signal(/** @type {readonly Pane[]} */ ([]));
/** The pane that the film strip and the keys are for, by its place. */
export const active = signal(0);
/** Whether a frame to go with the first is being looked for. */
export const searching = signal(false);

let made = 0;
let search = 0;

/** @param {number} frame @returns {Pane} */
function pane(frame) {
  made += 1;
  return { id: made, frame };
}

export function activeFrame() {
  return panes.value[active.value]?.frame ?? store.frame.value;
}

/** The masks of the subject that were not proposed only, else those too: the frames that one wants to see. */
function maskedFrames() {
  const masks = store.masksOfSelected.peek();
  const sure = masks.filter(({ accepted }) => accepted);
  return (sure.length > 0 ? sure : masks).map(({ frame }) => frame);
}

/** Begin with the frame at hand and one that goes with it, or with the frames that have masks. */
export function open() {
  const masked = maskedFrames();
  const now = store.frame.peek();
  if (masked.length === 0) {
    panes.value = [pane(now)];
    active.value = 0;
    void addPartner(now);
    return;
  }
  const first = masked.includes(now) ? now : masked[0];
  const second = masked.find((frame) => frame !== first);
  batch(() => {
    panes.value = [first, ...(second === undefined ? [] : [second])].map(pane);
    active.value = 0;
    store.actions.goTo(first);
  });
  if (second === undefined) void addPartner(first);
}

/** Another object was selected: its masks come into sight, unless they are or it has none. */
export function follow() {
  const masked = maskedFrames();
  if (masked.length === 0 || panes.peek().some(({ frame }) => masked.includes(frame))) return;
  batch(() => {
    masked.slice(0, panes.peek().length).forEach((frame, at) => put(at, frame));
    store.actions.goTo(activeFrame());
  });
}

/** @param {number} beside */
async function addPartner(beside) {
  const mine = ++search;
  const count = store.frames.peek();
  if (count < 2) return;
  searching.value = true;
  const found = await partnerOf(beside);
  if (mine !== search) return;
  searching.value = false;
  if (panes.value.length === 1) panes.value = [...panes.value, pane(found ?? (beside + Math.ceil(count / 2)) % count)];
}

/** The frame that the server would outline next if the middle of `beside` were the object. @param {number} beside @returns {Promise<number | null>} */
async function partnerOf(beside) {
  try {
    const { width, height } = await store.actions.cameraOf(beside);
    const [x0, y0] = [(width * (1 - MIDDLE)) / 2, (height * (1 - MIDDLE)) / 2];
    const outer = /** @type {[number, number][]} */ ([[x0, y0], [width - x0, y0], [width - x0, height - y0], [x0, height - y0]]);
    const { next_view } = await store.actions.previewHull([{ frame: beside, polygons: [{ outer, holes: [] }] }], PLAIN, []);
    return next_view?.frame ?? null;
  } catch {
    return null; // the page says elsewhere that nobody answers
  }
}

export function leave() {
  search += 1;
  searching.value = false;
}

/** @param {number} at @param {number} frame */
function put(at, frame) {
  panes.value = panes.value.map((one, i) => (i === at ? { ...one, frame } : one));
}

/** @param {number} at @param {number} frame */
export function show(at, frame) {
  const held = Math.max(0, Math.min(store.frames.value - 1, Math.round(frame)));
  batch(() => {
    put(at, held);
    if (at === active.value) store.actions.goTo(held);
  });
}

/** @param {number} at */
export function activate(at) {
  if (at === active.peek() || panes.peek()[at] === undefined) return;
  batch(() => {
    active.value = at;
    store.actions.goTo(panes.value[at].frame);
  });
}

/** @param {number} at */
export function close(at) {
  if (panes.value.length < 2) return;
  batch(() => {
    panes.value = panes.value.filter((_, i) => i !== at);
    if (active.value > at || active.value >= panes.value.length) active.value -= 1;
    store.actions.goTo(activeFrame());
  });
}

/** Bring a frame into sight: where it is, in a pane with nothing drawn in it, or in one more. @param {number} frame */
export function openView(frame) {
  leave();
  const masked = new Set(store.masksOfSelected.value.map((mask) => mask.frame));
  const there = panes.value.findIndex((one) => one.frame === frame);
  if (there >= 0) return activate(there);
  const free = panes.value.findLastIndex((one) => !masked.has(one.frame));
  const at = free >= 0 ? free : panes.value.length < MOST ? panes.value.length : panes.value.findLastIndex((_, i) => i !== active.value);
  batch(() => {
    if (at === panes.value.length) panes.value = [...panes.value, pane(frame)];
    else put(at, frame);
    active.value = at;
    store.actions.goTo(frame);
  });
}

/** One more pane: the frame that narrows the hull most, else the farthest from those that are seen. @param {number | null} suggested */
export function addView(suggested) {
  leave();
  if (panes.value.length >= MOST) return;
  const frame = suggested ?? farthest();
  batch(() => {
    panes.value = [...panes.value, pane(frame)];
    active.value = panes.value.length - 1;
    store.actions.goTo(frame);
  });
}

/** As many panes as this. @param {number} count */
export function arrange(count) {
  leave();
  batch(() => {
    while (panes.value.length > count) close(panes.value.length - 1);
    while (panes.value.length < count) {
      const masked = maskedFrames().find((frame) => panes.value.every((one) => one.frame !== frame));
      panes.value = [...panes.value, pane(masked ?? farthest())];
    }
  });
}

/** The frame in the middle of the longest stretch that no pane shows. */
function farthest() {
  const shown = [-1, ...panes.value.map(({ frame }) => frame), store.frames.value].sort((a, b) => a - b);
  let best = { gap: -1, frame: 0 };
  for (let i = 1; i < shown.length; i += 1) {
    const gap = shown[i] - shown[i - 1];
    if (gap > best.gap) best = { gap, frame: Math.floor((shown[i] + shown[i - 1]) / 2) };
  }
  return Math.max(0, Math.min(store.frames.value - 1, best.frame));
}
