/** The line over all frames: where one is, where others are, and the quickest way to anywhere else. */

import { html, useLayoutEffect, useRef, useState } from "../lib/view.js";
import { niceStep } from "../lib/nice_step.js";
import { personColor } from "../lib/person.js";
import { actions, frame, frames, jump, people } from "../store.js";
import { FrameImage } from "./frame_image.js";

/** Between two ticks, CSS pixels. */
const TICK_GAP = 9;
/** Milliseconds that the pointer rests before a frame's image is asked for. */
const REST = 80;
const PREVIEW_WIDTH = 176;

/** `faint`: it is not sure yet. @typedef {{frame: number, color: string, title: string, faint?: boolean}} Mark */

/**
 * @param {object} props
 * @param {import("../lib/view.js").ReadonlySignal<readonly Mark[]>} [props.marks] frames worth pointing at
 * @param {import("../lib/view.js").ReadonlySignal<{first: number, last: number} | null>} props.shown what the film strip shows
 * @param {number} props.aspect width by height of the images
 */
export function Scrubber({ marks, shown, aspect }) {
  const track = useRef(/** @type {HTMLDivElement | null} */ (null));
  const [width, setWidth] = useState(0);
  const [hover, setHover] = useState(/** @type {{index: number, x: number, y: number} | null} */ (null));
  const count = frames.value;

  useLayoutEffect(() => {
    const element = track.current;
    if (element === null) return;
    const sizes = new ResizeObserver(() => setWidth(element.clientWidth));
    sizes.observe(element);
    setWidth(element.clientWidth);
    return () => sizes.disconnect();
  }, []);

  /** @param {PointerEvent} event */
  const indexAt = (event) => {
    const { left, width } = /** @type {HTMLElement} */ (track.current).getBoundingClientRect();
    return Math.max(0, Math.min(count - 1, Math.floor(((event.clientX - left) / width) * count)));
  };
  /** @param {PointerEvent} event */
  const pressed = (event) => {
    if (event.button !== 0 || count === 0) return;
    const element = /** @type {HTMLElement} */ (track.current);
    element.setPointerCapture(event.pointerId);
    actions.goTo(indexAt(event));
  };
  /** @param {PointerEvent} event */
  const moved = (event) => {
    if (count === 0) return;
    const index = indexAt(event);
    const { left, top, width } = /** @type {HTMLElement} */ (track.current).getBoundingClientRect();
    setHover({ index, x: left + ((index + 0.5) / count) * width, y: top });
    const dragging = /** @type {HTMLElement} */ (track.current).hasPointerCapture(event.pointerId);
    if (dragging && index !== frame.peek()) actions.goTo(index);
  };
  /** @param {KeyboardEvent} event */
  const keyed = (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const to = target(event, frame.peek(), count);
    if (to === null) return;
    event.preventDefault();
    event.stopPropagation();
    actions.goTo(Math.max(0, Math.min(count - 1, to)));
  };

  /** @param {number} index */
  const place = (index) => `${((index + 0.5) / Math.max(1, count)) * 100}%`;
  const span = shown.value;
  const others = people.value.filter((person) => !person.own && person.frame !== null);
  return html`<div class="scrubber">
    <span class="end" aria-hidden="true">${count === 0 ? "" : 0}</span>
    <div
      ref=${track} class="track" role="slider" tabindex="0" aria-label="Frame" aria-orientation="horizontal"
      aria-valuemin="0" aria-valuemax=${Math.max(0, count - 1)} aria-valuenow=${frame.value}
      aria-valuetext=${`Frame ${frame.value} of 0 to ${Math.max(0, count - 1)}`} aria-disabled=${count === 0}
      onPointerDown=${pressed} onPointerMove=${moved} onPointerLeave=${() => setHover(null)} onKeyDown=${keyed}
    >
      <${Ticks} width=${width} count=${count} />
      ${span !== null &&
      html`<span class="span" style=${{ left: `${(span.first / count) * 100}%`, width: `${((span.last + 1 - span.first) / count) * 100}%` }} />`}
      ${(marks?.value ?? []).map(
        (mark) =>
          html`<span key=${`m${mark.frame}`} class="mark" data-faint=${mark.faint ?? false} title=${mark.title} style=${{ left: place(mark.frame), background: mark.color }} />`,
      )}
      ${others.map(
        (person) =>
          html`<span
            key=${`p${person.view}`} class="mark person-mark" title=${`${person.name || "Someone"} is at frame ${person.frame}`}
            style=${{ left: place(person.frame ?? 0), background: personColor(person.view) }}
          />`,
      )}
      ${count > 0 && html`<span class="marker" style=${{ left: place(frame.value) }} />`}
    </div>
    <span class="end" aria-hidden="true">${count === 0 ? "" : count - 1}</span>
    ${hover !== null && hover.index < count && html`<${Preview} ...${hover} aspect=${aspect} />`}
  </div>`;
}

/**
 * Where a key leads, or null where it leads nowhere.
 * @param {KeyboardEvent} event
 * @param {number} now
 * @param {number} count
 */
function target(event, now, count) {
  const far = event.shiftKey ? jump.peek() : 1;
  switch (event.key) {
    case "ArrowLeft":
    case "ArrowDown":
      return now - far;
    case "ArrowRight":
    case "ArrowUp":
      return now + far;
    case "PageDown":
      return now - jump.peek();
    case "PageUp":
      return now + jump.peek();
    case "Home":
      return 0;
    case "End":
      return count - 1;
    default:
      return null;
  }
}

/**
 * Lines between the frames, or between every so many of them, so that they stay apart.
 * @param {{width: number, count: number}} props
 */
function Ticks({ width, count }) {
  if (width === 0 || count < 2) return null;
  const step = niceStep((TICK_GAP * count) / width);
  let path = "";
  for (let i = step; i < count; i += step) path += `M${(i / count) * width} 0V12`;
  return html`<svg class="ticks" width=${width} height="12" aria-hidden="true"><path d=${path} /></svg>`;
}

/**
 * The frame under the pointer, above the bar.
 * @param {{index: number, x: number, y: number, aspect: number}} props
 */
function Preview({ index, x, y, aspect }) {
  const [rested, setRested] = useState(-1);
  useLayoutEffect(() => {
    const timer = setTimeout(() => setRested(index), REST);
    return () => clearTimeout(timer);
  }, [index]);
  const height = Math.round(PREVIEW_WIDTH / aspect);
  const left = Math.max(8, Math.min(innerWidth - PREVIEW_WIDTH - 8, x - PREVIEW_WIDTH / 2));
  return html`<div class="scrub-preview" style=${{ left: `${left}px`, top: `${y - height - 34}px`, width: `${PREVIEW_WIDTH}px` }}>
    <div class="picture" style=${{ height: `${height}px` }}>
      <${FrameImage} index=${index} width=${PREVIEW_WIDTH} wanted=${rested === index} />
    </div>
    <span>${index}</span>
  </div>`;
}
