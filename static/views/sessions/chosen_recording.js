/** What would be imported, before it is: what the recording holds, what is wrong with it, and the session's name. */

import { plural } from "../../lib/plural.js";
import { html, useEffect, useRef, useSignal } from "../../lib/view.js";
import { actions } from "../../store.js";
import { classes, lookAt, name, startImport } from "./draft.js";
import { KnownRecordings, readers, titleOf, useReaders } from "./known_recordings.js";
import { SkippedTable } from "./skipped_frames.js";
import { Thumbnail } from "./thumbnail.js";

/** @typedef {import("./draft.js").Look} Look */

/** CSS pixels of a sample, twice. */
const SAMPLE_WIDTH = 256;

/** @param {{chosen: import("./draft.js").Chosen}} props */
export function ChosenRecording({ chosen }) {
  useReaders();
  const field = useRef(/** @type {HTMLInputElement | null} */ (null));
  const { look, looking } = chosen;
  const isFirst = look !== null && !looking;
  useEffect(() => {
    if (isFirst && document.activeElement?.closest("form") !== field.current?.form) field.current?.focus();
  }, [isFirst]);
  return html`<form
    id="chosen-recording" class="chosen" aria-busy=${looking}
    onSubmit=${(/** @type {Event} */ event) => {
      event.preventDefault();
      if (isFirst) void startImport(chosen);
    }}
  >
    ${look === null && looking && html`<p class="muted looking" role="status">Looking at what is in it</p>`}
    ${look !== null &&
    html`<${Samples} look=${look} /><${Facts} look=${look} /><${Warnings} look=${look} />
      <div class="fields">
        <label><span>Name of the session</span>
          <input class="field" ref=${field} required maxlength="200" spellcheck=${false} value=${name.value}
            onInput=${(/** @type {any} */ event) => (name.value = event.currentTarget.value)} />
        </label>
        <label><span>${look.classes.length > 0 ? "More classes, separated by commas" : "Classes, separated by commas"}</span>
          <input class="field" spellcheck=${false} value=${classes.value} placeholder="for example cube, dragon"
            onInput=${(/** @type {any} */ event) => (classes.value = event.currentTarget.value)} />
        </label>
        <${FormatChoice} chosen=${chosen} look=${look} />
      </div>`}
    ${look === null && !looking && html`<${Unreadable} chosen=${chosen} />`}
    ${!(look === null && looking) && html`<${Elsewhere} chosen=${chosen} />`}
    ${look !== null &&
    look.skipped.count > 0 &&
    html`<section class="left-out" aria-label="Skipped frames">
      <h3 class="heading">${plural(look.skipped.count, "frame")} cannot be used and will be skipped</h3>
      <${SkippedTable} frames=${look.skipped.first} count=${look.skipped.count} />
    </section>`}
  </form>`;
}

/** @param {{look: Look}} props */
function Samples({ look }) {
  return html`<ul class="samples" aria-label="Sample frames">
    ${look.sample_frames.slice(0, 6).map(
      (frame) => html`<li key=${frame}><${Thumbnail} address=${actions.lookImageAddress(look.id, frame, SAMPLE_WIDTH)} label=${`Frame ${frame}`} /></li>`,
    )}
  </ul>`;
}

/** @param {{look: Look}} props */
function Facts({ look }) {
  const sizes = look.images_size.map(([width, height]) => `${width} x ${height}`);
  const models = [...new Set(look.cameras.map((camera) => camera.model))];
  const facts = [
    ["Frames", look.frames.toLocaleString("en"), sizes.length > 2 ? `${sizes.length} sizes` : sizes.join(", ")],
    ["Cameras", look.cameras.length.toLocaleString("en"), models.join(", ")],
    ["Camera path", `${look.path_length_m.toFixed(2)} m`, ""],
    ["Classes", look.classes.length.toLocaleString("en"), look.classes.slice(0, 3).join(", ") + (look.classes.length > 3 ? ", …" : "")],
    ["Boxes", look.boxes.toLocaleString("en"), ""],
  ];
  return html`<dl class="facts">
    ${facts.map(([title, value, more]) => html`<div key=${title}><dt class="heading">${title}</dt><dd><strong>${value}</strong> <span class="muted">${more}</span></dd></div>`)}
  </dl>`;
}

/** @param {{look: Look}} props */
function Warnings({ look }) {
  if (look.warnings.length === 0) return null;
  return html`<ul class="warnings" aria-label="Warnings">${look.warnings.map((warning) => html`<li class="problem" key=${warning}>${warning}</li>`)}</ul>`;
}

/** @param {{chosen: import("./draft.js").Chosen, look: Look}} props */
function FormatChoice({ chosen, look }) {
  const possible = look.formats_possible.includes(look.format) ? look.formats_possible : [look.format, ...look.formats_possible];
  if (possible.length === 1) return html`<p><span>Format</span><span class="only-format">${titleOf(look.format)}</span></p>`;
  return html`<label><span>Format</span>
    <select class="field" value=${look.format} disabled=${chosen.looking}
      onChange=${(/** @type {any} */ event) => void lookAt({ ...chosen.source, format: event.currentTarget.value }, chosen.title)}
    >${possible.map((format) => html`<option key=${format} value=${format}>${titleOf(format)}</option>`)}</select>
  </label>`;
}

/** What can be done where it could not be read. @param {{chosen: import("./draft.js").Chosen}} props */
function Unreadable({ chosen: { source, title } }) {
  return html`<div class="unreadable">
    <div class="row">
      <button type="button" class="button" onClick=${() => void lookAt(source, title)}>Look again</button>
      <label><span class="muted">Read it as</span>
        <select class="field" value=${source.format} onChange=${(/** @type {any} */ event) => void lookAt({ ...source, format: event.currentTarget.value }, title)}>
          <option value="auto">what it looks like</option>
          ${readers.value.map((reader) => html`<option key=${reader.format} value=${reader.format}>${reader.title}</option>`)}
        </select>
      </label>
    </div>
    <${KnownRecordings} />
  </div>`;
}

/** For formats that do not say where their images or their camera are. @param {{chosen: import("./draft.js").Chosen}} props */
function Elsewhere({ chosen }) {
  const { source } = chosen;
  const images = useSignal(source.images ?? "");
  const camera = useSignal(source.camera ?? "");
  const path = useSignal(source.path);
  const place = source.root !== undefined ? source.root : "the zip";
  const again = () => {
    const said = (/** @type {string} */ text) => text.trim() || undefined;
    const at = source.upload === undefined ? source.path : path.value.trim();
    void lookAt({ ...source, path: at, images: said(images.value), camera: said(camera.value) }, chosen.title);
  };
  /** @param {string} title @param {import("../../lib/view.js").Signal<string>} value @param {string} example */
  const line = (title, value, example) => html`<label><span>${title}</span>
    <input class="field" spellcheck=${false} placeholder=${example} value=${value.value}
      onInput=${(/** @type {any} */ event) => (value.value = event.currentTarget.value)}
      onKeyDown=${(/** @type {KeyboardEvent} */ event) => {
        if (event.key !== "Enter") return;
        event.preventDefault(); // it asks for another look, not for the import
        again();
      }} />
  </label>`;
  return html`<details class="elsewhere">
    <summary>Images or camera file lie elsewhere</summary>
    <div class="fields">
      ${source.upload !== undefined && line("Folder or file of the recording", path, "all of the zip")}
      ${line("Image folder", images, "as the format implies")}
      ${line("Camera file", camera, "as the format implies")}
      <button type="button" class="button" disabled=${chosen.looking} onClick=${again}>Look there</button>
    </div>
    <p class="muted">Paths from the top of ${place}, with /.</p>
  </details>`;
}
