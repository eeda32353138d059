/** What is shown where there is no session yet: the three ways to one. */

import { Icon } from "../../lib/icon.js";
import { html } from "../../lib/view.js";
import { begin } from "./draft.js";
import { isDeclared, RootCommand, useRoots } from "./roots.js";
import { ZipButton } from "./zip_button.js";

export function NoSessions() {
  useRoots();
  return html`<div class="no-sessions">
    <h2>No sessions yet</h2>
    <p class="muted">A session is a tracked camera recording with the boxes that you put in it. There are three ways to one.</p>
    <ol>
      <li class="card">
        <${Icon} name="wand-sparkles" size=${20} />
        <h3>Try the demo</h3>
        <p class="muted">A generated recording, boxed already. In a terminal:</p>
        <p><code>make demo</code></p>
        <p class="muted">or, where ARS Web is installed, <code>ars-web demo</code></p>
      </li>
      <li class="card">
        <${Icon} name="upload" size=${20} />
        <h3>Send a zip</h3>
        <p class="muted">The recording's folder, packed. Drop it anywhere on this page.</p>
        <p><${ZipButton} /></p>
      </li>
      <li class="card">
        <${Icon} name="folder-open" size=${20} />
        <h3>Take a folder of the server's</h3>
        ${isDeclared.value === false
          ? html`<${RootCommand} />`
          : html`<p class="muted">Its images stay where they are.</p>
              <p><button class="button" onClick=${() => begin()}><${Icon} name="folder" /> Browse folders</button></p>`}
      </li>
    </ol>
  </div>`;
}
