/** A session on its way: from choosing a recording to the import's end. It goes on while its dialog is closed. */

import { batch, computed, signal } from "../../lib/view.js";
import { Pace } from "../../lib/time_left.js";
import { actions } from "../../store.js";
import { refresh } from "./listing.js";

/** @typedef {import("../../store.js").Source} Source */
/** @typedef {import("../../store.js").Schemas["LookJson"]} Look */
/** @typedef {import("../../store.js").Schemas["ImportJson"]} ImportJob */

/**
 * A zip on its way to the server.
 * @typedef {{at: "sending", name: string, sent: number, total: number, pace: Pace, stop: AbortController}} Sending
 */
/**
 * A recording that was chosen; `look` is null while it is looked at, and where it cannot be read.
 * @typedef {{at: "chosen", title: string, source: Source, look: Look | null, looking: boolean}} Chosen
 */
/** @typedef {{at: "importing", chosen: Chosen, job: ImportJob, pace: Pace}} Importing */
/** @typedef {{at: "choose"} | Sending | Chosen | Importing | {at: "done", name: string, session: string}} Step */

/** Milliseconds between two questions of how far an import is. */
const EVERY = 300;
/** The same while the server does not answer. */
const WHILE_LOST = 2000;

export const isOpen = signal(false);
export const step = signal(/** @type {Step} */ ({ at: "choose" }));
/** What is wrong at this step. */
export const problem = signal(/** @type {string | null} */ (null));
export const name = signal("");
/** As typed, separated by commas. */
export const classes = signal("");
/** Whether there is something that is not just a choice to make. */
export const isUnderWay = computed(() => ["sending", "importing", "done"].includes(step.value.at));

/** Counts what is looked at, so that an answer that nobody waits for any more changes nothing. */
let looks = 0;

export function begin() {
  if (step.value.at === "done") back();
  isOpen.value = true;
}

/** Close the dialog. What is under way goes on; what was only looked at is put away. */
export function close() {
  isOpen.value = false;
  if (!isUnderWay.value) back();
}

/** To the choice of a recording. */
export function back() {
  looks++;
  batch(() => {
    step.value = { at: "choose" };
    problem.value = null;
  });
}

/** @param {readonly File[]} files @param {boolean} [hasFolder] whether one of them is a folder */
export function take(files, hasFolder = false) {
  isOpen.value = true;
  if (isUnderWay.value && step.value.at !== "done") {
    problem.value = "One recording at a time: this one is still under way.";
    return;
  }
  back();
  const [file] = files;
  const isZip = file !== undefined && (/\.zip$/i.test(file.name) || /zip/.test(file.type));
  if (hasFolder) problem.value = `${file?.name ?? "This"} is a folder. Pack it as a zip, and drop that.`;
  else if (files.length > 1) problem.value = `${files.length} files were dropped. Pack the whole recording as one zip, and drop that.`;
  else if (file !== undefined && !isZip) problem.value = `${file.name} is not a zip. Pack the whole recording as one, and drop that.`;
  else if (file !== undefined) void send(file);
}

/** @param {File} file */
async function send(file) {
  const stop = new AbortController();
  const pace = new Pace(0, performance.now());
  step.value = { at: "sending", name: file.name, sent: 0, total: file.size, pace, stop };
  try {
    const told = (/** @type {number} */ sent, /** @type {number} */ total) => {
      if (!stop.signal.aborted) step.value = { at: "sending", name: file.name, sent, total, pace, stop };
    };
    const upload = await actions.upload(file, told, stop.signal);
    await choose({ upload: upload.id, path: "", format: "auto" }, file.name, file.name.replace(/\.zip$/i, ""));
  } catch (error) {
    if (stop.signal.aborted) return;
    back();
    problem.value = /** @type {Error} */ (error).message;
  }
}

/** @param {Source} source @param {string} title what it is called here @param {string} proposed the session's name */
export function choose(source, title, proposed) {
  batch(() => {
    name.value = proposed;
    classes.value = "";
  });
  return lookAt(source, title);
}

/** Look at what would be imported; again, where more is known of it. @param {Source} source @param {string} title */
export async function lookAt(source, title) {
  const own = ++looks;
  const before = step.value.at === "chosen" ? step.value.look : null;
  batch(() => {
    step.value = { at: "chosen", title, source, look: before, looking: true };
    problem.value = null;
  });
  const chosen = /** @type {const} */ ({ at: "chosen", title, source, looking: false });
  try {
    const look = await actions.lookAtRecording(source);
    if (own === looks) step.value = { ...chosen, look };
  } catch (error) {
    if (own !== looks) return;
    batch(() => {
      step.value = { ...chosen, look: null };
      problem.value = /** @type {Error} */ (error).message;
    });
  }
}

/** @param {Chosen} chosen */
export async function startImport(chosen) {
  problem.value = null;
  const wanted = classes.value.split(",").map((one) => one.trim()).filter((one) => one !== "");
  try {
    const job = await actions.startImport({ ...chosen.source, name: name.value.trim(), classes: wanted });
    step.value = { at: "importing", chosen, job, pace: new Pace(0, performance.now()) };
    await follow(job.id);
  } catch (error) {
    batch(() => {
      step.value = chosen;
      problem.value = /** @type {Error} */ (error).message;
    });
  }
}

/** Stop what is under way; it leaves nothing behind. */
export async function cancel() {
  const now = step.value;
  if (now.at === "sending") {
    back();
    now.stop.abort();
  }
  if (now.at !== "importing") return;
  try {
    await actions.cancelImport(now.job.id);
  } catch (error) {
    problem.value = /** @type {Error} */ (error).message;
  }
}

/** Ask how far the import is until it has ended. @param {string} id */
async function follow(id) {
  for (;;) {
    const now = step.value;
    if (now.at !== "importing") return;
    const job = await state(id);
    if (job?.state === "done") return finished(job);
    if (job?.state === "failed" || job?.state === "cancelled") {
      batch(() => {
        step.value = now.chosen;
        problem.value = job.error;
      });
      return;
    }
    if (job !== null) {
      const isSame = job.phase === now.job.phase && job.state === now.job.state;
      step.value = { ...now, job, pace: isSame ? now.pace : new Pace(job.done, performance.now()) };
    }
    await new Promise((resolve) => setTimeout(resolve, job === null ? WHILE_LOST : EVERY));
  }
}

/** @param {string} id @returns {Promise<ImportJob | null>} null: the server does not answer, which is said meanwhile */
async function state(id) {
  try {
    const job = await actions.importState(id);
    problem.value = null;
    return job;
  } catch (error) {
    if (/** @type {any} */ (error).status !== 0) throw error;
    problem.value = /** @type {Error} */ (error).message;
    return null;
  }
}

/** @param {ImportJob} job */
function finished(job) {
  const session = /** @type {string} */ (job.session_id);
  if (isOpen.value) return location.assign(`/sessions/${encodeURIComponent(session)}`);
  step.value = { at: "done", name: job.name, session };
  void refresh();
}
