/** All sessions, and how new ones are made. */

import { Icon } from "../../lib/icon.js";
import { plural } from "../../lib/plural.js";
import { html, useEffect, useSignal } from "../../lib/view.js";
import { actions, theme } from "../../store.js";
import { Card, DeletedCard } from "./card.js";
import { DropAnywhere } from "./drop.js";
import { NoSessions } from "./empty.js";
import { deleted, known, problem, refresh, shown } from "./listing.js";
import { NewSession, NewSessionStrip } from "./new_session.js";
import { begin } from "./draft.js";

/** Sessions beyond which one looks for them by name. */
const FEW = 8;
/** Milliseconds after which "5 minutes ago" is said anew. */
const MINUTE = 60_000;

export function SessionsPage() {
  const now = useSignal(new Date());
  const filter = useSignal("");
  const version = useSignal("");
  useEffect(() => {
    const look = () => {
      now.value = new Date();
      void refresh();
    };
    look();
    void actions.health().then((health) => (version.value = health.version), () => {});
    const clock = setInterval(() => (now.value = new Date()), MINUTE);
    addEventListener("focus", look);
    return () => {
      clearInterval(clock);
      removeEventListener("focus", look);
    };
  }, []);

  const isEmpty = known.value?.length === 0 && deleted.value.size === 0;
  return html`<div class="sessions-page">
    <header class="sessions-bar">
      <img src="/static/icon.svg" alt="" width="20" height="20" /><span class="brand">ARS Web</span>
      <span class="muted">${version}</span>
      <button class="button quiet icon-only" aria-label="Dark or light" title="Dark or light"
        onClick=${() => (theme.value = theme.value === "dark" ? "light" : "dark")}
      ><${Icon} name=${theme.value === "dark" ? "sun" : "moon"} /></button>
    </header>
    <main>
      <div class="title">
        <h1>Sessions</h1>
        <span class="muted" role="status">${known.value !== null && !isEmpty && plural(known.value.length, "session")}</span>
        <${Filter} filter=${filter} />
        <button class="button main" onClick=${() => begin()}><${Icon} name="plus" /> New session</button>
      </div>
      <${NewSessionStrip} />
      ${problem.value !== null &&
      html`<div class="list-problem card">
        <p class="problem" role="alert">${problem.value}</p><button class="button" onClick=${() => void refresh()}>Try again</button>
      </div>`}
      <section aria-label="Sessions" aria-busy=${known.value === null && problem.value === null}>
        ${isEmpty ? html`<${NoSessions} />` : html`<${Cards} filter=${filter} now=${now.value} />`}
      </section>
    </main>
    <${NewSession} />
    <${DropAnywhere} />
  </div>`;
}

/** @param {{filter: import("../../lib/view.js").Signal<string>}} props */
function Filter({ filter }) {
  if ((known.value?.length ?? 0) <= FEW && filter.value === "") return null;
  return html`<label class="filter">
    <${Icon} name="search" /><span class="visually-hidden">Find a session</span>
    <input
      type="search" class="field" placeholder="Find a session" spellcheck=${false} value=${filter.value}
      onInput=${(/** @type {any} */ event) => (filter.value = event.currentTarget.value)}
    />
  </label>`;
}

/** @param {{filter: import("../../lib/view.js").Signal<string>, now: Date}} props */
function Cards({ filter, now }) {
  const wanted = filter.value.trim().toLowerCase();
  const found = shown.value.filter((session) => session.name.toLowerCase().includes(wanted));
  if (found.length === 0 && wanted !== "") {
    return html`<p class="muted nothing">No session has “${filter.value.trim()}” in its name.
      <button class="button link" onClick=${() => (filter.value = "")}>Show all</button></p>`;
  }
  return html`<ul class="sessions">
    ${found.map(
      (session) => html`<li key=${session.id}>
        ${deleted.value.has(session.id) ? html`<${DeletedCard} session=${session} />` : html`<${Card} session=${session} now=${now} />`}
      </li>`,
    )}
  </ul>`;
}
