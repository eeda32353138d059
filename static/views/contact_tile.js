/** One frame on the contact sheet: its photo with the boxes drawn over it. */

import { html, useEffect, useState } from "../lib/view.js";
import { actions, classes, hidden, selected } from "../store.js";
import { FrameImage } from "./frame_image.js";
import { MarksDrawing } from "./marks_drawing.js";

/**
 * @param {object} props
 * @param {number} props.index of the frame
 * @param {readonly import("./contact_labels.js").Drawn[] | null} props.drawn
 * @param {readonly import("./frame_marks.js").Mark[] | null} props.marks as exported, in place of the boxes
 * @param {number} props.width CSS pixels
 * @param {{width: number, height: number} | null} props.size of the image, its own pixels; null: not known yet
 * @param {boolean} props.wanted
 */
export function ContactTile({ index, drawn, marks, width, size, wanted }) {
  return html`<span class="picture">
      <${FrameImage} index=${index} width=${width} wanted=${wanted} />
      ${drawn !== null && size !== null && html`<${Wireframes} drawn=${drawn} size=${size} />`}
      ${marks !== null && size !== null && html`<${MarksDrawing} marks=${marks} view=${[0, 0, size.width, size.height]} pixel=${size.width / width} />`}
    </span>
    <span class="caption"><strong>${index}</strong><${FrameName} index=${index} wanted=${wanted} /></span>`;
}

/** @param {{drawn: readonly import("./contact_labels.js").Drawn[], size: {width: number, height: number}}} props */
function Wireframes({ drawn, size }) {
  const chosen = selected.value;
  // The selected box last: over the others.
  const seen = drawn.filter(({ boxId, inImage }) => inImage && !hidden.value.has(boxId));
  const order = [...seen.filter(({ boxId }) => boxId !== chosen), ...seen.filter(({ boxId }) => boxId === chosen)];
  return html`<svg class="wireframes" viewBox=${`0 0 ${size.width} ${size.height}`} aria-hidden="true">
    ${order.map(
      ({ boxId, classId, wireframe }) =>
        html`<path
          key=${boxId} class=${boxId === chosen ? "selected" : ""} d=${pathOf(wireframe)}
          style=${{ stroke: classes.value.get(classId)?.color ?? "#ffffff" }} data-box=${boxId}
        />`,
    )}
  </svg>`;
}

/** @param {readonly (readonly (readonly [number, number])[])[]} lines image coordinates */
function pathOf(lines) {
  return lines.map((line) => `M${line.map(([x, y]) => `${x} ${y}`).join("L")}`).join("");
}

/** @param {{index: number, wanted: boolean}} props */
function FrameName({ index, wanted }) {
  const [name, setName] = useState("");
  useEffect(() => {
    if (!wanted || name !== "") return;
    let gone = false;
    actions.frameName(index).then(
      (found) => gone || setName(found),
      () => {}, // the sheet says already that the server does not answer
    );
    return () => {
      gone = true;
    };
  }, [index, wanted]);
  return html`<span class="muted" title=${name}>${name.slice(name.lastIndexOf("/") + 1)}</span>`;
}
