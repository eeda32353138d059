/** The frame at hand, its original image, with the objects over it as they would be exported. */

import { LazyImage } from "../lib/lazy_image.js";
import { html, useEffect, useLayoutEffect, useMemo, useRef, useSignal } from "../lib/view.js";
import { actions, frame, markFunction, markShape, revision } from "../store.js";
import { FrameMarks } from "./frame_marks.js";
import { MarksDrawing } from "./marks_drawing.js";

/** Widths that the image is asked for in, before the whole. */
const WIDTHS = [640, 1280, 1920];

export function FlatFrame() {
  const marks = useMemo(() => new FrameMarks(), []);
  const pane = useRef(/** @type {HTMLElement | null} */ (null));
  const room = useSignal({ width: 0, height: 0 });
  const camera = useSignal(/** @type {import("../store.js").Camera | null} */ (null));
  const index = frame.value;
  const [way, state] = [`${markFunction.value} ${markShape.value}`, revision.value];
  useEffect(() => marks.want([index]), [index, way, state]);
  useEffect(() => () => marks.want([]), []);
  useEffect(() => {
    let current = true;
    actions.cameraOf(index).then(
      (found) => current && (camera.value = found),
      () => {}, // the marks' problem says that the server does not answer
    );
    return () => void (current = false);
  }, [index]);
  useLayoutEffect(() => {
    const sized = new ResizeObserver(([{ contentRect }]) => (room.value = { width: contentRect.width, height: contentRect.height }));
    sized.observe(/** @type {HTMLElement} */ (pane.current));
    return () => sized.disconnect();
  }, []);

  void marks.version.value;
  const size = camera.value;
  const scale = size === null ? 0 : Math.min(room.value.width / size.width, room.value.height / size.height);
  const needed = size === null ? 0 : size.width * scale * Math.min(2, devicePixelRatio);
  const width = WIDTHS.find((one) => one >= needed);
  const drawn = marks.of(index);
  return html`<section class="flat-frame" ref=${pane} aria-label=${`Frame ${index} as exported`} aria-busy=${drawn === null && marks.problem.value === null}>
    ${size !== null &&
    scale > 0 &&
    html`<div class="photo" style=${{ width: `${size.width * scale}px`, height: `${size.height * scale}px` }}>
      <${LazyImage} address=${actions.imageAddress(index, width === undefined ? {} : { width })} wanted=${true} label=${`Frame ${index}`} reason=${() => actions.imageProblem(index)} />
      ${drawn !== null && html`<${MarksDrawing} marks=${drawn} view=${[0, 0, size.width, size.height]} pixel=${1 / scale} />`}
    </div>`}
    ${marks.problem.value !== null &&
    html`<p class="problem instead" role="alert">The objects could not be drawn as exported: ${marks.problem.value}</p>`}
  </section>`;
}
