/** The sessions as the server last told them, and those that were deleted here and can come back. */

import { computed, signal } from "../../lib/view.js";
import { actions } from "../../store.js";

/** @typedef {import("../../store.js").Session} Session */

/** Null: not known yet. */
export const known = signal(/** @type {Session[] | null} */ (null));
/** Deleted on this page, until that is dismissed. */
export const deleted = signal(/** @type {ReadonlyMap<string, Session>} */ (new Map()));
/** Why the list could not be had; what was known before stays. */
export const problem = signal(/** @type {string | null} */ (null));
/** What went wrong with one session, by its id. */
export const problems = signal(/** @type {ReadonlyMap<string, string>} */ (new Map()));

/** All that is shown, the last changed first; what was deleted keeps its place. */
export const shown = computed(() => {
  const gone = [...deleted.value.values()];
  const all = [...(known.value ?? []).filter((session) => !deleted.value.has(session.id)), ...gone];
  return all.sort((a, b) => b.changed.localeCompare(a.changed));
});

/** Counts the questions, so that an old answer does not replace a newer one. */
let asked = 0;

export async function refresh() {
  const own = ++asked;
  try {
    const found = await actions.sessions();
    if (own !== asked) return;
    known.value = found;
    problem.value = null;
    // Brought back elsewhere.
    const back = found.filter((session) => deleted.value.has(session.id));
    if (back.length > 0) deleted.value = without(deleted.value, ...back.map((session) => session.id));
  } catch (error) {
    if (own !== asked) return;
    // Logged out: the server answers with the page that says how to log in.
    if (/** @type {any} */ (error).status === 401) return location.reload();
    problem.value = /** @type {Error} */ (error).message;
  }
}

/** @param {Session} session @param {string} name @returns {Promise<boolean>} whether it has that name now */
export function rename(session, name) {
  return attempt(session.id, async () => {
    const renamed = await actions.renameOf(session, name);
    known.value = (known.value ?? []).map((one) => (one.id === renamed.id ? renamed : one));
  });
}

/** @param {Session} session */
export function remove(session) {
  return attempt(session.id, async () => {
    await actions.deleteSession(session);
    deleted.value = new Map(deleted.value).set(session.id, session);
    known.value = (known.value ?? []).filter((one) => one.id !== session.id);
  });
}

/** @param {Session} session */
export function restore(session) {
  return attempt(session.id, async () => {
    const back = await actions.restoreSession(session.id);
    known.value = [...(known.value ?? []).filter((one) => one.id !== back.id), back];
    deleted.value = without(deleted.value, session.id);
  });
}

/** @param {string} id */
export function dismiss(id) {
  deleted.value = without(deleted.value, id);
  problems.value = without(problems.value, id);
}

/** @param {string} id @param {() => Promise<void>} change */
async function attempt(id, change) {
  problems.value = without(problems.value, id);
  asked++; // a list that is on its way does not know of the change
  try {
    await change();
    return true;
  } catch (error) {
    const { status, message } = /** @type {Error & {status?: number}} */ (error);
    await refresh(); // what it met may be somebody's change
    const wasChanged = status === 409 || status === 412;
    const told = wasChanged ? "It was changed elsewhere meanwhile; this is how it is now. Try again if you still want to." : message;
    problems.value = new Map(problems.value).set(id, told);
    return false;
  }
}

/**
 * @template T
 * @param {ReadonlyMap<string, T>} map @param {string[]} ids
 * @returns {ReadonlyMap<string, T>}
 */
function without(map, ...ids) {
  return new Map([...map].filter(([id]) => !ids.includes(id)));
}
