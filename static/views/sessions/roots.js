/** The folders that the server was told recordings may be imported from. */

import { computed, html, signal, useEffect } from "../../lib/view.js";
import { actions } from "../../store.js";

/** Null: not known yet. */
export const roots = signal(/** @type {string[] | null} */ (null));
export const rootsProblem = signal(/** @type {string | null} */ (null));
/** Whether there are any; null: not known yet. */
export const isDeclared = computed(() => (roots.value === null ? null : roots.value.length > 0));

/** Ask for them, once more each time that something shows them: the server may have been started anew. */
export function useRoots() {
  useEffect(() => {
    actions.roots().then(
      (found) => {
        roots.value = found.map((root) => root.name);
        rootsProblem.value = null;
      },
      (error) => (rootsProblem.value = error.message),
    );
  }, []);
}

/** How to start the server so that there are some. */
export function RootCommand() {
  return html`<p class="muted">This server was told of no folder. Start it with one, by a name of your choice:</p>
    <p><code class="command">ars-web serve --root NAME=PATH</code></p>
    <p class="muted">for example <code>--root lab=/data/recordings</code>; several are fine.</p>`;
}
