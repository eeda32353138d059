// @ts-check
/** The list of sessions: what there is, and what to do where there is nothing. */

import { element } from "../lib/element.js";
import { ago } from "../lib/time.js";

const THUMBNAIL_WIDTH = 640;

/** @typedef {import("../api.js").Session} Session */

/**
 * @param {Session[]} sessions in any order
 * @param {(session: string, index: number, width: number) => string} imageAddress
 * @param {Date} now
 */
export function sessionList(sessions, imageAddress, now) {
  const items = [...sessions].sort((a, b) => b.changed.localeCompare(a.changed));
  return element(
    "ul",
    { class: "sessions" },
    ...items.map((session) => element("li", {}, card(session, imageAddress, now))),
  );
}

/** What is shown where there is no session yet. */
export function noSessions() {
  return element(
    "div",
    { class: "notice" },
    element("h2", {}, "No sessions yet"),
    element("p", {}, "A session is a tracked recording with the boxes that you put in it. Make one in a terminal:"),
    element(
      "ol",
      {},
      element("li", {}, code("ars-web demo"), " makes the generated recording, labelled"),
      element("li", {}, code("ars-web import PATH"), " reads a recording of yours"),
    ),
  );
}

/**
 * What is shown where the list could not be had.
 * @param {string} message
 * @param {() => void} again
 */
export function failure(message, again) {
  const button = element("button", { type: "button" }, "Try again");
  button.addEventListener("click", again);
  return element("div", { class: "notice", role: "alert" }, element("p", { class: "warning" }, message), button);
}

/**
 * @param {Session} session
 * @param {(session: string, index: number, width: number) => string} imageAddress
 * @param {Date} now
 */
function card(session, imageAddress, now) {
  const middle = Math.floor(session.frames / 2);
  const thumbnail = element("img", {
    class: "thumbnail",
    src: imageAddress(session.id, middle, THUMBNAIL_WIDTH),
    alt: `Frame ${middle} of ${session.name}`,
    loading: "lazy",
  });
  const changed = new Date(session.changed);
  const body = element(
    "div",
    { class: "body" },
    element(
      "div",
      { class: "head" },
      element("h2", {}, session.name),
      element("time", { class: "muted", datetime: session.changed, title: changed.toLocaleString("en") }, ago(changed, now)),
    ),
    element(
      "dl",
      { class: "counts" },
      count("frames", session.frames),
      count("boxes", session.boxes),
      count("classes", session.classes),
    ),
  );
  if (session.skipped > 0) {
    const reasons = element("a", { href: `/api/sessions/${encodeURIComponent(session.id)}/skipped` }, "reasons");
    const frames = session.skipped === 1 ? "1 frame was skipped" : `${session.skipped} frames were skipped`;
    body.append(element("p", { class: "warning" }, `${frames} on import: `, reasons));
  }
  const foot = element(
    "div",
    { class: "foot" },
    element("span", {}, `${session.format}, revision ${session.revision}`),
    element("span", { class: "links" }, ...["boxes", "classes", "cameras"].map((part) => link(session, part))),
  );
  return element("article", { class: "session", "data-session": session.id }, thumbnail, body, foot);
}

/**
 * @param {string} name
 * @param {number} value
 */
function count(name, value) {
  return element("div", {}, element("dt", {}, name), element("dd", {}, value.toLocaleString("en")));
}

/**
 * @param {Session} session
 * @param {string} part
 */
function link(session, part) {
  const address = `/api/sessions/${encodeURIComponent(session.id)}/${part}`;
  return element("a", { href: address, "aria-label": `${part} of ${session.name} as JSON` }, part);
}

/** @param {string} text */
function code(text) {
  return element("code", {}, text);
}
