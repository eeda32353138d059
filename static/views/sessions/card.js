/** A session among the others: what it looks like, what it holds, and what can be done with it whole. */

import { Icon } from "../../lib/icon.js";
import { Menu } from "../../lib/menu.js";
import { plural } from "../../lib/plural.js";
import { ago } from "../../lib/time.js";
import { html, useEffect, useRef, useSignal } from "../../lib/view.js";
import { actions } from "../../store.js";
import { dismiss, problems, remove, rename, restore } from "./listing.js";
import { SkippedFrames } from "./skipped_frames.js";
import { Thumbnail } from "./thumbnail.js";

/** @typedef {import("../../store.js").Session} Session */

/** CSS pixels of a card on the widest screens, twice. */
const THUMBNAIL_WIDTH = 640;

/** @param {{session: Session, now: Date}} props */
export function Card({ session, now }) {
  const menu = useSignal(/** @type {{x: number, y: number} | null} */ (null));
  const naming = useSignal(false);
  const listing = useSignal(false);
  const problem = problems.value.get(session.id);
  const middle = Math.floor(session.frames / 2);
  const changed = new Date(session.changed);
  const closeMenu = useRef(() => void (menu.value = null)).current;

  return html`<article class="session card" data-session=${session.id} aria-label=${session.name}>
    <${Thumbnail} address=${actions.thumbnailAddress(session.id, middle, THUMBNAIL_WIDTH)} label=${`Frame ${middle} of ${session.name}`} />
    <div class="body">
      <div class="head">
        ${naming.value
          ? html`<${NameField} session=${session} onLeave=${() => (naming.value = false)} />`
          : html`<h2><a href=${`/sessions/${encodeURIComponent(session.id)}`}>${session.name}</a></h2>`}
        <button
          class="button quiet icon-only" aria-label=${`What can be done with ${session.name}`} aria-haspopup="menu"
          aria-expanded=${menu.value !== null}
          onClick=${(/** @type {MouseEvent} */ event) => {
            const { left, bottom } = /** @type {HTMLElement} */ (event.currentTarget).getBoundingClientRect();
            menu.value = { x: left, y: bottom + 4 };
          }}
        ><${Icon} name="ellipsis" /></button>
      </div>
      <dl class="counts">
        <${Count} of="frames" value=${session.frames} /><${Count} of="boxes" value=${session.boxes} />
        <${Count} of="classes" value=${session.classes} />
      </dl>
      ${problem !== undefined && html`<p class="problem" role="alert">${problem}</p>`}
    </div>
    <div class="foot">
      <span><span class="visually-hidden">Changed </span>
        <time dateTime=${session.changed} title=${`Changed ${exactly(changed)}`}>${ago(changed, now)}</time></span>
      ${session.skipped > 0 &&
      html`<button
        class="note" aria-label=${`${plural(session.skipped, "frame")} skipped: which, and why`} title="Which frames, and why"
        onClick=${() => (listing.value = true)}
      >${session.skipped.toLocaleString("en")} skipped</button>`}
      <span class="revision" title="One more with every edit">revision ${session.revision.toLocaleString("en")}</span>
    </div>
    ${menu.value !== null &&
    html`<${Menu}
      label=${`What can be done with ${session.name}`} x=${menu.value.x} y=${menu.value.y} onClose=${closeMenu}
      items=${[
        { title: "Rename", run: () => (naming.value = true) },
        { title: "Delete", bad: true, run: () => void remove(session) },
      ]}
    />`}
    ${listing.value && html`<${SkippedFrames} session=${session} onClose=${() => (listing.value = false)} />`}
  </article>`;
}

/** What stands where a session was, until it is dismissed. @param {{session: Session}} props */
export function DeletedCard({ session }) {
  const undo = useRef(/** @type {HTMLElement | null} */ (null));
  const problem = problems.value.get(session.id);
  useEffect(() => undo.current?.focus(), []);
  return html`<article class="session deleted card" data-session=${session.id} aria-label=${`Deleted ${session.name}`}>
    <div class="thumbnail"><${Icon} name="trash" size=${20} /></div>
    <div class="body">
      <p role="status">Deleted <strong>${session.name}</strong>.</p>
      <div class="row">
        <button class="button" ref=${undo} onClick=${() => void restore(session)}><${Icon} name="undo-2" /> Undo</button>
        <button class="button quiet" onClick=${() => dismiss(session.id)}>Dismiss</button>
      </div>
      ${problem !== undefined && html`<p class="problem" role="alert">${problem}</p>`}
    </div>
  </article>`;
}

/** @param {{session: Session, onLeave: () => void}} props */
function NameField({ session, onLeave }) {
  /** Set once it is left or while its answer is awaited: losing the focus then means nothing. */
  const settled = useRef(false);
  /** @param {HTMLInputElement} input */
  const keep = async (input) => {
    if (settled.current) return;
    settled.current = true;
    const wanted = input.value.trim();
    settled.current = wanted === session.name || wanted === "" || (await rename(session, wanted));
    if (settled.current) onLeave();
  };
  return html`<input
    class="field name" aria-label=${`New name of ${session.name}`} maxlength="200" defaultValue=${session.name} ref=${focusWhole}
    onBlur=${(/** @type {any} */ event) => keep(event.currentTarget)}
    onKeyDown=${(/** @type {any} */ event) => {
      if (event.key === "Enter") void keep(event.currentTarget);
      if (event.key !== "Escape") return;
      settled.current = true;
      onLeave();
    }}
  />`;
}

/** @param {HTMLInputElement | null} input */
function focusWhole(input) {
  if (input === null || document.activeElement === input) return;
  input.focus();
  input.select();
}

/** @param {{of: string, value: number}} props */
function Count({ of, value }) {
  return html`<div><dt>${of}</dt><dd>${value.toLocaleString("en")}</dd></div>`;
}

/** @param {Date} moment */
function exactly(moment) {
  return moment.toLocaleString("en", { dateStyle: "full", timeStyle: "medium" });
}
