/** Where a scrolled element stands, and whether it rests: what virtual scrolling draws from. */

import { useLayoutEffect, useRef, useState } from "./view.js";

/** Milliseconds without scrolling after which it rests. */
const REST = 80;
/** Pixels a millisecond; slower than that, what comes into sight stays long enough to be looked at. */
const SLOW = 0.6;

/**
 * @typedef {object} ScrollPlace
 * @property {number} left CSS pixels
 * @property {number} top
 * @property {number} width of what is in sight
 * @property {number} height
 * @property {boolean} resting it does not scroll, or slowly: what is in sight is worth asking for
 */

/**
 * Follow an element's scrolling and size, at most once a screen refresh.
 * @param {import("./view.js").RefObject<HTMLElement>} ref
 * @returns {ScrollPlace} of zero size until the element is there
 */
export function useScrollPlace(ref) {
  const [place, setPlace] = useState(/** @type {ScrollPlace} */ ({ left: 0, top: 0, width: 0, height: 0, resting: true }));
  const last = useRef({ left: 0, top: 0, at: -Infinity });

  useLayoutEffect(() => {
    const element = ref.current;
    if (element === null) return;
    let refresh = 0;
    let rest = 0;
    let timer = 0;

    /** @param {boolean} resting */
    function read(resting) {
      const { scrollLeft: left, scrollTop: top, clientWidth: width, clientHeight: height } = /** @type {HTMLElement} */ (element);
      setPlace((was) =>
        was.left === left && was.top === top && was.width === width && was.height === height && was.resting === resting
          ? was
          : { left, top, width, height, resting },
      );
    }

    function scrolled() {
      clearTimeout(timer);
      cancelAnimationFrame(rest);
      // The refresh after the pause tells whether it was one, or only a page too busy to scroll.
      timer = setTimeout(() => (rest = requestAnimationFrame(() => read(true))), REST);
      if (refresh !== 0) return;
      refresh = requestAnimationFrame((now) => {
        refresh = 0;
        const { scrollLeft: left, scrollTop: top } = /** @type {HTMLElement} */ (element);
        const way = Math.abs(left - last.current.left) + Math.abs(top - last.current.top);
        // The first movement after a pause is no speed: it may be a whole jump, or the start of a fast drag.
        const slow = now - last.current.at < REST && way < SLOW * (now - last.current.at);
        last.current = { left, top, at: now };
        read(slow);
      });
    }

    const sizes = new ResizeObserver(() => read(true));
    sizes.observe(element);
    element.addEventListener("scroll", scrolled, { passive: true });
    read(true);
    return () => {
      sizes.disconnect();
      element.removeEventListener("scroll", scrolled);
      clearTimeout(timer);
      cancelAnimationFrame(refresh);
      cancelAnimationFrame(rest);
    };
  }, [ref]);

  return place;
}
