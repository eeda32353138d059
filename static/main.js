// @ts-check
/** Joins the server's answers and the views. */

import * as api from "./api.js";
import { failure, noSessions, sessionList } from "./views/sessions.js";

const place = /** @type {HTMLElement} */ (document.getElementById("sessions"));
const count = /** @type {HTMLElement} */ (document.getElementById("count"));
const version = /** @type {HTMLElement} */ (document.getElementById("version"));

async function show() {
  place.setAttribute("aria-busy", "true");
  try {
    const sessions = await api.sessions();
    count.textContent = sessions.length === 0 ? "" : String(sessions.length);
    place.replaceChildren(sessions.length === 0 ? noSessions() : sessionList(sessions, api.imageAddress, new Date()));
  } catch (error) {
    if (!(error instanceof api.ApiError)) throw error;
    // Logged out: the server answers with the page that says how to log in.
    if (error.status === 401) return location.reload();
    place.replaceChildren(failure(error.message, show));
  } finally {
    place.setAttribute("aria-busy", "false");
  }
}

// Whoever comes back to the page sees what was changed elsewhere meanwhile.
addEventListener("focus", show);
show();
api.health().then(
  (health) => (version.textContent = health.version),
  () => {}, // the list says already that the server does not answer
);
