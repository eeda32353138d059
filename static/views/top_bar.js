/** The top bar: where one is, the modes, what is saved, who else is here, undo and help. */

import { command } from "./commands.js";
import { Icon } from "../lib/icon.js";
import { initials, personColor } from "../lib/person.js";
import { html, useRef, useSignal } from "../lib/view.js";
import * as store from "../store.js";

const MODES = /** @type {const} */ ([
  ["scene", "Scene"],
  ["frame", "Frame"],
  ["masks", "Masks"],
  ["coverage", "Coverage"],
  ["export", "Export"],
]);

export function TopBar() {
  return html`<header class="top-bar">
    <div class="path">
      <a class="brand" href="/" aria-label="ARS Web, all sessions">
        <img src="/static/icon.svg" alt="" width="20" height="20" /><span>ARS Web</span>
      </a>
      <a class="up" href="/">Sessions</a><span class="muted" aria-hidden="true">/</span>
      <${SessionName} />
    </div>
    <${Modes} />
    <div class="state">
      <${Saved} />
      <${People} />
      ${[["undo", "undo-2"], ["redo", "redo-2"], ["help", "circle-question-mark"]].map(
        ([id, icon]) => html`<button
          class="button quiet icon-only" key=${id} onClick=${() => command(id).run()}
          aria-label=${command(id).title} title=${`${command(id).title} (${command(id).keys[0]})`}
        ><${Icon} name=${icon} /></button>`,
      )}
    </div>
  </header>`;
}

function SessionName() {
  const editing = useSignal(false);
  const busy = useRef(false);
  const wrong = useSignal(/** @type {string | null} */ (null));
  const name = store.session.value?.name ?? "";
  if (!editing.value) {
    return html`<button class="session-name" title="Rename the session" onClick=${() => (editing.value = true)}>${name}</button>`;
  }
  const leave = () => {
    editing.value = false;
    wrong.value = null;
  };
  /** @param {HTMLInputElement} input */
  const keep = async (input) => {
    // The field loses the focus as it goes, too: after Escape, and after it was kept.
    if (!editing.value || busy.current) return;
    const wanted = input.value.trim();
    if (wanted === name || wanted === "") return leave();
    busy.current = true;
    try {
      await store.actions.renameSession(wanted);
      if (input.value.trim() === wanted) leave(); // else somebody types on
    } catch (error) {
      wrong.value = /** @type {Error} */ (error).message;
    }
    busy.current = false;
  };
  return html`<input
      class="session-name" aria-label="Name of the session" defaultValue=${name} maxlength="200"
      aria-invalid=${wrong.value !== null} ref=${focusWhole}
      onBlur=${(/** @type {any} */ event) => keep(event.currentTarget)}
      onKeyDown=${(/** @type {any} */ event) => {
        if (event.key === "Enter") void keep(event.currentTarget);
        if (event.key === "Escape") leave();
      }}
    />${wrong.value !== null && html`<span class="problem" role="alert">${wrong.value}</span>`}`;
}

/** @param {HTMLInputElement | null} input */
function focusWhole(input) {
  if (input === null || document.activeElement === input) return;
  input.focus();
  input.select();
}

function Modes() {
  const tabs = useRef(/** @type {HTMLElement | null} */ (null));
  /** @param {KeyboardEvent} event */
  const arrows = (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    const at = MODES.findIndex(([mode]) => mode === store.mode.value);
    const next = (at + step + MODES.length) % MODES.length;
    command(`mode-${MODES[next][0]}`).run();
    /** @type {HTMLElement} */ (tabs.current?.children[next]).focus();
  };
  return html`<div class="modes" role="tablist" aria-label="Modes" ref=${tabs} onKeyDown=${arrows}>
    ${MODES.map(
      ([mode, title]) => html`<button
        key=${mode} role="tab" aria-selected=${store.mode.value === mode} tabindex=${store.mode.value === mode ? 0 : -1}
        onClick=${() => command(`mode-${mode}`).run()}
      >${title}</button>`,
    )}
  </div>`;
}

function Saved() {
  const lost = store.line.value === "lost";
  const waiting = store.unsaved.value > 0;
  const words = lost
    ? waiting ? "Not saved yet: reconnecting" : "Reconnecting"
    : waiting ? "Saving" : `Saved, revision ${store.revision.value}`;
  return html`<span class="saved" role="status" data-state=${lost ? "lost" : waiting ? "saving" : "saved"}>
    <span class="dot" aria-hidden="true"></span>${words}
  </span>`;
}

function People() {
  const others = store.people.value.filter((person) => !person.own);
  if (others.length === 0) return null;
  const names = others.map((person) => person.name || "someone").join(", ");
  return html`<div class="people" role="group" aria-label=${`Also here: ${names}`}>
    ${others.slice(0, 5).map(
      (person) => html`<button
        class="person" key=${person.view} style=${{ background: personColor(person.view) }}
        title=${`Also here: ${person.name || "someone"}${person.frame === null ? "" : `, at frame ${person.frame}. Go there`}`}
        onClick=${() => person.frame !== null && store.actions.goTo(person.frame)}
      >${initials(person.name)}</button>`,
    )}
    ${others.length > 5 && html`<span class="muted">+${others.length - 5}</span>`}
  </div>`;
}
