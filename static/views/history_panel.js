/** Everything that was done in the session, newest first: by whom, when, and what of it stands. */

import { command } from "./commands.js";
import { Icon } from "../lib/icon.js";
import { ago } from "../lib/time.js";
import { html, useEffect, useRef, useSignal } from "../lib/view.js";
import * as store from "../store.js";

/** @typedef {import("../store.js").Schemas["HistoryPage"]} HistoryPage */
/** @typedef {import("../store.js").Schemas["PastEdit"]} PastEdit */

/** Milliseconds after which "5 minutes ago" is said anew. */
const MINUTE = 60_000;

/** Names of people that were here, by their author; they stay when the people are gone. @type {Map<string, string>} */
const names = new Map();

export function HistoryPanel() {
  const items = useSignal(/** @type {PastEdit[] | null} */ (null));
  const can = useSignal(/** @type {Pick<HistoryPage, "can_undo" | "can_redo">} */ ({ can_undo: null, can_redo: null }));
  const complete = useSignal(false);
  const problem = useSignal(/** @type {string | null} */ (null));
  const now = useNow();
  const revision = store.revision.value;
  const isOpen = store.line.value === "open";
  for (const person of store.people.value) if (person.name !== "") names.set(person.author, person.name);

  useEffect(() => {
    let current = true;
    newest(items.value ?? []).then(
      (found) => {
        if (!current) return;
        [items.value, can.value, problem.value] = [found.items, found.page, null];
        complete.value = isComplete(found.items);
      },
      (error) => current && (problem.value = error.message),
    );
    return () => void (current = false);
  }, [revision, isOpen]);

  const older = async () => {
    const known = items.value ?? [];
    const last = known.at(-1);
    if (last === undefined || complete.value) return;
    try {
      const page = await store.actions.history(last.revision);
      if (items.value !== known) return; // it was read anew meanwhile
      items.value = [...known, ...page.items];
      complete.value = page.items.length === 0 || isComplete(items.value);
      problem.value = null;
    } catch (error) {
      problem.value = /** @type {Error} */ (error).message;
    }
  };

  const wrong = store.problems.value.get("history") ?? problem.value;
  return html`<section class="panel-section history" aria-label="History">
    <div class="steps">
      <${Step} id="undo" icon="undo-2" of=${can.value.can_undo} />
      <${Step} id="redo" icon="redo-2" of=${can.value.can_redo} />
    </div>
    ${wrong !== null && html`<p class="problem" role="alert">${wrong}</p>`}
    ${items.value?.length === 0 && html`<p class="muted">Nothing was changed yet. Every change is stored at once and listed here, and can be undone.</p>`}
    <ol class="edits">
      ${items.value?.map((edit) => html`<${Row} key=${edit.revision} edit=${edit} now=${now} />`)}
    </ol>
    ${items.value !== null && !complete.value && html`<${End} key=${items.value.length} reached=${older} />`}
  </section>`;
}

/** @param {{id: "undo" | "redo", icon: string, of: HistoryPage["can_undo"]}} props */
function Step({ id, icon, of }) {
  const { title, keys, run } = command(id);
  return html`<button class="button" disabled=${of === null} onClick=${run} title=${of === null ? `Nothing of yours to ${id}` : `${title} (${keys[0]}): ${of.summary}`}>
    <${Icon} name=${icon} size=${14} /><span class="cut">${of === null ? title : `${title}: ${of.summary}`}</span>
  </button>`;
}

/** @param {{edit: PastEdit, now: Date}} props */
function Row({ edit, now }) {
  const at = new Date(edit.at);
  const who = edit.own ? "you" : (names.get(edit.author) ?? edit.author);
  return html`<li data-undone=${edit.undone}>
    ${edit.undone ? html`<s class="what">${edit.summary}</s><span class="visually-hidden">, undone</span>` : html`<span class="what">${edit.summary}</span>`}
    <span class="who muted"><span class="cut" title=${edit.author}>${who}</span>, <time datetime=${edit.at} title=${`${at.toLocaleString("en", { dateStyle: "medium", timeStyle: "medium" })}, revision ${edit.revision}`}>${ago(at, now)}</time></span>
  </li>`;
}

/** What asks for more once it is seen. @param {{reached: () => void}} props */
function End({ reached }) {
  const ref = useRef(/** @type {HTMLElement | null} */ (null));
  const newest = useRef(reached);
  newest.current = reached;
  useEffect(() => {
    const watch = new IntersectionObserver((entries) => entries.some((entry) => entry.isIntersecting) && newest.current());
    watch.observe(/** @type {HTMLElement} */ (ref.current));
    return () => watch.disconnect();
  }, []);
  return html`<p class="muted" role="status" ref=${ref}>Older changes are loading</p>`;
}

/**
 * The newest page, with what was known before it.
 * @param {PastEdit[]} known
 */
async function newest(known) {
  const page = await store.actions.history();
  let items = page.items;
  const fresh = items.filter((edit) => edit.revision > (known[0]?.revision ?? 0));
  const oldest = items.at(-1)?.revision ?? 0;
  const meets = known.length > 0 && oldest <= known[0].revision + 1;
  const below = meets ? known.filter((edit) => edit.revision < oldest) : [];
  // What is further down may stand, or stand no more, because of an undo or a redo: it is read again as far as it was.
  if (fresh.some((edit) => edit.undoes !== null || edit.redoes !== null)) {
    for (const goal = below.at(-1)?.revision ?? oldest; (items.at(-1)?.revision ?? 0) > goal; ) {
      const { items: more } = await store.actions.history(items[items.length - 1].revision);
      if (more.length === 0) break;
      items = [...items, ...more];
    }
    return { items, page };
  }
  return { items: [...items, ...below], page };
}

/** @param {PastEdit[]} items */
function isComplete(items) {
  return items.length === 0 || items[items.length - 1].revision <= 1;
}

function useNow() {
  const now = useSignal(new Date());
  useEffect(() => {
    const timer = setInterval(() => (now.value = new Date()), MINUTE);
    return () => clearInterval(timer);
  }, []);
  return now.value;
}
