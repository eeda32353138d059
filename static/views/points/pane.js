/** One of the two panes: a frame in its own pixels, with the corners that were clicked in it. */

import { Icon } from "../../lib/icon.js";
import { ImagePane } from "../../lib/image_pane.js";
import { html, useEffect, useLayoutEffect, useRef, useState } from "../../lib/view.js";
import { WholeField } from "../../lib/whole_field.js";
import { actions, frames } from "../../store.js";
import { corners, current, choose, mark, move } from "./corners.js";

/** Over a photo it is the photo that colours must stand out from, not the page's theme. */
const CURRENT = "#4aa8ff";
const OTHERS = "#ffffff";
/** Of the edges between the corners: along z, x and y. */
const AXES = ["#6cb6ff", "#ff7b72", "#56d364"];

/**
 * @param {object} props
 * @param {string} props.name "Left" or "Right"
 * @param {number} props.frame
 * @param {number | null} props.other the frame of the other pane
 * @param {boolean} props.active whether the film strip is for this pane
 * @param {(frame: number) => void} props.onFrame
 * @param {() => void} props.onActive
 * @param {(() => void) | null} props.onSuggest find a frame that goes with the other pane's
 * @param {string | null} props.note about the frame that was found
 */
export function PointsPane({ name, frame, other, active, onFrame, onActive, onSuggest, note }) {
  const place = useRef(/** @type {HTMLDivElement | null} */ (null));
  const pane = useRef(/** @type {ImagePane | null} */ (null));
  const frameNow = useRef(frame);
  const [zoom, setZoom] = useState(1);
  const [broken, setBroken] = useState(/** @type {string | null} */ (null));
  const count = frames.value;
  const corner = current.value;

  useLayoutEffect(() => {
    const made = new ImagePane(/** @type {HTMLDivElement} */ (place.current), {
      onClick: (at) => mark(frameNow.current, at),
      onChoosePoint: (id) => choose(Number(id)),
      onMovePoint: (id, to) => move(Number(id), frameNow.current, to),
      onView: (view) => setZoom(view.zoom),
    });
    pane.current = made;
    return () => made.stop();
  }, []);

  // With the frame's number, not after it: a click must never count for a frame that is not yet seen.
  useLayoutEffect(() => {
    frameNow.current = frame;
    setBroken(null);
    const address = actions.imageAddress(frame);
    pane.current?.show(address).then(async (result) => {
      if (result !== "failed") return;
      const why = await actions.imageProblem(frame);
      if (frameNow.current === frame) setBroken(why);
    });
  }, [frame]);

  const curve = useCurve(corner, frame);
  const all = corners.value;
  useLayoutEffect(() => {
    if (pane.current === null) return;
    const seen = all.map((sightings) => sightings.get(frame));
    const edges = AXES.flatMap((color, i) => {
      const [a, b] = [seen[i], seen[i + 1]];
      /** @type {[number, number][]} */
      const points = a && b ? [[a.x, a.y], [b.x, b.y]] : [];
      return points.length > 0 ? [{ points, color, width: 1.5 }] : [];
    });
    pane.current.overlay = {
      lines: [...curve.lines.map((points) => ({ points, color: CURRENT, width: 1.5, dash: [7, 5] })), ...edges],
      points: seen.flatMap((at, i) =>
        at === undefined ? [] : [{ id: String(i), ...at, label: `P${i}`, color: i === corner ? CURRENT : OTHERS, active: i === corner }],
      ),
    };
  }, [all, frame, corner, curve]);

  const same = other === frame;
  const trouble = broken ?? (same ? `Both panes show frame ${frame}. A corner must be seen in two frames: take another one on one side.` : curve.problem);
  const label = `${name} pane, frame ${frame}. Arrow keys move the crosshair or the corner, Enter marks P${corner}.`;
  return html`<section class="points-pane" data-active=${active} onFocusIn=${onActive} onPointerDown=${onActive}>
    <header>
      <button type="button" class="button quiet icon-only" aria-label="Previous frame" disabled=${frame <= 0} onClick=${() => onFrame(frame - 1)}><${Icon} name="chevron-left" /></button>
      <label class="row">Frame
        <${WholeField}
          label=${`Frame of the ${name.toLowerCase()} pane`} kind="frame" least=${0} most=${count - 1} value=${frame}
          onCommit=${(/** @type {number} */ asked) => onFrame(Math.max(0, Math.min(count - 1, asked)))}
        />
      </label>
      <button type="button" class="button quiet icon-only" aria-label="Next frame" disabled=${frame >= count - 1} onClick=${() => onFrame(frame + 1)}><${Icon} name="chevron-right" /></button>
      ${onSuggest !== null &&
      html`<button type="button" class="button quiet" title="Find a frame that sees the same from another side" onClick=${onSuggest}>Good angle</button>`}
      <span class="muted note">${note}</span>
      <button type="button" class="button quiet zoom" title="Whole image (0); pixel by pixel (1)" onClick=${() => pane.current?.fit()}>${zoom.toFixed(zoom < 10 ? 1 : 0)}x</button>
    </header>
    <div class="canvas" ref=${place} tabindex="0" role="application" aria-label=${label}></div>
    ${trouble !== null && html`<p class="problem pane-problem" role="alert">${trouble}</p>`}
  </section>`;
}

/** @typedef {{lines: readonly (readonly [number, number][])[], problem: string | null}} Curve */
/** @type {Curve} */
const NO_CURVE = { lines: [], problem: null };

/**
 * Where a frame can show a corner that is seen in another frame.
 * @param {number} corner
 * @param {number} frame
 * @returns {Curve} while the corner is dragged, that of a little earlier
 */
function useCurve(corner, frame) {
  const elsewhere = [...corners.value[corner]].find(([seenIn]) => seenIn !== frame);
  const [known, setKnown] = useState(/** @type {Curve & {corner: number, frame: number}} */ ({ ...NO_CURVE, corner, frame }));
  const wish = elsewhere === undefined ? null : JSON.stringify([corner, frame, elsewhere[0], elsewhere[1].x, elsewhere[1].y]);
  /** What is to be asked next: a drag moves faster than answers come. */
  const next = useRef(/** @type {string | null} */ (null));
  const asking = useRef(false);

  useEffect(() => {
    next.current = wish;
    if (wish === null) setKnown({ ...NO_CURVE, corner, frame });
    else if (!asking.current) void ask();

    async function ask() {
      asking.current = true;
      for (let asked = null; next.current !== null && next.current !== asked; ) {
        asked = next.current;
        const [corner, frame, of, x, y] = JSON.parse(asked);
        const found = await actions.epipolar({ frame: of, x, y }, frame).then(
          (lines) => ({ lines, problem: lines.length > 0 ? null : `Frame ${frame} does not show where P${corner} can be. Take another frame.` }),
          (/** @type {Error} */ error) => ({ lines: [], problem: error.message }),
        );
        if (next.current !== null) setKnown({ ...found, corner, frame });
      }
      asking.current = false;
    }
  }, [wish]);
  useEffect(() => () => void (next.current = null), []);
  return known.corner === corner && known.frame === frame ? known : NO_CURVE;
}
