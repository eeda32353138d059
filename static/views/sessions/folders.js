/** Browses the folders below the declared roots, and shows which of them are recordings. */

import { Icon } from "../../lib/icon.js";
import { plural } from "../../lib/plural.js";
import { html, signal, useEffect } from "../../lib/view.js";
import { actions } from "../../store.js";
import { choose } from "./draft.js";
import { RootCommand, roots, rootsProblem, useRoots } from "./roots.js";

/** @typedef {import("../../store.js").Schemas["FoldersJson"]} Folders */

/** Where one is; null: above the roots. It stays while the dialog is closed. */
const place = signal(/** @type {{root: string, path: string} | null} */ (null));
const listing = signal(/** @type {{root: string, folders: Folders} | null} */ (null));
const problem = signal(/** @type {string | null} */ (null));

export function FolderBrowser() {
  useRoots();
  const known = roots.value;
  const only = known?.length === 1 ? known[0] : null;
  useEffect(() => {
    if (known !== null && place.value !== null && !known.includes(place.value.root)) place.value = null;
    if (only !== null && place.value === null) void goTo(only, "");
    else if (place.value !== null) void goTo(place.value.root, place.value.path);
  }, [known]);

  if (rootsProblem.value !== null) return html`<p class="problem" role="alert">${rootsProblem.value}</p>`;
  if (known === null) return null;
  if (known.length === 0) return html`<div class="no-roots"><${RootCommand} /></div>`;
  return html`<div class="folders">
    <${Crumbs} only=${only} />
    ${problem.value !== null && html`<p class="problem" role="alert">${problem.value}</p>`}
    ${place.value === null ? html`<${Roots} names=${known} />` : listing.value !== null && html`<${Listing} ...${listing.value} />`}
  </div>`;
}

/** @param {string} root @param {string} path */
async function goTo(root, path) {
  const wanted = { root, path };
  place.value = wanted;
  problem.value = null;
  try {
    const folders = await actions.folders(root, path);
    if (place.value === wanted) listing.value = { root, folders };
  } catch (error) {
    if (place.value === wanted) problem.value = /** @type {Error} */ (error).message;
  }
}

function above() {
  place.value = null;
  listing.value = null;
  problem.value = null;
}

/** @param {{only: string | null}} props the only root there is */
function Crumbs({ only }) {
  if (place.value === null) return html`<p class="crumbs muted">Folders that this server was told of</p>`;
  const { root, path } = place.value;
  const parts = path === "" ? [] : path.split("/");
  const steps = [
    ...(only === null ? [{ title: "Folders", go: above }] : []),
    { title: root, go: () => void goTo(root, "") },
    ...parts.map((part, i) => ({ title: part, go: () => void goTo(root, parts.slice(0, i + 1).join("/")) })),
  ];
  return html`<nav class="crumbs" aria-label="Where in the folders">
    ${steps.map(
      ({ title, go }, i) => html`${i > 0 && html`<span class="muted" aria-hidden="true">/</span>`}
        ${i === steps.length - 1 ? html`<span aria-current="location">${title}</span>` : html`<button class="button link" onClick=${go}>${title}</button>`}`,
    )}
  </nav>`;
}

/** @param {{names: readonly string[]}} props */
function Roots({ names }) {
  return html`<ul class="listing" aria-label="Folders">
    ${names.map(
      (name) => html`<li key=${name}>
        <button class="into" onClick=${() => void goTo(name, "")}><${Icon} name="folder" /><span class="name">${name}</span></button>
      </li>`,
    )}
  </ul>`;
}

/** @param {{root: string, folders: Folders}} props */
function Listing({ root, folders }) {
  const { path } = folders;
  const below = (/** @type {string} */ name) => (path === "" ? name : `${path}/${name}`);
  const isBare = folders.folders.length === 0 && folders.files.length === 0;
  return html`<ul class="listing" aria-label="Folders">
    ${folders.formats.length > 0 &&
    html`<li class="here">
      <span class="into"><${Icon} name="folder-open" /><span class="name">This folder</span></span>
      <${Formats} formats=${folders.formats} /><${Choose} root=${root} path=${path} title=${path.split("/").at(-1) || root} />
    </li>`}
    ${folders.folders.map(
      (folder) => html`<li key=${`folder ${folder.name}`}>
        <button class="into" disabled=${folder.problem !== null} aria-label=${`Open ${folder.name}`} onClick=${() => void goTo(root, below(folder.name))}>
          <${Icon} name="folder" /><span class="name">${folder.name}</span>
          ${folder.images > 0 && html`<span class="muted">${plural(folder.images, "image")}</span>`}
        </button>
        ${folder.problem !== null && html`<span class="problem">${folder.problem}</span>`}
        <${Formats} formats=${folder.formats} />
        ${folder.formats.length > 0 && html`<${Choose} root=${root} path=${below(folder.name)} title=${folder.name} />`}
      </li>`,
    )}
    ${folders.files.map(
      (file) => html`<li key=${`file ${file.name}`}>
        <span class="into"><${Icon} name="clipboard-list" /><span class="name">${file.name}</span></span>
        <${Formats} formats=${file.formats} /><${Choose} root=${root} path=${below(file.name)} title=${file.name} />
      </li>`,
    )}
    ${isBare &&
    html`<li class="bare muted">
      No folders in here${folders.formats.length === 0 && (folders.images > 0 ? `, and its ${plural(folders.images, "image")} come without poses` : ", and no recording")}.
    </li>`}
    ${folders.more && html`<li class="bare muted">There are more; these are the first ${folders.folders.length.toLocaleString("en")}.</li>`}
  </ul>`;
}

/** @param {{formats: readonly string[]}} props */
function Formats({ formats }) {
  return html`${formats.map((format) => html`<span class="format" key=${format}>${format}</span>`)}`;
}

/** @param {{root: string, path: string, title: string}} props */
function Choose({ root, path, title }) {
  const named = title.replace(/\.[^.]+$/, "");
  return html`<button class="button" aria-label=${`Choose ${title}`} onClick=${() => void choose({ root, path, format: "auto" }, title, named || title)}>Choose</button>`;
}
