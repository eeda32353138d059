/** The frames in which an error of the selected box would show most, with the box drawn over them as it is now. */

import { paced } from "../lib/paced.js";
import { html, useEffect, useMemo, useRef, useSignal } from "../lib/view.js";
import * as store from "../store.js";
import { FrameMarks } from "./frame_marks.js";
import { MarksDrawing } from "./marks_drawing.js";

/** @typedef {import("../store.js").Schemas["TellingFrameJson"]} TellingFrame */
/** @typedef {[number, number][][]} Lines */
/** @typedef {{place: {T_world_box: import("../store.js").Transform, size: [number, number, number]}, frames: number[]}} Wish */

const COUNT = 6;
/** Milliseconds between two redrawings. */
const GAP = 100;
/** CSS pixels that one is about as wide as; pictures are asked for in widths that others use, too. */
const WIDTH = 96;
const WIDTHS = [160, 320];

export function TellingFrames() {
  const id = store.selected.value;
  const box = id === null ? undefined : store.boxes.value.get(id);
  return box === undefined ? null : html`<${Strip} key=${box.id} box=${box} />`;
}

/** @param {{box: import("../store.js").Box}} props as it is stored */
function Strip({ box }) {
  const frames = useSignal(/** @type {TellingFrame[] | null} */ (null));
  const lines = useSignal(/** @type {ReadonlyMap<number, Lines>} */ (new Map()));
  const problem = useSignal(/** @type {string | null} */ (null));
  const { T_world_box, size } = box;
  const stored = JSON.stringify([T_world_box, size]);
  const isOpen = store.line.value === "open";

  // While a box is dragged nothing is stored, and so the frames stay.
  useEffect(() => {
    let current = true;
    store.actions.tellingFrames(box.id).then(
      (found) => {
        if (!current) return;
        frames.value = found;
        problem.value = null;
      },
      (error) => current && (problem.value = error.message),
    );
    return () => void (current = false);
  }, [stored, isOpen]);

  const pace = useRef(/** @type {ReturnType<typeof paced<Wish>> | null} */ (null));
  useEffect(() => {
    let current = true;
    pace.current = paced(async (wish) => {
      try {
        const seen = await store.actions.labelsOf([wish.place], wish.frames);
        if (!current) return;
        lines.value = new Map(seen.map(({ frame, labels }) => [frame, labels[0]?.wireframe ?? []]));
        problem.value = null;
      } catch (error) {
        if (current) problem.value = /** @type {Error} */ (error).message;
      }
    }, GAP);
    return () => {
      current = false;
      pace.current?.stop();
    };
  }, []);
  const seen = store.shownBoxes.value.get(box.id) ?? box;
  const wish = frames.value === null ? null : JSON.stringify({ place: { T_world_box: seen.T_world_box, size: seen.size }, frames: frames.value.map(({ frame }) => frame) });
  useEffect(() => {
    if (wish !== null && frames.value !== null && frames.value.length > 0) pace.current?.ask(JSON.parse(wish));
  }, [wish, isOpen]);

  const marks = useMemo(() => new FrameMarks(), []);
  // While it is dragged its edges say where it is.
  const isMarked = store.markFunction.value !== "" && seen === box;
  const way = `${isMarked} ${store.markFunction.value} ${store.markShape.value} ${store.revision.value}`;
  useEffect(() => marks.want(isMarked ? (frames.value ?? []).map(({ frame }) => frame) : []), [way, frames.value]);
  useEffect(() => () => marks.want([]), []);
  void marks.version.value;

  const colour = store.classes.value.get(box.class_id)?.color ?? "currentColor";
  const found = frames.value;
  return html`<section class="panel-section" aria-label="Where an error shows most">
    <h2 class="heading section-head" title="Of all frames, these together show every kind of error of this box best. Click one to stand there.">
      Where an error shows most
    </h2>
    ${found !== null && found.length === 0 && html`<p class="muted">No frame shows this box. Move it to where the cameras look.</p>`}
    ${(found === null || found.length > 0) &&
    html`<ul class="telling">
      ${found === null
        ? Array.from({ length: COUNT }, (_, i) => html`<li key=${i} class="tile" aria-hidden="true"></li>`)
        : found.map((one) => html`<${Tile} key=${one.frame} one=${one} id=${box.id} marks=${isMarked ? marks.of(one.frame) : null} lines=${lines.value.get(one.frame)} colour=${colour} />`)}
    </ul>`}
    ${(problem.value ?? marks.problem.value) !== null && html`<p class="problem" role="alert">${problem.value ?? marks.problem.value}</p>`}
  </section>`;
}

/**
 * `marks`: as exported, in place of the lines.
 * @param {{one: TellingFrame, id: number, marks: readonly import("./frame_marks.js").Mark[] | null, lines: Lines | undefined, colour: string}} props
 */
function Tile({ one, id, marks, lines, colour }) {
  const { frame, px_per_mm, crop } = one;
  const broken = useSignal(/** @type {string | null} */ (null));
  // The lines are drawn over the picture that is seen, which is the one before until the next is there.
  const seen = useSignal(/** @type {TellingFrame["crop"] | null} */ (null));
  const width = WIDTHS.find((one) => one >= WIDTH * devicePixelRatio) ?? WIDTHS[WIDTHS.length - 1];
  const address = store.actions.imageAddress(frame, { width, crop });
  const failed = () => {
    broken.value = "This image cannot be shown.";
    store.actions.imageProblem(frame).then(
      (why) => (broken.value = why),
      () => {}, // what is said already is all that is known
    );
  };
  const shift = `${px_per_mm >= 10 ? px_per_mm.toFixed(0) : px_per_mm >= 0.1 ? px_per_mm.toFixed(1) : px_per_mm.toFixed(2)} px`;
  const [x0, y0, x1, y1] = seen.value ?? crop;
  return html`<li class="tile">
    <button
      aria-label=${`Enter frame ${frame}, where 1 mm is up to ${shift}`} aria-current=${store.mode.value === "frame" && store.frame.value === frame ? "true" : undefined}
      onClick=${() => store.actions.enterFrame(frame)}
    >
      <img
        alt="" src=${address} decoding="async" draggable=${false} hidden=${broken.value !== null} onError=${failed}
        onLoad=${() => {
          seen.value = crop;
          broken.value = null;
        }}
      />
      ${broken.value !== null && html`<span class="broken" title=${broken.value}>${broken.value}</span>`}
      ${marks !== null && seen.value !== null && broken.value === null &&
      html`<${MarksDrawing} marks=${marks} view=${[x0, y0, x1 - x0, y1 - y0]} pixel=${(x1 - x0) / WIDTH} only=${id} />`}
      ${marks === null && lines !== undefined && seen.value !== null && broken.value === null &&
      html`<svg viewBox=${`${x0} ${y0} ${x1 - x0} ${y1 - y0}`} aria-hidden="true">
        ${["halo", "edge"].map((name) => html`<g class=${name} key=${name} style=${{ stroke: name === "edge" ? colour : undefined }}>
          ${lines.map((line, i) => html`<polyline key=${i} points=${line.map(([x, y]) => `${x},${y}`).join(" ")} />`)}
        </g>`)}
      </svg>`}
      <span class="number" aria-hidden="true">${frame}</span>
      <span class="badge" aria-hidden="true" title=${`A corner of the box that is off by 1 mm is drawn off by up to ${shift} in this frame.`}>1 mm = ${shift}</span>
    </button>
  </li>`;
}
