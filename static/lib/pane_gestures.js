/** What pointers do to a pane: press, drag, pan, pinch, wheel; mouse, pen and touch alike. */

/** @typedef {import("./image_view.js").Place} Place */

/**
 * Whoever takes a press gets its moves until it ends. Places are in the pane.
 * @typedef {object} Drag
 * @property {(at: Place) => void} move
 * @property {(at: Place) => void} end
 * @property {() => void} cancel
 */

/**
 * @typedef {object} Gestures
 * @property {(at: Place, event: PointerEvent) => Drag | null} press the main button or a finger went down; null: a click or a pan
 * @property {(at: Place, event: PointerEvent) => void} click it came up again at the same place
 * @property {(dx: number, dy: number) => void} pan
 * @property {(factor: number, about: Place) => void} magnify
 * @property {(at: Place | null, touch: boolean) => void} hover null: the pointer has left
 */

/** CSS pixels that a hand moves while it clicks; a finger, more. */
const STILL = 4;
const STILL_FINGER = 10;
const LINE = 16;

/**
 * @param {HTMLElement} element
 * @param {Gestures} gestures
 * @returns {() => void} that stops watching
 */
export function watchGestures(element, gestures) {
  /** Pointers that are down, where they were last. @type {Map<number, Place>} */
  const down = new Map();
  /** @type {{drag: Drag | null, start: Place, panning: boolean, pinched: boolean} | null} */
  let press = null;
  let space = false;
  /** Where a pointer was last, to fractions of a pixel, which a wheel does not tell. @type {Place} */
  let pointer = { x: NaN, y: NaN };

  /** @param {MouseEvent} event @returns {Place} */
  const placeOf = (event) => {
    const { left, top } = element.getBoundingClientRect();
    return { x: event.clientX - left - element.clientLeft, y: event.clientY - top - element.clientTop };
  };

  /** @param {PointerEvent} event */
  function pressed(event) {
    if (event.button > 1) return;
    const at = placeOf(event);
    element.setPointerCapture(event.pointerId);
    down.set(event.pointerId, at);
    if (down.size === 1) {
      const pans = event.button === 1 || space;
      press = { drag: pans ? null : gestures.press(at, event), start: at, panning: pans, pinched: false };
      // No scrolling by the middle button; the focus goes where the click does.
      if (event.button === 1) event.preventDefault();
    } else if (press !== null) {
      press.drag?.cancel();
      press = { drag: null, start: at, panning: true, pinched: true };
    }
  }

  /** @param {PointerEvent} event */
  function moved(event) {
    const at = placeOf(event);
    const before = down.get(event.pointerId);
    pointer = at;
    gestures.hover(at, event.pointerType === "touch");
    if (before === undefined || press === null) return;
    if (down.size === 2) {
      const other = /** @type {Place} */ ([...down].find(([id]) => id !== event.pointerId)?.[1]);
      gestures.pan((at.x - before.x) / 2, (at.y - before.y) / 2);
      const [was, is] = [distance(before, other), distance(at, other)];
      if (was > 0 && is > 0) gestures.magnify(is / was, { x: (at.x + other.x) / 2, y: (at.y + other.y) / 2 });
    } else if (press.drag !== null) press.drag.move(at);
    else {
      const still = event.pointerType === "touch" ? STILL_FINGER : STILL;
      if (!press.panning && distance(at, press.start) <= still) return;
      // From where it was pressed, so that the image does not lag behind the hand.
      const from = press.panning ? before : press.start;
      press.panning = true;
      gestures.pan(at.x - from.x, at.y - from.y);
    }
    down.set(event.pointerId, at);
  }

  /** @param {PointerEvent} event */
  function released(event) {
    if (!down.delete(event.pointerId) || press === null) return;
    const at = placeOf(event);
    if (down.size === 0) {
      if (press.drag !== null) press.drag.end(at);
      else if (!press.panning) gestures.click(at, event);
      press = null;
    }
    if (event.pointerType === "touch") gestures.hover(null, true);
  }

  /** @param {PointerEvent} event */
  function lost(event) {
    if (!down.delete(event.pointerId) || press === null) return;
    press.drag?.cancel();
    press = null;
    gestures.hover(null, event.pointerType === "touch");
  }

  /** @param {PointerEvent} event */
  function left(event) {
    if (!down.has(event.pointerId)) gestures.hover(null, event.pointerType === "touch");
  }

  /** @param {WheelEvent} event */
  function wheeled(event) {
    event.preventDefault();
    const turn = event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? event.deltaY : event.deltaY * LINE;
    // Browsers tell a pinch on a touch pad as a wheel with Ctrl, in small numbers.
    const at = placeOf(event);
    gestures.magnify(Math.exp(-turn * (event.ctrlKey ? 0.01 : 0.0018)), distance(at, pointer) < 2 ? pointer : at);
  }

  /** @param {KeyboardEvent} event */
  function keyed(event) {
    if (event.code !== "Space") return;
    space = event.type === "keydown";
    if (document.activeElement === element) event.preventDefault();
    element.classList.toggle("panning", space);
  }
  function blurred() {
    space = false;
    element.classList.remove("panning");
  }

  const stopped = new AbortController();
  const { signal } = stopped;
  element.addEventListener("pointerdown", pressed, { signal });
  element.addEventListener("pointermove", moved, { signal });
  element.addEventListener("pointerup", released, { signal });
  element.addEventListener("pointercancel", lost, { signal });
  element.addEventListener("pointerleave", left, { signal });
  element.addEventListener("wheel", wheeled, { passive: false, signal });
  element.addEventListener("keydown", keyed, { signal });
  element.addEventListener("keyup", keyed, { signal });
  element.addEventListener("blur", blurred, { signal });
  return () => stopped.abort();
}

/** @param {Place} a @param {Place} b */
function distance(a, b) {
  return Math.hypot(a.x - b.x, a.y - b.y);
}
