/** The plan of where to look next: what is asked for, and what came of it. */

import { parseQuantity } from "../../lib/quantity.js";
import { computed, effect, signal } from "../../lib/view.js";
import * as store from "../../store.js";

/** @typedef {"distance" | "height" | "tilt"} LimitName */
/** As they are typed, least and most; empty: as the recording has it. @typedef {[string, string]} Typed */

/** Which objects' holes are to be filled: those that are looked at, or all. */
export const ofAll = signal(false);
export const count = signal("10");
export const limits = signal(/** @type {Readonly<Record<LimitName, Typed>>} */ ({ distance: ["", ""], height: ["", ""], tilt: ["", ""] }));

/** What came of it; `revision`: of the session then. @type {import("../../lib/view.js").Signal<{tour: store.Tour, revision: number} | null>} */
export const plan = signal(/** @type {{tour: import("../../store.js").Tour, revision: number} | null} */ (null));
export const planning = signal(false);
export const problem = signal(/** @type {string | null} */ (null));

const MOST_VIEWS = 500;

/** What is wrong with what is typed, by its field. */
export const mistakes = computed(() => {
  /** @type {Map<"count" | LimitName, string>} */
  const found = new Map();
  const number = Number(count.value);
  if (!(Number.isInteger(number) && number >= 1 && number <= MOST_VIEWS)) found.set("count", `A whole number from 1 to ${MOST_VIEWS}.`);
  for (const name of /** @type {const} */ (["distance", "height", "tilt"])) {
    const read = limits.value[name].map((text) => (text.trim() === "" ? null : parseQuantity(text, name === "tilt" ? "angle" : "length")));
    const wrong = read.find((one) => one !== null && !one.ok);
    if (wrong) found.set(name, /** @type {{problem: string}} */ (wrong).problem);
    else if (read.filter((one) => one === null).length === 1) found.set(name, "Give both, the least and the most, or neither.");
  }
  return found;
});

/** @param {LimitName} name @returns {[number, number] | undefined} metres or radians */
function limit(name) {
  const [least, most] = limits.value[name].map((text) => parseQuantity(text, name === "tilt" ? "angle" : "length"));
  if (!least.ok || !most.ok) return undefined;
  const unit = name === "tilt" ? Math.PI / 180 : 1;
  return [least.value * unit, most.value * unit];
}

/** Ask the server for views; what is wrong is said where it is asked for. */
export async function make() {
  if (planning.value || mistakes.value.size > 0) return;
  const of = store.seen.value;
  const { min_visible } = store.counting.value;
  planning.value = true;
  problem.value = null;
  const revision = store.revision.value;
  try {
    const tour = await store.actions.planTour({
      ...(ofAll.value || of === null ? {} : "box_id" in of ? { box_ids: [of.box_id] } : of),
      count: Number(count.value),
      distance: limit("distance"),
      height: limit("height"),
      tilt: limit("tilt"),
      ...(min_visible > 0 ? { min_visible } : {}),
      ...store.binsOf(store.counting.value),
    });
    plan.value = { tour, revision };
  } catch (error) {
    problem.value = /** @type {Error} */ (error).message;
  }
  planning.value = false;
}

export function forget() {
  plan.value = null;
  problem.value = null;
}

effect(() => {
  store.tour.value = plan.value?.tour.views.map(({ T_world_camera }) => T_world_camera) ?? [];
});

/** The wrist's poses as a robot's programs read them, `x y z qx qy qz qw` a line; null: nobody knows how it holds the camera. @param {import("../../store.js").Tour} tour */
export function wristRows(tour) {
  const rows = tour.views.map(({ T_world_wrist }) => {
    if (T_world_wrist === null) return null;
    const [w, x, y, z] = T_world_wrist.wxyz;
    return [...T_world_wrist.position, x, y, z, w].join(" ");
  });
  return rows.length === 0 || rows.includes(null) ? null : `${rows.join("\n")}\n`;
}
