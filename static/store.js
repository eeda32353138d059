/**
 * What the page knows: the session as the server last told it, and the view, which is the page's own.
 *
 * Views read these signals and call `actions`; they never talk to the server themselves.
 */

import { computed, signal } from "./lib/view.js";

/** @typedef {import("./api-types.js").components["schemas"]} Schemas */
/** @typedef {Schemas["SessionJson"]} Session */
/** @typedef {Schemas["BoxAnswer"]} Box */
/** @typedef {Schemas["ClassAnswer"]} ObjectClass */
/** How a class's objects look the same. @typedef {Partial<Schemas["SymmetryAnswer"]> & {kind: Schemas["SymmetryAnswer"]["kind"]}} SymmetryDraft */
/** @typedef {Schemas["KeypointAnswer"]} Keypoint */
/** @typedef {Schemas["EditJson"]} Edit */
/** @typedef {Schemas["CameraJson"]} Camera */
/** @typedef {Schemas["ExportJson"]} Export */
/** @typedef {{position: [number, number, number], wxyz: [number, number, number, number]}} Transform */
/** @typedef {[number, number]} Corner in image coordinates of the original image */
/** @typedef {Schemas["PolygonAnswer"]} Polygon */
/** An object's outline in one frame. Its box may not be made yet. @typedef {Schemas["MaskAnswer"]} Mask */
/** @typedef {Mask["origin"]} MaskOrigin */

/** How a hull is made of masks. @typedef {Omit<Schemas["HullOptionsJson"], "position" | "fitted"> & {fitted?: boolean}} HullOptions */
/** @typedef {{frame: number, polygons: readonly Polygon[]}} MaskView */
/** What an object looks like in one frame, as far as a person has said. @typedef {{rectangle?: [number, number, number, number], inside?: Corner[][], outside?: Corner[][], brush_width?: number, start?: Polygon[]}} SegmentPrompt */

/** What outlines give, before anything of it is stored. @typedef {Schemas["HullPreviewAnswer"]} HullPreview */

/** Masks being made by the server in further frames. @typedef {Schemas["OutlineJobAnswer"]} OutlineJob */
/** How well a box fits what was drawn. @typedef {Schemas["RefinedAnswer"]} Refinement */

/**
 * A box's place and size while it is dragged or typed; nothing of it is stored yet.
 * @typedef {object} BoxPreview
 * @property {number} box_id
 * @property {Transform} T_world_box
 * @property {[number, number, number]} size metres
 */

/** From where objects are seen. @typedef {Schemas["CoverageJson"]} Coverage */
/** Where to look next. @typedef {Schemas["TourJson"]} Tour */
/** Whose views are counted: an object's, or those of a class's objects together. @typedef {{box_id: number} | {class_id: number}} Seen */
/** How views are counted: degrees a bin is wide, and how much of an object a view must show. @typedef {{degrees: number, min_visible: number}} Counting */
/** A bin of equal angles, azimuth bin * polar bins + polar bin, or a cell of equal area. @typedef {{by: "angle" | "area", index: number}} Direction */

/**
 * A recording that may become a session: below a declared root, or in an upload; paths are relative to it.
 * @typedef {{root?: string, upload?: string, path: string, format: string, images?: string, camera?: string}} Source
 */

/** @typedef {"scene" | "frame" | "masks" | "coverage" | "export"} Mode */
/** @typedef {"select" | "move" | "rotate" | "resize" | "points"} Tool */

/**
 * Someone at this session; `own`: this very page.
 * @typedef {{view: string, author: string, name: string, frame: number | null, selected: number | null, mode: string, own: boolean}} Person
 */

/**
 * An edit of ours that met somebody else's.
 * @typedef {object} Conflict
 * @property {number} box_id
 * @property {string} detail
 * @property {BoxPreview} yours
 * @property {Box | null} current as it is now; null: deleted
 */

/** The session's id; empty on the sessions page. */
export const sid = signal("");
export const session = signal(/** @type {Session | null} */ (null));
export const boxes = signal(/** @type {ReadonlyMap<number, Box>} */ (new Map()));
export const classes = signal(/** @type {ReadonlyMap<number, ObjectClass>} */ (new Map()));
/** The outlines of objects in frames, by their ids. */
export const masks = signal(/** @type {ReadonlyMap<number, Mask>} */ (new Map()));
/** The newest revision that this page has been told of. */
export const revision = signal(0);
/** The newest edit that came over the line, anybody's. */
export const latestEdit = signal(/** @type {Edit | null} */ (null));
/** Changes of this page that the server has not confirmed yet. */
export const unsaved = signal(0);
/** The line to the server: events come, and edits of others are seen, only while it is open. */
export const line = signal(/** @type {"connecting" | "open" | "lost"} */ ("connecting"));
export const people = signal(/** @type {Person[]} */ ([]));
/** The box being dragged, here or in another browser. */
export const preview = signal(/** @type {BoxPreview | null} */ (null));
/** The box being typed or stepped here, until it is stored; no drag elsewhere takes it away. */
export const typed = signal(/** @type {BoxPreview | null} */ (null));
/** What a drag changes, for beside the pointer; x and y in CSS pixels of the scene. */
export const dragged = signal(/** @type {{text: string, x: number, y: number} | null} */ (null));
export const conflict = signal(/** @type {Conflict | null} */ (null));
/** What went wrong, by the place where it is shown: "page", "scene", "boxes", "box:12", "export", … */
export const problems = signal(/** @type {ReadonlyMap<string, string>} */ (new Map()));

// The view.
export const mode = signal(/** @type {Mode} */ ("scene"));
export const frame = signal(0);
/** The frame that the scene shows with its photo; null while it is on its way. */
export const entered = signal(/** @type {number | null} */ (null));
export const selected = signal(/** @type {number | null} */ (null));
export const tool = signal(/** @type {Tool} */ ("select"));
export const axes = signal(/** @type {"box" | "world"} */ ("box"));
/** Metres; 0: off. */
export const snapLength = signal(0);
/** Degrees; 0: off. */
export const snapAngle = signal(0);
export const upright = signal(false);
export const hidden = signal(/** @type {ReadonlySet<number>} */ (new Set()));
/** How much of the photo is seen over the 3D, 0 to 1. */
export const blend = signal(1);
/** The label function by which photos show objects as exports hold them; empty: by their boxes' edges. */
export const markFunction = signal("");
/** What is drawn so: hulls and meshes where there are some. */
export const markShape = signal(/** @type {"hull" | "box" | "mesh"} */ ("hull"));
/** Of the photo in frame mode. */
export const zoom = signal(1);
/** What lies over everything: the key list, the palette, the contact sheet. */
export const overlay = signal(/** @type {"help" | "palette" | "contact-sheet" | null} */ (null));
export const sidePanel = signal(/** @type {"boxes" | "history"} */ ("boxes"));
/** The class that new boxes get, once somebody chose one; see `classOfNew`. */
export const chosenClass = signal(/** @type {number | null} */ (null));
/** How far "jump" goes. */
export const jump = signal(10);
export const theme = signal(/** @type {"dark" | "light"} */ ("dark"));

export const frames = computed(() => session.value?.frames ?? 0);
/** The boxes as they are seen: with what is dragged and typed in the place of what is stored. */
export const shownBoxes = computed(() => {
  let shown = boxes.value;
  for (const now of [preview.value, typed.value]) {
    const stored = now === null ? undefined : shown.get(now.box_id);
    if (now === null || stored === undefined) continue;
    shown = new Map(shown).set(now.box_id, { ...stored, T_world_box: now.T_world_box, size: now.size });
  }
  return shown;
});
export const selectedBox = computed(() =>
  selected.value === null ? null : (shownBoxes.value.get(selected.value) ?? null),
);

/**
 * An object that has masks and no box yet; `id` is the one that its box will have.
 * @typedef {{id: number, class_id: number}} Draft
 */

/** The selected object while nothing of it is stored: no mask, and so no id. */
export const NEW = 0;
/** The class of the new object that is being drawn; null: none is. */
export const newClass = signal(/** @type {number | null} */ (null));
/** Objects without a box, in the order of their ids. */
export const drafts = computed(() => {
  /** @type {Map<number, Draft>} */
  const found = new Map();
  for (const { box_id, class_id } of masks.value.values()) {
    if (!boxes.value.has(box_id)) found.set(box_id, { id: box_id, class_id });
  }
  return [...found.values()].sort((a, b) => a.id - b.id);
});
/** Whether an id may be selected: of a box, of an object that has masks, or of a new one. @param {number} id */
export function isObject(id) {
  return boxes.value.has(id) || drafts.value.some((draft) => draft.id === id) || (id === NEW && newClass.value !== null);
}
/** Of the selected object, by frame. */
export const masksOfSelected = computed(() =>
  [...masks.value.values()].filter(({ box_id }) => box_id === selected.value).sort((a, b) => a.frame - b.frame),
);

/** The class that a new box gets: the one chosen last, else that of the selected box, else the first; null: there is none. */
export const classOfNew = computed(() => {
  const known = [chosenClass.value, selectedBox.value?.class_id].find((id) => classes.value.has(id ?? -1));
  return known ?? [...classes.value.keys()][0] ?? null;
});

/** A class whose objects' views are counted together; null: those of the selected box, or the first. */
export const coverageClass = signal(/** @type {number | null} */ (null));
/** Whose views are counted; null: there is no box. @type {import("./lib/view.js").ReadonlySignal<Seen | null>} */
export const seen = computed(() => {
  const of = coverageClass.value;
  if (of !== null && [...boxes.value.values()].some((box) => box.class_id === of)) return { class_id: of };
  const box = selectedBox.value ?? firstBox(() => true);
  return box === null ? null : { box_id: box.id };
});
export const counting = signal(/** @type {Counting} */ ({ degrees: 20, min_visible: 0 }));
/** Whether the map has cells of equal area rather than bins of equal angles. */
export const byArea = signal(false);
/** The direction whose frames are shown; of the kind that the map has. */
export const direction = signal(/** @type {Direction | null} */ (null));
/** The cameras of the tour that is shown in the scene. */
export const tour = signal(/** @type {readonly Transform[]} */ ([]));
/** The box that the sphere stands round: of a class the selected one or the first. */
export const sphereBox = computed(() => {
  const of = seen.value;
  if (of === null) return null;
  if ("box_id" in of) return of.box_id;
  const box = selectedBox.value?.class_id === of.class_id ? selectedBox.value : firstBox((one) => one.class_id === of.class_id);
  return box?.id ?? null;
});

/** The box of the least id that is meant. @param {(box: Box) => boolean} isMeant */
function firstBox(isMeant) {
  return [...boxes.value.values()].filter(isMeant).sort((a, b) => a.id - b.id)[0] ?? null;
}

/** How many bins there are round and from top to bottom. @param {Counting} of */
export const binsOf = ({ degrees }) => ({ azimuth_bins: 360 / degrees, polar_bins: 180 / degrees });

/** @param {string} place @param {string | null} text null: nothing is wrong there any more */
export function setProblem(place, text) {
  if (text === null && !problems.peek().has(place)) return;
  const next = new Map(problems.peek());
  if (text === null) next.delete(place);
  else next.set(place, text);
  problems.value = next;
}

/**
 * Do something, and say at `place` what goes wrong with it. What was said there before is over as it begins, not as it
 * ends: what is said there meanwhile is about something else.
 * @param {string} place @param {() => Promise<unknown>} work
 */
export async function attempt(place, work) {
  setProblem(place, null);
  try {
    await work();
  } catch (error) {
    setProblem(place, /** @type {Error} */ (error).message);
  }
}

/**
 * What views can ask for. Promises reject with an ApiError, whose message is written to be shown in place.
 * Those that change the session resolve when the server has stored the change.
 *
 * @typedef {object} Actions
 *
 * @property {(id: number, changes: Partial<Pick<Box, "class_id" | "name" | "locked" | "T_world_box" | "size">>) => Promise<void>} changeBox
 * @property {(id: number, place: {T_world_box: Transform, size: [number, number, number]}, hold?: boolean) => void} editBox
 *   shown at once, everywhere; stored once nothing more came for a moment: for held keys and stepped fields; with
 *   `hold` only by `finishEdit`, when the button is let go
 * @property {() => Promise<void>} finishEdit store now what `editBox` holds back
 * @property {(translate: [number, number, number], rotate: [number, number, number]) => void} nudge
 *   the selected box by metres and degrees along the axes that are set
 * @property {(id: number) => Promise<void>} deleteBox
 * @property {(id: number) => Promise<void>} duplicateBox the copy is then selected
 * @property {(id: number) => Promise<void>} restOnGround
 * @property {(classId: number) => void} newBox where the view looks at; it is then selected
 * @property {(classId: number, points: [number, number, number][]) => Promise<number>} boxFromPoints
 *   through four corners in the world; answers the angle in degrees by which the edges were set right
 * @property {(observations: {frame: number, x: number, y: number}[]) => Promise<Schemas["PointAnswer"]>} locatePoint
 * @property {(of: {frame: number, x: number, y: number}, frame: number) => Promise<[number, number][][]>} epipolar
 *   where a point seen in one frame may be in another: polylines in image coordinates
 * @property {(of: {box_id: number | null, class_id: number}, frame: number, polygons: readonly Polygon[], origin: MaskOrigin) => Promise<Mask>} putMask
 *   store an outline, new or in the place of the one that is there; the box and hull that are made of it follow.
 *   `box_id` null: of a new object, whose id the answer tells
 * @property {(id: number) => Promise<void>} acceptMask the yes to a proposed one
 * @property {(id: number) => Promise<void>} deleteMask
 * @property {(id: number, options: Partial<HullOptions> & {class_id?: number, name?: string}) => Promise<void>} makeHull
 *   make or remake a box of its stored masks
 * @property {(views: readonly MaskView[], options: HullOptions, show_in: readonly number[]) => Promise<HullPreview>} previewHull
 * @property {(change: {frame: number, polygons: readonly Polygon[], operation: "add" | "subtract", polygon?: Polygon, stroke?: {points: Corner[], width: number}}) => Promise<Polygon[]>} combine
 *   outlines with a shape or a brush's stroke added or taken away
 * @property {(frame: number, prompt: SegmentPrompt) => Promise<Polygon[]>} segment
 * @property {(id: number) => Promise<OutlineJob>} outlineRest
 * @property {(id: string) => Promise<OutlineJob>} outlineState
 * @property {(id: string) => Promise<OutlineJob>} cancelOutline
 * @property {(id: number, orientation: "upright" | "free") => Promise<Refinement>} refineBox move a box to where it fits its masks best
 * @property {(name: string) => Promise<ObjectClass>} addClass
 * @property {(id: number, changes: {name?: string, color?: string, default_size?: [number, number, number] | null, symmetry?: SymmetryDraft | null, keypoints?: readonly Keypoint[] | null}) => Promise<void>} changeClass
 * @property {(id: number, form: FormData) => Promise<string[]>} putClassMesh gives what was changed of the mesh, in words
 * @property {(id: number) => Promise<void>} deleteClassMesh
 * @property {(id: number) => Promise<void>} completeClass ask for what edits do not tell of a class's mesh
 * @property {(id: number) => Promise<void>} deleteClass
 * @property {(yours: BoxPreview) => Promise<void>} overrule store our side of a conflict after all
 * @property {() => Promise<void>} undo
 * @property {() => Promise<void>} redo
 * @property {(before?: number) => Promise<Schemas["HistoryPage"]>} history
 * @property {(name: string) => Promise<void>} renameSession
 *
 * @property {(index: number) => void} goTo a frame; held within the recording
 * @property {(index?: number) => void} enterFrame
 * @property {() => void} leaveFrame
 * @property {(at: "all" | "selected" | "frame") => void} look
 * @property {(name: string) => void} introduce the name by which others see this person
 * @property {(id: number | null) => void} select
 * @property {(id: number) => Promise<Schemas["TellingFrameJson"][]>} tellingFrames
 * @property {(boxes: {T_world_box: Transform, size: [number, number, number]}[], frames: number[]) => Promise<Schemas["FramePreviewJson"][]>} labelsOf
 * @property {(index: number) => Promise<Schemas["LabelJson"][]>} frameLabels
 * @property {(index: number, labelFunction: string, shape: string, signal?: AbortSignal) => Promise<Schemas["MarkJson"][]>} frameMarks
 * @property {(index: number, options?: {width?: number, crop?: [number, number, number, number]}) => string} imageAddress
 * @property {(index: number) => Promise<string>} imageProblem why a frame's image cannot be shown, in words
 * @property {(index: number) => Promise<string>} frameName
 * @property {() => Promise<Camera[]>} cameras
 * @property {(index: number) => Promise<Camera>} cameraOf a frame
 *
 * @property {() => Promise<Schemas["FormatsJson"]>} formats
 * @property {(format: string, options: object, signal?: AbortSignal) => Promise<Schemas["Forecast"]>} previewExport
 * @property {(format: string, options: Record<string, unknown>, signal?: AbortSignal) => Promise<Blob>} exportPicture one frame with its labels as a format holds them
 * @property {(format: string, options: object) => Promise<Export>} startExport
 * @property {() => Promise<Export[]>} exports
 * @property {(id: string) => Promise<Export>} exportState
 * @property {(id: string) => Promise<Export>} cancelExport
 * @property {(id: string) => Promise<void>} removeExport
 * @property {(id: string) => string} downloadAddress
 *
 * @property {(of: Seen, counting: Counting, signal?: AbortSignal) => Promise<Coverage>} coverage
 * @property {(counting: Counting, signal?: AbortSignal) => Promise<readonly Schemas["ObjectCoverage"][]>} coverageOfObjects boxes, then classes
 * @property {(of: Seen, counting: Counting, direction: Direction, signal?: AbortSignal) => Promise<Schemas["BinFrames"]>} coverageFrames
 * @property {(of: Seen, counting: Counting, as: "json" | "png") => string} coverageAddress
 * @property {(options?: Record<string, unknown>) => string} reportAddress
 *   of the page that tells what an export with these options would hold
 * @property {(wish: object) => Promise<Tour>} planTour where to look next
 *
 * @property {() => Promise<Session[]>} sessions
 * @property {(session: Session, name: string) => Promise<Session>} renameOf
 * @property {(session: Session) => Promise<void>} deleteSession
 * @property {(id: string) => Promise<Session>} restoreSession
 * @property {(id: string) => Promise<Schemas["SkippedFrameJson"][]>} skipped frames that a session's recording lists and that could not be used
 * @property {(id: string, index: number, width: number) => string} thumbnailAddress of a session's frame
 * @property {() => Promise<Schemas["RootJson"][]>} roots
 * @property {(root: string, path: string) => Promise<Schemas["FoldersJson"]>} folders
 * @property {(source: Source) => Promise<Schemas["LookJson"]>} lookAtRecording
 * @property {(look: string, frame: number, width: number) => string} lookImageAddress of one of a look's sample frames
 * @property {(file: File, onProgress: (sent: number, total: number) => void, signal?: AbortSignal) => Promise<Schemas["UploadJson"]>} upload
 * @property {(draft: Source & {name: string, classes: string[]}) => Promise<Schemas["ImportJson"]>} startImport
 * @property {(id: string) => Promise<Schemas["ImportJson"]>} importState
 * @property {(id: string) => Promise<Schemas["ImportJson"]>} cancelImport
 * @property {() => Promise<Schemas["HealthJson"]>} health
 */

/** Filled in by main.js, which knows the server. */
export const actions = /** @type {Actions} */ ({});
