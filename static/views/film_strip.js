/** The film strip: every so many frames as thumbnails. Only those in sight, and a few beside them, exist. */

import { Icon } from "../lib/icon.js";
import { niceStep, niceSteps } from "../lib/nice_step.js";
import { useScrollPlace } from "../lib/scroll_place.js";
import { html, useEffect, useLayoutEffect, useRef, useState } from "../lib/view.js";
import { actions, frame, frames } from "../store.js";
import { FrameImage } from "./frame_image.js";

const GAP = 8;
/** Thumbnails that a session opens with, at most: a few screens of them. */
const FIRST_SHOWN = 100;
/** Thumbnails kept ready on each side of what is in sight. */
const MARGIN = 4;
/** Milliseconds after somebody scrolled in which the strip leaves its place alone. */
const OWN_WAY = 700;
/** No browser lays out an element much longer than this, CSS pixels. */
const LONGEST = 15e6;
/** How far Ctrl and the wheel turn for one step of the spacing: a notch, or a good part of a pinch. */
const NOTCH = 40;

/**
 * @param {object} props
 * @param {import("../lib/view.js").ReadonlySignal<readonly import("./scrubber.js").Mark[]>} [props.marks] frames worth pointing at
 * @param {import("../lib/view.js").Signal<{first: number, last: number} | null>} props.shown told which frames are in sight
 * @param {number} props.aspect width by height of the images
 */
export function FilmStrip({ marks, shown, aspect }) {
  const strip = useRef(/** @type {HTMLDivElement | null} */ (null));
  const place = useScrollPlace(strip);
  const count = frames.value;
  const current = frame.value;
  const [chosen, setStep] = useState(/** @type {number | null} */ (null));

  const height = place.height;
  const width = Math.round(height * aspect);
  const pitch = width + GAP;
  const steps = niceSteps(count).filter((step) => (count / step) * pitch <= LONGEST);
  const step = chosen ?? niceStep(count / FIRST_SHOWN);
  const slots = Math.ceil(count / step);
  const slotNow = Math.floor(current / step);

  const scrolledAt = useRef(-Infinity);
  const wentTo = useRef(-1);
  /** The frame that stays where it is while the spacing changes, and where that is. */
  const anchor = useRef(/** @type {{frame: number, x: number} | null} */ (null));
  const turned = useRef(0);

  const first = Math.max(0, Math.floor(place.left / pitch) - MARGIN);
  const last = Math.min(slots - 1, Math.floor((place.left + place.width) / pitch) + MARGIN);

  useEffect(() => {
    if (height === 0 || count === 0) return;
    const inSight = { first: Math.floor(place.left / pitch) * step, last: Math.floor((place.left + place.width) / pitch) * step + step - 1 };
    shown.value = { first: Math.min(count - 1, inSight.first), last: Math.min(count - 1, inSight.last) };
  }, [place, pitch, step, count]);

  /** @param {number} to @param {{x: number}} [about] */
  const changeStep = (to, about) => {
    const element = strip.current;
    if (element === null || to === step) return;
    const x = about?.x ?? slotInSight(element, slotNow * pitch, width) ?? element.clientWidth / 2;
    anchor.current = { frame: ((element.scrollLeft + x) / pitch) * step, x };
    setStep(to);
  };

  useLayoutEffect(() => {
    const element = strip.current;
    if (element === null || anchor.current === null) return;
    element.scrollLeft = (anchor.current.frame / step) * pitch - anchor.current.x;
    anchor.current = null;
  }, [step]);

  // Follow the current frame, unless the hand is on the strip or has just been.
  useLayoutEffect(() => {
    const element = strip.current;
    if (element === null || height === 0) return;
    if (wentTo.current === current || performance.now() - scrolledAt.current < OWN_WAY) return;
    follow(element, slotNow * pitch, width);
  }, [current, height, width, count]);

  useEffect(() => {
    const element = strip.current;
    if (element === null) return;
    /** @param {WheelEvent} event */
    const wheel = (event) => {
      if (event.ctrlKey || event.metaKey) {
        event.preventDefault();
        turned.current += event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? event.deltaY : event.deltaY * NOTCH;
        if (Math.abs(turned.current) < NOTCH) return;
        const to = steps[steps.indexOf(step) + Math.sign(turned.current)];
        turned.current = 0;
        if (to !== undefined) changeStep(to, { x: event.clientX - element.getBoundingClientRect().left });
        return;
      }
      scrolledAt.current = performance.now();
      if (event.deltaX !== 0 || event.deltaY === 0) return;
      event.preventDefault();
      element.scrollLeft += event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? event.deltaY : event.deltaY * pitch;
    };
    const touched = () => (scrolledAt.current = performance.now());
    element.addEventListener("wheel", wheel, { passive: false });
    element.addEventListener("touchmove", touched, { passive: true });
    return () => {
      element.removeEventListener("wheel", wheel);
      element.removeEventListener("touchmove", touched);
    };
  });

  /** @param {number} index */
  const go = (index) => {
    wentTo.current = index;
    actions.goTo(index);
  };
  /** @param {KeyboardEvent} event */
  const keyed = (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || count === 0) return;
    if (event.key === "Enter") actions.enterFrame(current);
    else {
      const page = Math.max(1, Math.floor(place.width / pitch) - 1);
      const to = { ArrowLeft: slotNow - 1, ArrowRight: slotNow + 1, PageUp: slotNow - page, PageDown: slotNow + page, Home: 0, End: slots - 1 }[event.key];
      if (to === undefined) return;
      wentTo.current = -1;
      scrolledAt.current = -Infinity;
      actions.goTo(Math.max(0, Math.min(slots - 1, to)) * step);
    }
    event.preventDefault();
    event.stopPropagation();
  };

  const at = steps.indexOf(step);
  const marked = new Map((marks?.value ?? []).map((mark) => [Math.floor(mark.frame / step), mark]));
  const frameOf = (/** @type {number} */ slot) => (slot === slotNow ? current : slot * step);
  return html`<div class="film-strip">
    <div
      ref=${strip} class="strip" role="listbox" tabindex="0" aria-label="Film strip" aria-orientation="horizontal"
      aria-activedescendant=${slotNow >= first && slotNow <= last ? `strip-${slotNow}` : undefined} onKeyDown=${keyed}
    >
      <div class="strip-length" style=${{ width: `${Math.max(0, slots * pitch - GAP)}px` }}>
        ${height > 0 &&
        count > 0 &&
        Array.from({ length: Math.max(0, last - first + 1) }, (_, i) => first + i).map(
          (slot) =>
            html`<div
              key=${slot} id=${`strip-${slot}`} class="slot" role="option" aria-selected=${slot === slotNow}
              aria-setsize=${slots} aria-posinset=${slot + 1} aria-label=${`Frame ${frameOf(slot)}`}
              style=${{ left: `${slot * pitch}px`, width: `${width}px` }}
              onClick=${() => go(frameOf(slot))} onDblClick=${() => actions.enterFrame(frameOf(slot))}
            >
              <${FrameImage} index=${frameOf(slot)} width=${width} wanted=${place.resting} />
              <span class="index">${frameOf(slot)}</span>
              ${marked.has(slot) && html`<span class="mark" data-faint=${marked.get(slot)?.faint ?? false} title=${marked.get(slot)?.title} style=${{ background: marked.get(slot)?.color }} />`}
            </div>`,
        )}
      </div>
    </div>
    ${steps.length > 1 &&
    html`<div class="spacing" role="group" aria-label="Spacing of the film strip">
      <button
        type="button" class="button quiet icon-only" aria-label="Closer frames" title="Closer frames (Ctrl+wheel)"
        disabled=${at <= 0} onClick=${() => changeStep(/** @type {number} */ (steps[at - 1]))}
      ><${Icon} name="plus" /></button>
      <span class="step" title="The film strip shows every so many frames">${step === 1 ? "all" : `1:${step}`}</span>
      <button
        type="button" class="button quiet icon-only" aria-label="Frames further apart" title="Frames further apart (Ctrl+wheel)"
        disabled=${at < 0 || at >= steps.length - 1} onClick=${() => changeStep(/** @type {number} */ (steps[at + 1]))}
      ><${Icon} name="minus" /></button>
    </div>`}
  </div>`;
}

/**
 * Where the current slot's middle is seen, or null where it is out of sight.
 * @param {HTMLElement} element @param {number} left @param {number} width
 */
function slotInSight(element, left, width) {
  const x = left + width / 2 - element.scrollLeft;
  return x >= 0 && x <= element.clientWidth ? x : null;
}

/**
 * Bring a slot into sight: a little if it is near, to the middle if it is far.
 * @param {HTMLElement} element @param {number} left @param {number} width
 */
function follow(element, left, width) {
  const { scrollLeft, clientWidth } = element;
  const [start, end] = [left - width - GAP, left + 2 * (width + GAP)];
  if (end < scrollLeft - clientWidth || start > scrollLeft + 2 * clientWidth) {
    element.scrollLeft = left + width / 2 - clientWidth / 2;
  } else if (start < scrollLeft) element.scrollLeft = start;
  else if (end > scrollLeft + clientWidth) element.scrollLeft = end - clientWidth;
}
