/** The live line of a session: what the server says goes into the store, the view goes to the scene. */

import * as api from "./api.js";
import { batch, effect } from "./lib/view.js";
import * as store from "./store.js";

/** @typedef {import("./store.js").Box} Box */
/** @typedef {import("./store.js").ObjectClass} ObjectClass */

/** Milliseconds until the next attempt, one after the other. */
const PATIENCE = [200, 500, 1000, 2000, 4000];
/** Milliseconds without a word after which a line is taken for dead: the server says something every 15 seconds. */
const SILENCE = 40_000;
/** The session was deleted. */
const GONE = 4410;
/** Closed for good: a new line would fare no better. See `Close` in api/live_line.py; 1009: the view is too large. */
const HOPELESS = new Set([1008, 1009, 4400, 4403, 4404, 4409, 4410]);

/** The page's own name, also that of its scene. */
export const view = api.randomName();

/** @type {{send: (message: object) => void, close: () => void} | null} */
let line = null;
let failures = 0;
/** Whether the server has let the line in that is there now, or was last. */
let letIn = false;
/** Edits that come while the session is read anew; null: it is not. @type {import("./store.js").Edit[] | null} */
let meanwhile = null;

/** @param {object} message dropped while the line is lost: the view is sent whole when it is open again */
export function send(message) {
  line?.send(message);
}

/** Load the session and keep it up to date. Rejects with an ApiError where there is none. @param {string} sid */
export async function follow(sid) {
  store.sid.value = sid;
  await load();
  connect();
  effect(sendView);
  addEventListener("online", hurry);
  document.addEventListener("visibilitychange", () => document.visibilityState === "visible" && hurry());
}

async function load() {
  const sid = store.sid.value;
  // The session first: edits made while the rest is read come again over the line, and change nothing twice.
  const session = await api.session(sid);
  const [boxes, classes, masks] = await Promise.all([api.boxes(sid), api.classes(sid), api.masks(sid)]);
  batch(() => {
    store.session.value = session;
    store.boxes.value = new Map(boxes.map((box) => [box.id, box]));
    store.classes.value = new Map(classes.map((one) => [one.id, one]));
    store.masks.value = new Map(masks.map((mask) => [mask.id, mask]));
    store.revision.value = session.revision;
    if (!store.isObject(store.selected.value ?? -1)) store.selected.value = null;
  });
}

/** The server went back to an earlier state, as from a backup: what this page knew is worth nothing. */
async function loadAnew() {
  meanwhile = [];
  try {
    await load();
  } catch (error) {
    if (!(error instanceof api.ApiError)) throw error;
    store.setProblem("page", error.message);
  } finally {
    const edits = meanwhile;
    meanwhile = null;
    batch(() => edits.forEach(takeEdit));
  }
}

/** @type {ReturnType<typeof setTimeout> | undefined} */
let waiting;
/** @type {ReturnType<typeof setTimeout> | undefined} */
let silence;
let heardAt = 0;

function connect() {
  clearTimeout(waiting);
  waiting = undefined;
  letIn = false;
  line = api.openLine(store.sid.value, view, store.revision.value, {
    opened: () => {
      failures = 0;
      letIn = true;
      store.line.value = "open";
      store.setProblem("page", null);
      sayHello();
      sendView();
    },
    message: (message) => {
      heard();
      take(message);
    },
    closed: lost,
  });
  heard();
}

/** @param {number} code @param {string} reason */
function lost(code, reason) {
  clearTimeout(silence);
  line = null;
  store.people.value = [];
  store.line.value = "lost";
  // The server has cancelled drags of this page; of others' nothing is heard any more.
  store.preview.value = null;
  store.dragged.value = null;
  if (HOPELESS.has(code)) {
    // That the session was deleted has been said, with the remedy.
    if (code !== GONE) store.setProblem("page", `${reason || "The session cannot be reached any more"}. Load the page again.`);
    return;
  }
  if (!letIn) void lookForLogin();
  waiting = setTimeout(connect, PATIENCE[Math.min(failures++, PATIENCE.length - 1)]);
}

/** Browsers do not tell why a line was not let in. */
async function lookForLogin() {
  try {
    await api.session(store.sid.value);
  } catch (error) {
    if (!(error instanceof api.ApiError)) throw error;
    if (error.status !== 401) return;
    // The server answers with the page that says how to log in.
    if (store.unsaved.value === 0) location.reload();
    else store.setProblem("page", "This browser is logged out. Log in in another tab: what is not saved yet is saved then.");
  }
}

function heard() {
  heardAt = Date.now();
  clearTimeout(silence);
  silence = setTimeout(giveUp, SILENCE);
}

/** A line whose other end vanished, as it does while a laptop sleeps, is closed by nobody. */
function giveUp() {
  line?.close();
  lost(1006, "");
}

/** Try again now: the laptop woke up, the network is back. */
function hurry() {
  if (line !== null && Date.now() - heardAt > SILENCE) giveUp();
  if (waiting === undefined) return;
  failures = 0;
  connect();
}

/** The name that others see; kept in this browser. @param {string} name */
export function introduce(name) {
  localStorage.setItem("ars-web.name", name);
  sayHello();
}

function sayHello() {
  send({ type: "hello", name: localStorage.getItem("ars-web.name") ?? "" });
}

function sendView() {
  send({
    type: "view",
    mode: store.mode.value === "frame" ? "frame" : "scene",
    frame: store.frame.value,
    selected: store.selected.value === store.NEW ? null : store.selected.value,
    tool: store.tool.value === "points" ? "select" : store.tool.value,
    axes: store.axes.value,
    snap_length: store.snapLength.value,
    snap_angle: (store.snapAngle.value * Math.PI) / 180,
    upright: store.upright.value,
    hidden: [...store.hidden.value],
    dark: store.theme.value === "dark",
    ...coverageView(),
  });
}

/** What Coverage mode has the scene show beside the boxes. */
function coverageView() {
  const box = store.sphereBox.value;
  if (store.mode.value !== "coverage") return {};
  const { by, index } = store.direction.value ?? {};
  return {
    coverage: box === null ? null : {
      box_id: box,
      whole_class: "class_id" in (store.seen.value ?? {}),
      ...store.binsOf(store.counting.value),
      min_visible: store.counting.value.min_visible,
      chosen_bin: by === "angle" ? index : null,
      chosen_cell: by === "area" ? index : null,
    },
    tour: store.tour.value,
  };
}

/** @param {any} message */
function take(message) {
  switch (message.type) {
    case "ready":
      return;
    case "reset":
      void loadAnew();
      return;
    case "edit":
      if (meanwhile !== null) meanwhile.push(message.edit);
      else batch(() => takeEdit(message.edit));
      return;
    case "gone":
      store.setProblem("page", "This session was deleted. It can be brought back from the sessions page.");
      return;
    case "here":
      store.people.value = message.people;
      return;
    case "picked":
      batch(() => picked(message));
      return;
    case "direction":
      store.setProblem("scene", null);
      store.direction.value = store.byArea.value ? { by: "area", index: message.cell } : { by: "angle", index: message.bin };
      return;
    case "entered":
      if (message.frame === store.frame.value) store.entered.value = message.frame;
      return;
    case "dragged":
      batch(() => takeDrag(message));
      return;
    case "conflicted":
      batch(() => {
        store.preview.value = null;
        store.conflict.value = { box_id: message.yours.box_id, detail: message.detail, yours: message.yours, current: message.current };
      });
      return;
    case "refused":
      store.setProblem("scene", message.detail);
      return;
    default:
      throw new Error(`the server sent a message of type ${message.type}`);
  }
}

/** @param {{box_id: number | null, frame: number | null}} what */
function picked({ box_id, frame }) {
  store.setProblem("scene", null);
  if (box_id !== null) store.selected.value = box_id;
  else if (frame !== null) store.actions.enterFrame(frame);
  else store.selected.value = null;
}

/** @param {any} message */
function takeDrag(message) {
  const going = message.phase === "start" || message.phase === "move";
  store.preview.value = going
    ? { box_id: message.box_id, T_world_box: message.T_world_box, size: message.size }
    : null;
  if (!message.own) return;
  store.dragged.value = going ? { text: message.text, x: store.dragged.value?.x ?? 0, y: store.dragged.value?.y ?? 0 } : null;
}

/** @param {import("./store.js").Edit} edit */
function takeEdit(edit) {
  const boxes = new Map(store.boxes.value);
  const classes = new Map(store.classes.value);
  const masks = new Map(store.masks.value);
  for (const change of edit.changes) {
    if (change.kind === "box") put(boxes, edit.revision, /** @type {Box | null} */ (change.after), /** @type {number} */ (change.id));
    else if (change.kind === "class") put(classes, edit.revision, withMesh(/** @type {ObjectClass | null} */ (change.after), classes), /** @type {number} */ (change.id));
    else if (change.kind === "mask") put(masks, edit.revision, /** @type {import("./store.js").Mask | null} */ (change.after), /** @type {number} */ (change.id));
    else if (store.session.value !== null) store.session.value = { ...store.session.value, name: String(change.after) };
  }
  store.boxes.value = boxes;
  store.classes.value = classes;
  store.masks.value = masks;
  store.revision.value = Math.max(store.revision.value, edit.revision);
  store.latestEdit.value = edit;
  if (store.selected.value !== null && !store.isObject(store.selected.value)) store.selected.value = null;
}

/**
 * A class of an edit, which has its mesh's digest alone, with what is known of that mesh.
 * @param {ObjectClass | null} after @param {ReadonlyMap<number, ObjectClass>} known
 */
function withMesh(after, known) {
  const mesh = after === null ? null : (known.get(after.id)?.mesh ?? null);
  return after === null || mesh === null || after.mesh?.digest !== mesh.digest ? after : { ...after, mesh };
}

/**
 * @template {{revision: number}} T
 * @param {Map<number, T>} things @param {number} revision @param {T | null} after @param {number} id
 */
function put(things, revision, after, id) {
  const known = things.get(id);
  if (known !== undefined && known.revision >= revision) return;
  if (after === null) things.delete(id);
  else things.set(id, after);
}
