/** What is doubtful about an export, in the user's terms, with the next best thing to do. */

import { html } from "../../lib/view.js";
import { boxes, classes, mode } from "../../store.js";
import { changes, options, reset, setOption, valueOf } from "./draft.js";
import { capital, many, REASONS } from "./words.js";

/** @typedef {import("../../store.js").Schemas["Forecast"]} Forecast */
/** @typedef {{id: string, text: string, remedy: {words: string, act: () => void} | null}} Warning */

/** @param {{found: Forecast}} props */
export function Advice({ found }) {
  const warnings = warningsOf(found);
  if (warnings.length === 0 && found.losses.length === 0) return null;
  return html`<ul class="advice" aria-label="Before you start">
    ${warnings.map(
      ({ id, text, remedy }) => html`<li key=${id} data-warning=${id}>
        <p class="problem">${text}</p>
        ${remedy !== null && html`<button class="button" onClick=${remedy.act}>${remedy.words}</button>`}
      </li>`,
    )}
    ${found.losses.length > 0 &&
    html`<li key="losses" data-warning="losses"><div>${found.losses.map((text) => html`<p key=${text} class="problem">${capital(text)}</p>`)}</div></li>`}
  </ul>`;
}

/** @param {Forecast} found @returns {Warning[]} */
function warningsOf(found) {
  const labels = Object.values(found.splits).reduce((sum, { labels }) => sum + labels, 0);
  const merged = found.sessions.length > 1;
  if (boxes.value.size === 0 && labels === 0 && !merged) {
    return [
      {
        id: "no-boxes",
        text: "There are no boxes yet, so no image would have a label. Place a box round each object first.",
        remedy: toScene("Place boxes in the scene"),
      },
    ];
  }
  return [...(labels === 0 ? [allDropped(found)] : classesWithout(found, merged)), ...emptySplits(found)];
}

/** @param {Forecast} found @returns {Warning} */
function allDropped(found) {
  const [reason] = Object.entries(found.dropped).reduce((most, one) => (one[1] > most[1] ? one : most));
  const { words, option: name } = REASONS[reason] ?? { words: reason, option: null };
  const option = options.value.find((one) => one.name === name);
  const text = `No image would have a label: most boxes are ${words}`;
  if (option === undefined || !changes.value.has(option.name)) {
    return { id: "all-dropped", text: `${text}. Check in a frame where the boxes are.`, remedy: toScene("Look at the scene") };
  }
  return {
    id: "all-dropped",
    text: `${text} for “${option.title}” at ${valueOf(option.name)}.`,
    remedy: { words: `Set it back to ${option.default}`, act: () => reset([option.name]) },
  };
}

/** @param {Forecast} found @param {boolean} merged @returns {Warning[]} */
function classesWithout(found, merged) {
  const empty = found.classes
    .map(({ name }) => name)
    .filter((name) => Object.values(found.splits).every((counts) => (counts.classes[name] ?? 0) === 0));
  const used = new Set([...boxes.value.values()].map(({ class_id }) => classes.value.get(class_id)?.name));
  const unboxed = empty.filter((name) => !used.has(name));
  const unseen = empty.filter((name) => used.has(name));
  /** @type {Warning[]} */
  const warnings = [];
  if (unboxed.length > 0) {
    const [have, are] = unboxed.length === 1 ? ["has", "it is"] : ["have", "they are"];
    warnings.push({
      id: "class-without-box",
      text: `${listed(unboxed)} ${have} no box${merged ? " here" : ""} and would get no label, though ${are} among the classes.`,
      remedy: toScene("Place one in the scene"),
    });
  }
  if (unseen.length > 0) {
    const strict = options.value.filter(({ name }) => Object.values(REASONS).some(({ option }) => option === name) && changes.value.has(name));
    warnings.push({
      id: "class-without-label",
      text: `${listed(unseen)} would get no label: in every chosen frame the boxes are outside the image, hidden or too small.`,
      remedy: strict.length > 0 ? { words: "Keep every label", act: () => reset(strict.map(({ name }) => name)) } : null,
    });
  }
  return warnings;
}

/** @param {Forecast} found @returns {Warning[]} */
function emptySplits(found) {
  const { train, val } = found.splits;
  /** @type {Warning[]} */
  const warnings = [];
  if (train !== undefined && train.images === 0) {
    warnings.push({
      id: "empty-train",
      text: "There would be no image to train on.",
      remedy: { words: "Divide as by default", act: () => reset(["split.train", "split.val", "split.test"]) },
    });
  }
  if (val !== undefined && val.images === 0) {
    const share = Number(valueOf("split.val"));
    const standard = options.value.find(({ name }) => name === "split.val")?.default;
    const stepped = changes.value.has("frames.step") || changes.value.has("frames.list");
    warnings.push({
      id: "empty-val",
      text: `There would be no image to validate on${share > 0 ? `: ${many(found.frames, "frame")} cannot be divided that far` : ""}. Most training programs need some.`,
      remedy:
        share === 0
          ? { words: `Give validation ${standard}`, act: () => setOption("split.val", standard) }
          : stepped
            ? { words: "Write every frame", act: () => reset(["frames.step", "frames.list"]) }
            : null,
    });
  } else if (val !== undefined && val.labels === 0 && (train?.labels ?? 0) > 0) {
    warnings.push({
      id: "val-without-label",
      text: "No validation image would have a label, so training could not be measured.",
      remedy: { words: "Divide another way", act: () => setOption("split.seed", Number(valueOf("split.seed")) + 1) },
    });
  }
  return warnings;
}

/** @param {string} words */
function toScene(words) {
  return { words, act: () => void (mode.value = "scene") };
}

/** @param {readonly string[]} names */
function listed(names) {
  const quoted = names.map((name) => `“${name}”`);
  if (quoted.length > 4) return `${quoted.slice(0, 3).join(", ")} and ${many(quoted.length - 3, "other class", "other classes")}`;
  return quoted.length < 2 ? (quoted[0] ?? "") : `${quoted.slice(0, -1).join(", ")} and ${quoted.at(-1)}`;
}
