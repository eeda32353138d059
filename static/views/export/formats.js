/** The formats to choose from, grouped by what they are for. */

import { html, useId } from "../../lib/view.js";
import { format, writers } from "./draft.js";

/** @typedef {import("./draft.js").Writer} Writer */

/** Which format is for what; one that is in none of them comes last. */
const GROUPS = [
  { title: "Detection", formats: ["yolo", "coco", "voc", "kitti", "compass", "ars"] },
  { title: "Outlines and masks", formats: ["yolo-seg", "yolo-obb", "masks"] },
  { title: "Poses and keypoints", formats: ["yolo-pose", "bop", "dope"] },
  { title: "To look through and mend", formats: ["cvat", "cvat-polygons", "cvat-video"] },
  { title: "Tables and shards", formats: ["parquet", "webdataset", "tfrecord"] },
];

export function Formats() {
  return html`<div class="format-groups" role="radiogroup" aria-label="Format">
    ${grouped(writers.value).map(({ title, found }) => html`<${FormatGroup} key=${title} title=${title} found=${found} />`)}
  </div>`;
}

/** @param {readonly Writer[]} known */
function grouped(known) {
  const groups = GROUPS.map(({ title, formats }) => ({ title, found: formats.flatMap((name) => known.filter((one) => one.format === name)) }));
  const others = known.filter((one) => !GROUPS.some(({ formats }) => formats.includes(one.format)));
  return [...groups, { title: "Others", found: others }].filter(({ found }) => found.length > 0);
}

/** @param {{title: string, found: readonly Writer[]}} props */
function FormatGroup({ title, found }) {
  const id = useId();
  return html`<div class="format-group" role="group" aria-labelledby=${id}>
    <h2 class="heading" id=${id}>${title}</h2>
    <div class="formats">
      ${found.map(
        (writer) => html`<label key=${writer.format} class="card format" data-chosen=${writer.format === format.value} title=${writer.description}>
          <input type="radio" name="format" aria-label=${writer.title} aria-describedby=${`format-${writer.format}`} value=${writer.format} checked=${writer.format === format.value} onChange=${() => (format.value = writer.format)} />
          <span><strong>${writer.title}</strong><span class="meaning" id=${`format-${writer.format}`}>${writer.description}</span></span>
        </label>`,
      )}
    </div>
  </div>`;
}
