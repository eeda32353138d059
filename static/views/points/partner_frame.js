/** A second frame from which the same thing is seen from another side. */

import { actions } from "../../store.js";

/** Degrees between the views at which a point's distance is well known and the same corner still seen. */
const LEAST = 20;
const MOST = 60;
const BEST = 40;
/** Frames that are looked at, spread over the recording. */
const CANDIDATES = 24;
/** Requests under way at once. */
const TOGETHER = 4;

/** @typedef {{frame: number, x: number, y: number}} Sighting */
/** @typedef {{frame: number, degrees: number, px: number}} Candidate */
/** @typedef {{frame: number, degrees: number | null}} Partner degrees between the views; null: not known */

/**
 * The frame that makes a good pair with what is seen at a place: 20 to 60 degrees apart, and looking at the same thing.
 *
 * The server says the angle between two views of a point; here the point is the one nearest to the line of sight from
 * the one frame and to the middle of the other, so that the angle is about right where the middle shows the object.
 * @param {Sighting} seen
 * @param {number} count frames of the recording
 * @param {{mustShow: boolean}} options `mustShow`: the point is known, and the frame must show where it can be
 * @returns {Promise<Partner | null>} null: there is no other frame
 */
export async function partnerOf(seen, count, { mustShow }) {
  const found = /** @type {Candidate[]} */ ([]);
  const waiting = candidatesOf(seen.frame, count);
  if (waiting.length === 0) return null;
  const work = async () => {
    for (let frame = waiting.shift(); frame !== undefined; frame = waiting.shift()) {
      const candidate = await looked(seen, frame);
      if (candidate !== null) found.push(candidate);
    }
  };
  await Promise.all(Array.from({ length: TOGETHER }, work));
  found.sort((a, b) => cost(a) - cost(b));
  for (const { frame, degrees } of found) {
    if (!mustShow || (await shows(seen, frame))) return { frame, degrees };
  }
  return { frame: (seen.frame + Math.max(1, Math.round(count / 4))) % count, degrees: null };
}

/** Whether an angle is one at which corners are found well. @param {number} degrees */
export function isGoodAngle(degrees) {
  return degrees >= LEAST && degrees <= MOST;
}

/** @param {number} frame @param {number} count */
function candidatesOf(frame, count) {
  const spread = Array.from({ length: Math.min(count, CANDIDATES) }, (_, i) => Math.floor(((i + 0.5) * count) / Math.min(count, CANDIDATES)));
  return spread.filter((one) => one !== frame);
}

/** @param {Sighting} seen @param {number} frame @returns {Promise<Candidate | null>} null: they look at nothing together */
async function looked(seen, frame) {
  try {
    const { width, height } = await actions.cameraOf(frame);
    const { angle_degrees, residuals_px } = await actions.locatePoint([seen, { frame, x: width / 2, y: height / 2 }]);
    return { frame, degrees: angle_degrees, px: Math.max(...residuals_px) / Math.max(width, height) };
  } catch {
    // Parallel views, or such that look away from each other: no partner, which the server says as a problem.
    return null;
  }
}

/** @param {Candidate} candidate */
function cost({ degrees, px }) {
  const off = Math.max(LEAST - degrees, degrees - MOST, 0);
  return (off > 0 ? 10 + off : 0) + px + Math.abs(degrees - BEST) / 200;
}

/** @param {Sighting} seen @param {number} frame */
async function shows(seen, frame) {
  return actions.epipolar(seen, frame).then(
    (lines) => lines.length > 0,
    () => false, // taken at the same place
  );
}
