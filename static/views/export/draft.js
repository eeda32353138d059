/**
 * The export being thought out: a format, and those options that differ from their defaults. It outlives the panel, so
 * that a look at the scene loses nothing.
 */

import { computed, signal } from "../../lib/view.js";
import { frames, sid } from "../../store.js";
import { balanced, isShareOfSplit } from "./shares.js";

/** @typedef {import("../../store.js").Schemas} Schemas */
/** @typedef {Schemas["OptionJson"]} Option */
/** @typedef {Schemas["WriterJson"]} Writer */

export const writers = signal(/** @type {readonly Writer[]} */ ([]));
/** The chosen format; empty until the server named them. */
export const format = signal("");
/** By the option's name; defaults are left out. */
export const changes = signal(/** @type {ReadonlyMap<string, unknown>} */ (new Map()));
/** What was typed and cannot be, by the option's name: such drafts are neither counted nor started. */
export const mistakes = signal(/** @type {ReadonlyMap<string, string>} */ (new Map()));
/** What the server refuses, by the name of the option or of the object that holds it. */
export const refusals = signal(/** @type {ReadonlyMap<string, string>} */ (new Map()));

export const writer = computed(() => writers.value.find((one) => one.format === format.value) ?? null);
export const options = computed(() => writer.value?.options ?? []);
/** What cannot be beside the other options, or in this session, by the option's name. */
export const clashes = computed(() => {
  /** @type {Map<string, string>} */
  const found = new Map();
  const merged = /** @type {string[]} */ (valueOf("sessions") ?? []).length;
  const last = frames.value - 1;
  const list = /** @type {number[] | null} */ (valueOf("frames.list") ?? null);
  const [start, stop] = [Number(valueOf("frames.start") ?? 0), /** @type {number | null} */ (valueOf("frames.stop") ?? null)];
  if (list !== null) {
    const beyond = list.find((index) => index > last);
    if (beyond !== undefined) found.set("frames.list", `There is no frame ${beyond}: the last one is ${last}.`);
  } else if (start > last && merged === 0) {
    found.set("frames.start", `There is no frame ${start}: the last one is ${last}.`);
  } else if (stop !== null && stop <= start) {
    found.set("frames.stop", `No frame would be left: the first one is ${start}.`);
  }
  const wanted = ["split.train", "split.val", "split.test"].filter((name) => Number(valueOf(name)) > 0).length;
  if (valueOf("split.by") === "session" && merged + 1 < wanted) {
    found.set("split.by", `${wanted} shares need ${wanted} sessions at least: choose more under “Merge with”, or divide by block.`);
  }
  const used = [sid.value, .../** @type {string[]} */ (valueOf("sessions") ?? [])];
  const heldOut = /** @type {string[]} */ (valueOf("split.hold_out") ?? []);
  if (valueOf("split.by") === "session" && heldOut.some((id) => !used.includes(id))) {
    found.set("split.hold_out", "A session is held out that is not in this dataset: merge it, or reset this.");
  }
  return found;
});
/** Whether the draft can be counted and started, for all that the page knows. */
export const isSound = computed(() => mistakes.value.size === 0 && clashes.value.size === 0);

/** Whether single frames are listed; the range then means nothing. */
export const listsFrames = computed(() => changes.value.has("frames.list"));

/** The options as the API takes them, without defaults. */
export const asked = computed(() => {
  /** @type {Record<string, any>} */
  const found = {};
  for (const [name, value] of changes.value) {
    if (isIdle(name)) continue;
    const [group, key] = name.split(".");
    if (key === undefined) found[name] = value;
    else (found[group] ??= {})[key] = value;
  }
  return found;
});

/** @param {readonly Writer[]} found */
export function offer(found) {
  writers.value = found;
  if (!found.some((one) => one.format === format.value)) format.value = found[0]?.format ?? "";
}

/** Whether an option means nothing beside the others. @param {string} name */
export function isIdle(name) {
  if (name === "frames.by") return (valueOf("frames.count") ?? null) === null;
  if (name === "frames.sector_box") return (valueOf("frames.sector") ?? null) === null;
  if (name === "split.hold_out") return valueOf("split.by") !== "session";
  return listsFrames.value && ["frames.step", "frames.start", "frames.stop"].includes(name);
}

/** @param {string} name */
export function valueOf(name) {
  if (changes.value.has(name)) return changes.value.get(name);
  return options.value.find((option) => option.name === name)?.default;
}

/** @param {string} name @param {unknown} value */
export function setOption(name, value) {
  const next = new Map(changes.value);
  const values = isShareOfSplit(name) ? balanced(valueOf, name, Number(value)) : [[name, value]];
  for (const [key, one] of /** @type {[string, unknown][]} */ (values)) {
    const standard = options.value.find((option) => option.name === key)?.default;
    if (JSON.stringify(one) === JSON.stringify(standard)) next.delete(key);
    else next.set(key, one);
  }
  changes.value = next;
  setMistake(name, null);
}

/** @param {readonly string[]} names */
export function reset(names) {
  changes.value = new Map([...changes.value].filter(([name]) => !names.includes(name)));
  mistakes.value = new Map([...mistakes.value].filter(([name]) => !names.includes(name)));
}

/** @param {string} name @param {string | null} text */
export function setMistake(name, text) {
  if ((mistakes.value.get(name) ?? null) === text) return;
  const next = new Map(mistakes.value);
  if (text === null) next.delete(name);
  else next.set(name, text);
  mistakes.value = next;
}

/**
 * What is wrong with a value by itself, in words; null: nothing.
 * @param {Option} option
 * @param {unknown} value
 */
export function wrong(option, value) {
  if (typeof value === "number") {
    const { minimum, maximum } = option;
    if (option.type === "integer" && !Number.isInteger(value)) return `${value} is not a whole number.`;
    if (minimum !== null && value < minimum) return `${value} is too small: it can be ${minimum} at least.`;
    if (maximum !== null && value > maximum) return `${value} is too large: it can be ${maximum} at most.`;
  }
  return null;
}

/**
 * Put what the server says of a request to the options that it names.
 * @param {readonly {where: string, message: string}[]} errors
 */
export function refuse(errors) {
  /** @type {Map<string, string>} */
  const found = new Map();
  const names = options.value.flatMap(({ name }) => [name, name.split(".")[0]]);
  for (const { where, message } of errors) {
    const path = where.replace(/^(body\.)?options\./, "");
    const of = [path, ...names].find((name) => names.includes(name) && (path === name || path.startsWith(`${name}.`)));
    found.set(of ?? "", message);
  }
  refusals.value = found;
}
