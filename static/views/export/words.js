/** Figures and options of exports as people say them. */

import { angles } from "./angles.js";

/** @typedef {import("./draft.js").Option} Option */
/** @typedef {import("../../store.js").Schemas} Schemas */

const counts = new Intl.NumberFormat("en");

/** @param {number} count */
export const figure = (count) => counts.format(count);

/** @param {number} count @param {string} one @param {string} [many] */
export function many(count, one, many = `${one}s`) {
  return `${figure(count)} ${count === 1 ? one : many}`;
}

/** @param {number} bytes */
export function size(bytes) {
  const units = ["bytes", "kB", "MB", "GB", "TB"];
  const place = Math.min(units.length - 1, Math.floor(Math.log10(Math.max(1, bytes)) / 3));
  const value = bytes / 1000 ** place;
  return `${place === 0 || value >= 100 ? Math.round(value) : value.toFixed(1)} ${units[place]}`;
}

/** @param {number} seconds */
export function duration(seconds) {
  if (seconds < 60) return `${Math.max(1, Math.round(seconds))} s`;
  if (seconds < 3600) return `${Math.round(seconds / 60)} min`;
  return `${Math.floor(seconds / 3600)} h ${Math.round((seconds % 3600) / 60)} min`;
}

/** @param {string} word */
export const capital = (word) => word.charAt(0).toUpperCase() + word.slice(1);

/** Numbers of frames, runs of them as one: 0-4, 9. @param {readonly number[]} numbers */
export function runs(numbers) {
  /** @type {[number, number][]} */
  const found = [];
  for (const one of numbers) {
    const last = found.at(-1);
    if (last !== undefined && one === last[1] + 1) last[1] = one;
    else found.push([one, one]);
  }
  return found.map(([from, to]) => (from === to ? `${from}` : `${from}-${to}`)).join(", ");
}

/**
 * An option's value in words.
 * @param {Option} option
 * @param {unknown} value
 * @param {(sid: string) => string} [nameOf] of a session
 */
export function valueWords(option, value, nameOf = (sid) => sid) {
  if (value === null || value === undefined) return "none";
  if (option.type === "choice") return capital(String(value));
  if (option.type === "integers") return shortened(runs(/** @type {number[]} */ (value)));
  if (option.type === "range") return `${angles(/** @type {number[]} */ (value))} °`;
  if (option.type === "texts") return /** @type {string[]} */ (value).map(nameOf).join(", ") || "none";
  return `${value}${unit(option) === "" ? "" : ` ${unit(option)}`}`;
}

/** @param {string} text */
function shortened(text) {
  return text.length <= 48 ? text : `${text.slice(0, 46)} …`;
}

/** What an option's number counts, as its name says. @param {Option} option */
export function unit(option) {
  if (option.name.endsWith("_px")) return "px";
  if (option.name.endsWith("_degrees") || option.type === "range") return "°";
  return option.name.endsWith("_frames") ? "frames" : "";
}

/**
 * Those options of an export that differ from their defaults, in words.
 * @param {readonly Option[]} known
 * @param {Record<string, any>} used
 * @param {(sid: string) => string} [nameOf] of a session
 */
export function optionsWords(known, used, nameOf) {
  return known.flatMap((option) => {
    const value = option.name.split(".").reduce((/** @type {any} */ inner, key) => inner?.[key], used);
    // Null, where it is none of the option's values, is what nobody chose: the default.
    if (value === undefined || (value === null && !option.optional)) return [];
    if (JSON.stringify(value) === JSON.stringify(option.default)) return [];
    return [`${option.title}: ${valueWords(option, value, nameOf)}`];
  });
}

/** Splits as the table calls them. @type {Record<string, string>} */
export const SPLITS = { train: "Training", val: "Validation", test: "Test" };

/** Why boxes of frames got no label, and the option that decides it. @type {Record<string, {words: string, option: string | null}>} */
export const REASONS = {
  not_in_image: { words: "not in the image", option: null },
  area: { words: "too small in the image", option: "min_area_px" },
  truncation: { words: "too much outside the image", option: "max_truncated" },
  visibility: { words: "too much hidden", option: "min_visible" },
};

/** @param {Schemas["ImageCounts"]} images */
export function imagesWords(images) {
  const found = [
    [images.linked, "linked"],
    [images.copied, "copied"],
    [images.encoded, "written anew"],
  ].flatMap(([count, how]) => (Number(count) > 0 ? [`${figure(Number(count))} ${how}`] : []));
  return found.length > 0 ? found.join(", ") : "none";
}
