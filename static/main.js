/** Joins the server's answers and the views. */

import * as api from "./api.js";
import { press } from "./views/commands.js";
import * as editing from "./editing.js";
import { followTheme } from "./lib/theme.js";
import { effect, h, render } from "./lib/view.js";
import * as line from "./line.js";
import * as maskEditing from "./mask_editing.js";
import * as store from "./store.js";

const PAGE = /** @type {HTMLElement} */ (document.getElementById("page"));
/** How many names of frames are asked for at once. */
const NAMES = 200;

const sid = () => store.sid.value;
/** Where leaving a frame leads back to. @type {"scene" | "coverage"} */
let cameFrom = "scene";

Object.assign(
  store.actions,
  /** @satisfies {import("./store.js").Actions} */ ({
    changeBox: editing.changeBox,
    editBox: editing.editBox,
    finishEdit: editing.finishEdit,
    nudge: editing.nudge,
    deleteBox: editing.deleteBox,
    duplicateBox: editing.duplicateBox,
    restOnGround: editing.restOnGround,
    newBox: (classId) => {
      if (store.line.value === "open") line.send({ type: "new-box", class_id: classId });
      else store.setProblem("boxes", "The server is not reached just now: add the box once it is.");
    },
    boxFromPoints: editing.boxFromPoints,
    locatePoint: (observations) => api.locatePoint(sid(), observations),
    epipolar: async (of, frame) => (await api.epipolar(sid(), of, frame)).lines,
    putMask: maskEditing.putMask,
    acceptMask: maskEditing.acceptMask,
    deleteMask: maskEditing.deleteMask,
    makeHull: maskEditing.makeHull,
    previewHull: (views, { orientation, widen_px, ground }, show_in) => api.previewHull(sid(), { views, orientation, widen_px, ground, show_in }),
    combine: async (change) => (await api.combine(sid(), change)).polygons,
    segment: async (frame, prompt) => (await api.segment(sid(), frame, prompt)).polygons,
    outlineRest: (id) => api.outlineRest(sid(), id),
    outlineState: (id) => api.outlineState(sid(), id),
    cancelOutline: (id) => api.cancelOutline(sid(), id),
    refineBox: maskEditing.refineBox,
    addClass: editing.addClass,
    changeClass: editing.changeClass,
    putClassMesh: editing.putClassMesh,
    deleteClassMesh: editing.deleteClassMesh,
    completeClass: editing.completeClass,
    deleteClass: editing.deleteClass,
    overrule: editing.overrule,
    undo: () => editing.stepHistory("undo"),
    redo: () => editing.stepHistory("redo"),
    history: (before) => api.history(sid(), before),
    renameSession: editing.renameSession,

    goTo,
    enterFrame: (index) => {
      if (index !== undefined) goTo(index);
      store.tool.value = store.tool.value === "points" ? "select" : store.tool.value;
      if (store.mode.value !== "frame") cameFrom = store.mode.value === "coverage" ? "coverage" : "scene";
      store.mode.value = "frame";
    },
    leaveFrame: () => (store.mode.value = cameFrom),
    look: (at) => {
      if (store.mode.value !== "scene" && store.mode.value !== "coverage") store.mode.value = "scene";
      line.send({ type: "look", at });
    },
    introduce: line.introduce,
    select: (id) => (store.selected.value = id),
    tellingFrames: (id) => api.tellingFrames(sid(), id),
    labelsOf: (boxes, frames) => api.labelsOf(sid(), boxes, frames),
    frameLabels: (index) => api.frameLabels(sid(), index),
    frameMarks: (index, labelFunction, shape, signal) => api.frameMarks(sid(), index, labelFunction, shape, signal),
    imageAddress: (index, options) => api.imageAddress(sid(), index, options),
    imageProblem: (index) => api.imageProblem(sid(), index),
    frameName: async (index) => (await framesAround(index))[index % NAMES]?.name ?? "",
    cameras,
    cameraOf: async (index) => {
      const { camera_id } = (await framesAround(index))[index % NAMES];
      const found = (await cameras()).find((camera) => camera.id === camera_id);
      if (found === undefined) throw new Error(`frame ${index} names camera ${camera_id}, which the session does not have`);
      return found;
    },

    coverage: (of, counting, signal) => api.coverage(sid(), of, counting, signal),
    coverageOfObjects: async (counting, signal) => (await api.coverageOfObjects(sid(), counting, signal)).items,
    coverageFrames: (of, counting, direction, signal) => api.coverageFrames(sid(), of, counting, direction, signal),
    planTour: (wish) => api.planTour(sid(), wish),
    reportAddress: (options = {}) => api.reportAddress(sid(), options),
    coverageAddress: (of, counting, as) => api.coverageAddress(sid(), of, counting, as),

    formats: api.formats,
    previewExport: (format, options, signal) => api.previewExport(sid(), format, options, signal),
    exportPicture: (format, options, signal) => api.exportPicture(sid(), format, options, signal),
    startExport: (format, options) => api.startExport(sid(), format, options),
    exports: () => api.exports(sid()),
    exportState: api.exportState,
    cancelExport: api.cancelExport,
    removeExport: api.removeExport,
    downloadAddress: api.downloadAddress,

    sessions: api.sessions,
    renameOf: (session, name) => api.renameSession(session.id, session.revision, name),
    deleteSession: (session) => api.deleteSession(session.id, session.revision),
    restoreSession: api.restoreSession,
    skipped: api.skipped,
    thumbnailAddress: (id, index, width) => api.imageAddress(id, index, { width }),
    roots: api.roots,
    folders: api.folders,
    lookAtRecording: api.lookAtRecording,
    lookImageAddress: api.lookImageAddress,
    upload: api.upload,
    startImport: api.startImport,
    importState: api.importState,
    cancelImport: api.cancelImport,
    health: api.health,
  }),
);

/** @type {Promise<store.Camera[]> | undefined} */
let knownCameras;
/** Recordings do not change: cameras and frames are asked for once. @type {Map<number, Promise<store.Schemas["FrameJson"][]>>} */
const knownFrames = new Map();

function cameras() {
  knownCameras ??= api.cameras(sid());
  return knownCameras;
}

/** The frames of the block that `index` is in. @param {number} index */
function framesAround(index) {
  const block = Math.floor(index / NAMES);
  let found = knownFrames.get(block);
  if (found === undefined) {
    found = api.frames(sid(), block * NAMES, NAMES).then((page) => page.items);
    found.catch(() => knownFrames.delete(block));
    knownFrames.set(block, found);
  }
  return found;
}

/** @param {number} index */
function goTo(index) {
  store.frame.value = Math.max(0, Math.min(store.frames.value - 1, Math.round(index)));
}

/** @param {string} id */
async function openWorkspace(id) {
  const [{ Workspace }] = await Promise.all([import("./views/workspace.js"), line.follow(id)]);
  editing.connect(line.send);
  restoreView();
  document.title = "ARS Web";
  effect(() => void (document.title = `${store.session.value?.name ?? ""} · ARS Web`));
  effect(keepView);
  addEventListener("keydown", (event) => {
    if (!isTyping(event) && press(event)) event.preventDefault();
  });
  addEventListener("beforeunload", (event) => {
    void editing.finishEdit();
    if (store.unsaved.value > 0) event.preventDefault();
  });
  render(h(Workspace, { view: line.view }), PAGE);
}

/** Whether a key goes into a field. @param {KeyboardEvent} event */
function isTyping({ target, key, ctrlKey, metaKey }) {
  if (!(target instanceof HTMLElement)) return false;
  // Sliders and choices are moved by these.
  if (target instanceof HTMLInputElement && ["range", "radio"].includes(target.type) && /^(Arrow|Page|Home|End)/.test(key)) return true;
  // A number that nothing was typed into has nothing of its own to undo.
  if ((ctrlKey || metaKey) && target.dataset.typing === "false") return false;
  const takesText = target instanceof HTMLInputElement && !["range", "checkbox", "radio", "color"].includes(target.type);
  return takesText || target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement || target.isContentEditable;
}

/** The place in the recording is part of the address: a reload, or whom it is sent to, comes back to it. */
function keepView() {
  const parts = new URLSearchParams();
  parts.set("frame", String(store.frame.value));
  if (store.mode.value !== "scene") parts.set("mode", store.mode.value);
  if (store.selected.value !== null && store.selected.value !== store.NEW) parts.set("box", String(store.selected.value));
  clearTimeout(keeping);
  // Browsers refuse hundreds of these a minute, which scrubbing would be.
  keeping = setTimeout(() => history.replaceState(null, "", `#${parts}`), 300);
}
/** @type {ReturnType<typeof setTimeout> | undefined} */
let keeping;

function restoreView() {
  const parts = new URLSearchParams(location.hash.slice(1));
  const mode = parts.get("mode");
  const box = Number(parts.get("box") ?? NaN);
  goTo(Number(parts.get("frame") ?? Math.floor(store.frames.value / 2)) || 0);
  if (mode === "frame" || mode === "masks" || mode === "coverage" || mode === "export") store.mode.value = mode;
  if (store.isObject(box)) store.selected.value = box;
}

async function openSessions() {
  const { SessionsPage } = await import("./views/sessions/page.js");
  render(h(SessionsPage, {}), PAGE);
}

async function open() {
  followTheme(store.theme);
  const inside = location.pathname.match(/^\/sessions\/([^/]+)\/?$/);
  try {
    await (inside ? openWorkspace(decodeURIComponent(inside[1])) : openSessions());
  } catch (error) {
    if (!(error instanceof api.ApiError)) throw error;
    // Logged out: the server answers with the page that says how to log in.
    if (error.status === 401) return location.reload();
    const { Failure } = await import("./views/failure.js");
    render(h(Failure, { message: error.message }), PAGE);
  }
}

void open();
