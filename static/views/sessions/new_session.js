/** The dialog in which a recording becomes a session, and what is seen of it while the dialog is closed. */

import { Dialog } from "../../lib/dialog.js";
import { Icon } from "../../lib/icon.js";
import { html, useEffect, useRef } from "../../lib/view.js";
import { ChosenRecording } from "./chosen_recording.js";
import { back, begin, cancel, close, isOpen, isUnderWay, problem, step } from "./draft.js";
import { isOver } from "./drop.js";
import { FolderBrowser } from "./folders.js";
import { KnownRecordings } from "./known_recordings.js";
import { ProgressLine } from "./progress_line.js";
import { ZipButton } from "./zip_button.js";

export function NewSession() {
  return isOpen.value ? html`<${Dialog} label="New session" class="new-session" onClose=${leave}><${Steps} /></${Dialog}>` : null;
}

/** One step back. */
function leave() {
  if (step.value.at === "chosen") back();
  else close();
}

function Steps() {
  const now = step.value;
  const body = useRef(/** @type {HTMLElement | null} */ (null));
  const first = useRef(true);
  // What had the focus is gone with the step before.
  useEffect(() => {
    if (!first.current) body.current?.focus();
    first.current = false;
  }, [now.at]);
  const title = now.at === "chosen" ? now.title : now.at === "importing" ? now.job.name : "New session";
  return html`<header>
      <h2>${title}</h2>
      <button class="button quiet icon-only" aria-label="Close" title="Close" onClick=${close}><${Icon} name="x" /></button>
    </header>
    <div class="body" tabindex="-1" ref=${body}>
      ${problem.value !== null && html`<p class="problem step-problem" role="alert">${problem.value}</p>`}
      ${now.at === "choose" && html`<${Choice} />`}
      ${now.at === "chosen" && html`<${ChosenRecording} chosen=${now} />`}
      ${(now.at === "sending" || now.at === "importing") &&
      html`<div class="under-way"><${ProgressLine} step=${now} />
        <p class="muted">This goes on when you close the dialog${now.at === "sending" && ", as long as the page is open"}.</p>
      </div>`}
    </div>
    <footer>
      ${now.at === "chosen" &&
      html`<button class="button" onClick=${back}>Back</button>
        <button class="button main" type="submit" form="chosen-recording" disabled=${now.look === null || now.looking}>Import</button>`}
      ${(now.at === "sending" || now.at === "importing") && html`<button class="button" onClick=${() => void cancel()}>Cancel</button>`}
    </footer>`;
}

function Choice() {
  return html`<div class="choice">
    <section aria-label="From this computer">
      <h3 class="heading">From this computer</h3>
      <div class="drop-zone" data-over=${isOver.value}>
        <${Icon} name="upload" size=${24} />
        <p>Drop a zip of the recording here</p>
        <${ZipButton} />
      </div>
      <${KnownRecordings} />
    </section>
    <section aria-label="From the server's folders">
      <h3 class="heading">From the server's folders</h3>
      <${FolderBrowser} />
    </section>
  </div>`;
}

/** What is under way, while the dialog is closed. */
export function NewSessionStrip() {
  const now = step.value;
  if (isOpen.value || !isUnderWay.value) return null;
  return html`<div class="strip card" role="group" aria-label="New session">
    ${(now.at === "sending" || now.at === "importing") &&
    html`<${ProgressLine} step=${now} named />
      <button class="button" onClick=${begin}>Show</button><button class="button" onClick=${() => void cancel()}>Cancel</button>`}
    ${now.at === "done" &&
    html`<p role="status"><strong>${now.name}</strong> is imported.</p>
      <a class="button" href=${`/sessions/${encodeURIComponent(now.session)}`}>Open</a>
      <button class="button quiet" onClick=${back}>Dismiss</button>`}
    ${problem.value !== null && html`<p class="problem" role="alert">${problem.value}</p>`}
  </div>`;
}
