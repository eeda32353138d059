/** Everything frequent, once: what the keys, the palette, the key list and the tool rail all take from. */

import { angleBetween, uprighted } from "../lib/rotation.js";
import * as store from "../store.js";
import { toggleAsExported } from "./as_exported.js";
import { maskCommands, removeMask, stepDrawing } from "./masks/commands.js";
import { begin } from "./masks/subject.js";
import * as sight from "./photo_sight.js";

/**
 * @typedef {object} Command
 * @property {string} id
 * @property {string} title
 * @property {"View" | "Frames" | "Tools" | "Masks" | "Box" | "Session"} group
 * @property {string[]} keys as `chord` writes them; the first is shown
 * @property {() => void} run
 * @property {() => boolean} [when] whether it can be done now
 * @property {boolean} [repeats] it is done again and again while its key is held down
 */

const { actions } = store;

/** Radians, by which a box may lean and stand upright: far less than is seen. */
const TILT = 1e-6;

const hasBox = () => store.selectedBox.value !== null;
const canEdit = () => hasBox() && !store.selectedBox.value?.locked;
const inMasks = () => store.mode.value === "masks";
/** Where boxes are seen in 3D, and not hidden behind panes or options. */
const inPlace = () => store.mode.value !== "export" && !inMasks();
const inFrame = () => store.mode.value === "frame";

/** Run an action on the selected box; what goes wrong is shown at the box. @param {(id: number) => Promise<void>} action */
function onBox(action) {
  const id = store.selected.value;
  if (id === null) return;
  void store.attempt(`box:${id}`, () => action(id));
}

/** @param {import("../store.js").Mode} mode */
function goMode(mode) {
  store.mode.value = mode;
}

/** @param {import("../store.js").Tool} tool */
function take(tool) {
  store.tool.value = tool;
  if (!inPlace()) goMode("scene");
}

/** In a frame, where the camera stays, the photo is zoomed to the box instead. */
const lookAtBox = () => (inFrame() ? sight.zoomToBox() : actions.look("selected"));

/** What is to be kept upright is stood upright first. */
function keepUpright() {
  store.upright.value = !store.upright.value;
  const box = store.selectedBox.value;
  if (!store.upright.value || box === null || box.locked) return;
  const { position, wxyz } = box.T_world_box;
  const standing = uprighted(wxyz);
  if (angleBetween(standing, wxyz) < TILT) return;
  actions.editBox(box.id, { size: box.size, T_world_box: { position, wxyz: standing } });
}

/** @param {number} step */
const stepFrame = (step) => actions.goTo(store.frame.value + step);

/**
 * Arrows move the selected box, or turn it with the rotate tool; without a box they step through the frames.
 * @param {0 | 1 | 2} axis @param {number} sign @param {number} times
 */
function arrow(axis, sign, times) {
  if (!hasBox()) {
    if (axis === 0) stepFrame(sign * (times === 1 ? 1 : store.jump.value));
    return;
  }
  /** @param {number} size @returns {[number, number, number]} */
  const along = (size) => [axis === 0 ? size : 0, axis === 1 ? size : 0, axis === 2 ? size : 0];
  const box = store.selectedBox.value;
  if (store.tool.value === "rotate") {
    actions.nudge([0, 0, 0], along(sign * 0.2 * times));
  } else if (store.tool.value === "resize" && box !== null) {
    const step = along(sign * 0.001 * times);
    actions.editBox(box.id, {
      T_world_box: box.T_world_box,
      size: /** @type {[number, number, number]} */ ([0, 1, 2].map((i) => Math.max(0.001, box.size[i] + step[i]))),
    });
  } else {
    actions.nudge(along(sign * 0.001 * times), [0, 0, 0]);
  }
}

/** @returns {Command[]} */
function arrows() {
  /** @type {[string, string, 0 | 1 | 2, number][]} */
  const four = [
    ["right", "ArrowRight", 0, 1],
    ["left", "ArrowLeft", 0, -1],
    ["up", "ArrowUp", 1, 1],
    ["down", "ArrowDown", 1, -1],
    ["z-up", "PageUp", 2, 1],
    ["z-down", "PageDown", 2, -1],
  ];
  return four.flatMap(([id, key, axis, sign]) =>
    [1, 10].map((times) => ({
      id: `nudge-${id}${times === 10 ? "-10" : ""}`,
      title: `Nudge the box ${sign > 0 ? "+" : "−"}${"XYZ"[axis]}${times === 10 ? ", 10 times as far" : ""}`,
      group: /** @type {const} */ ("Box"),
      keys: [times === 10 ? `Shift+${key}` : key],
      run: () => arrow(axis, sign, times),
      when: () => inPlace() && (axis === 0 || hasBox()),
      repeats: true,
    })),
  );
}

/** @type {Command[]} */
export const commands = [
  ...maskCommands,
  { id: "mode-scene", title: "Scene", group: "View", keys: ["1"], run: () => goMode("scene") },
  { id: "mode-frame", title: "Frame", group: "View", keys: ["2"], run: () => actions.enterFrame() },
  { id: "mode-masks", title: "Masks", group: "View", keys: ["3"], run: () => goMode("masks") },
  { id: "mode-coverage", title: "Coverage", group: "View", keys: ["4"], run: () => goMode("coverage") },
  { id: "mode-export", title: "Export", group: "View", keys: ["5"], run: () => goMode("export") },
  {
    id: "toggle-frame",
    title: "Enter or leave the current frame",
    group: "View",
    keys: ["F"],
    run: () => (store.mode.value === "frame" ? actions.leaveFrame() : actions.enterFrame()),
  },
  { id: "look-all", title: "Look at everything", group: "View", keys: ["Home"], run: () => actions.look("all"), when: inPlace },
  { id: "look-selected", title: "Look at the selected box", group: "View", keys: ["L"], run: lookAtBox, when: () => inPlace() && hasBox() },
  { id: "look-frame", title: "Look at the current frame's camera", group: "View", keys: ["Shift+L"], run: () => actions.look("frame"), when: inPlace },
  {
    id: "contact-sheet",
    title: "Contact sheet",
    group: "View",
    keys: ["C"],
    run: () => (store.overlay.value = "contact-sheet"),
  },
  {
    id: "blend",
    title: "Photo on or off",
    group: "View",
    keys: ["X"],
    run: () => (store.blend.value = store.blend.value > 0 ? 0 : 1),
    when: inFrame,
  },
  { id: "as-exported", title: "As exported, or not", group: "View", keys: ["O"], run: toggleAsExported, when: inFrame },
  { id: "zoom-in", title: "Zoom in", group: "View", keys: ["+", "="], run: sight.zoomIn, when: inFrame, repeats: true },
  { id: "zoom-out", title: "Zoom out", group: "View", keys: ["-"], run: sight.zoomOut, when: inFrame, repeats: true },
  { id: "whole-photo", title: "Whole photo", group: "View", keys: ["0"], run: sight.wholePhoto, when: inFrame },
  {
    id: "theme",
    title: "Dark or light",
    group: "View",
    keys: [],
    run: () => (store.theme.value = store.theme.value === "dark" ? "light" : "dark"),
  },

  { id: "next", title: "Next frame", group: "Frames", keys: ["."], run: () => stepFrame(1), repeats: true },
  { id: "previous", title: "Previous frame", group: "Frames", keys: [","], run: () => stepFrame(-1), repeats: true },
  { id: "jump-on", title: "Jump on", group: "Frames", keys: ["Shift+."], run: () => stepFrame(store.jump.value), repeats: true },
  { id: "jump-back", title: "Jump back", group: "Frames", keys: ["Shift+,"], run: () => stepFrame(-store.jump.value), repeats: true },
  { id: "first", title: "First frame", group: "Frames", keys: ["Ctrl+Home"], run: () => actions.goTo(0) },
  { id: "last", title: "Last frame", group: "Frames", keys: ["Ctrl+End"], run: () => actions.goTo(store.frames.value - 1) },

  { id: "select", title: "Select", group: "Tools", keys: ["V"], run: () => take("select") },
  { id: "move", title: "Move", group: "Tools", keys: ["G"], run: () => take("move") },
  { id: "rotate", title: "Rotate", group: "Tools", keys: ["R"], run: () => take("rotate") },
  { id: "resize", title: "Resize by its faces", group: "Tools", keys: ["S"], run: () => take("resize") },
  {
    id: "new-box",
    title: "New box where the view looks, or new object to outline",
    group: "Tools",
    keys: ["B"],
    run: () => {
      const known = store.classOfNew.value;
      if (known === null) store.setProblem("boxes", "A box needs a class: add one below first.");
      else if (inMasks()) begin(known);
      else actions.newBox(known);
    },
    when: () => store.mode.value !== "export",
  },
  { id: "points", title: "Box from four points", group: "Tools", keys: ["P"], run: () => take("points") },
  {
    id: "axes",
    title: "Box axes or world axes",
    group: "Tools",
    keys: ["T"],
    run: () => (store.axes.value = store.axes.value === "box" ? "world" : "box"),
  },
  { id: "upright", title: "Stand upright, and keep so", group: "Tools", keys: ["U"], run: keepUpright },
  {
    id: "snap",
    title: "Snap to 1 mm and 1°",
    group: "Tools",
    keys: ["N"],
    run: () => {
      const on = store.snapLength.value === 0 && store.snapAngle.value === 0;
      store.snapLength.value = on ? 0.001 : 0;
      store.snapAngle.value = on ? 1 : 0;
    },
  },

  ...arrows(),
  { id: "ground", title: "Rest on the ground", group: "Box", keys: ["E"], run: () => onBox(actions.restOnGround), when: () => canEdit() && !inMasks() },
  { id: "duplicate", title: "Duplicate", group: "Box", keys: ["Ctrl+D"], run: () => onBox(actions.duplicateBox), when: () => hasBox() && !inMasks() },
  { id: "delete", title: "Delete", group: "Box", keys: ["Delete", "Backspace"], run: () => (inMasks() ? removeMask() : onBox(actions.deleteBox)), when: () => inMasks() || canEdit() },
  {
    id: "hide",
    title: "Hide or show",
    group: "Box",
    keys: ["H"],
    run: () => {
      const id = store.selected.value;
      const next = new Set(store.hidden.value);
      if (id !== null && !next.delete(id)) next.add(id);
      store.hidden.value = next;
    },
    when: hasBox,
  },
  {
    id: "show-all",
    title: "Show all boxes",
    group: "Box",
    keys: ["Shift+H"],
    run: () => (store.hidden.value = new Set()),
    when: () => store.hidden.value.size > 0,
  },
  {
    id: "lock",
    title: "Lock or unlock",
    group: "Box",
    keys: ["K"],
    run: () => onBox((id) => actions.changeBox(id, { locked: !store.selectedBox.value?.locked })),
    when: hasBox,
  },
  { id: "next-box", title: "Next box", group: "Box", keys: ["]"], run: () => stepBox(1), when: () => store.boxes.value.size > 0, repeats: true },
  { id: "previous-box", title: "Previous box", group: "Box", keys: ["["], run: () => stepBox(-1), when: () => store.boxes.value.size > 0, repeats: true },

  { id: "undo", title: "Undo", group: "Session", keys: ["Ctrl+Z"], run: () => stepDrawing("undo") || void actions.undo(), repeats: true },
  { id: "redo", title: "Redo", group: "Session", keys: ["Ctrl+Shift+Z", "Ctrl+Y"], run: () => stepDrawing("redo") || void actions.redo(), repeats: true },
  {
    id: "history",
    title: "History",
    group: "Session",
    keys: ["Y"],
    run: () => (store.sidePanel.value = store.sidePanel.value === "history" ? "boxes" : "history"),
  },
  {
    id: "introduce",
    title: "Your name, as others here see it",
    group: "Session",
    keys: [],
    run: () => {
      const mine = store.people.value.find((person) => person.own)?.name ?? "";
      const name = window.prompt("Your name, as others at this session see it", mine);
      if (name !== null) actions.introduce(name.trim());
    },
  },
  { id: "palette", title: "All commands", group: "Session", keys: ["Ctrl+K"], run: () => (store.overlay.value = "palette") },
  { id: "help", title: "Keys", group: "Session", keys: ["?"], run: () => (store.overlay.value = "help") },
  { id: "back", title: "Back out one step", group: "Session", keys: ["Escape"], run: backOut },
];

/** @param {number} step */
function stepBox(step) {
  const ids = [...store.boxes.value.keys()];
  const at = ids.indexOf(store.selected.value ?? -1);
  actions.select(ids[(at + step + (at < 0 && step < 0 ? 1 : 0) + ids.length) % ids.length]);
}

/** The chosen direction first. */
function leaveCoverage() {
  if (store.direction.value !== null) store.direction.value = null;
  else goMode("scene");
}

function backOut() {
  if (store.overlay.value !== null) store.overlay.value = null;
  else if (inMasks()) goMode("scene");
  else if (store.tool.value !== "select") store.tool.value = "select";
  else if (store.mode.value === "coverage") leaveCoverage();
  else if (store.selected.value !== null) store.selected.value = null;
  else if (store.mode.value === "frame") actions.leaveFrame();
  else if (store.mode.value !== "scene") goMode("scene");
}

/** @param {string} id */
export function command(id) {
  const found = commands.find((one) => one.id === id);
  if (found === undefined) throw new Error(`there is no command ${id}`);
  return found;
}

/**
 * How a key event is written in `keys`: `Ctrl+Shift+Z`, `Shift+.`, `?`. Command on a Mac counts as Ctrl.
 * @param {{key: string, code: string, ctrlKey: boolean, metaKey: boolean, shiftKey: boolean}} event
 */
export function chord({ key, code, ctrlKey, metaKey, shiftKey }) {
  // Shift changes what these keys write, and keyboards differ in it: they are named by what they write without it.
  const plain = { Comma: ",", Period: "." }[code];
  const named = plain ?? (key.length === 1 ? key.toUpperCase() : key);
  const withShift = shiftKey && (plain !== undefined || key.length > 1 || /\p{L}/u.test(key));
  return `${ctrlKey || metaKey ? "Ctrl+" : ""}${withShift ? "Shift+" : ""}${named}`;
}

/**
 * Run what a key stands for.
 * @param {Parameters<typeof chord>[0] & {altKey: boolean, repeat?: boolean}} event
 * @returns {boolean} whether it stood for something that can be done now
 */
export function press(event) {
  // Many keyboards write brackets by AltGr, which some systems tell as Alt or as Ctrl and Alt.
  const bracket = /^[[\]]$/.test(event.key);
  if (event.altKey && !bracket) return false;
  const written = bracket ? event.key : chord(event);
  const found = commands.find((one) => one.keys.includes(written) && (one.when?.() ?? true));
  // What lies over the workspace has keys of its own.
  if (found === undefined || (store.overlay.value !== null && found.id !== "back")) return false;
  if (!event.repeat || found.repeats) found.run();
  return true;
}
