/** What can be imported: the formats of recordings, and the files that each needs. */

import { html, signal, useEffect } from "../../lib/view.js";
import { actions } from "../../store.js";

export const readers = signal(/** @type {import("../../store.js").Schemas["ReaderJson"][]} */ ([]));

/** What a format is called, once that is known. @param {string} format */
export function titleOf(format) {
  return readers.value.find((reader) => reader.format === format)?.title ?? format;
}

export function useReaders() {
  useEffect(() => {
    // Only help: without it the formats are called by their keys.
    if (readers.value.length === 0) void actions.formats().then((found) => (readers.value = found.readers), () => {});
  }, []);
}

export function KnownRecordings() {
  useReaders();
  if (readers.value.length === 0) return null;
  return html`<details class="known-recordings">
    <summary>What makes a recording</summary>
    <dl>
      ${readers.value.map(({ format, title, needs }) => html`<div key=${format}><dt><span class="format">${format}</span> ${title}</dt><dd class="muted">${needs}</dd></div>`)}
    </dl>
  </details>`;
}
