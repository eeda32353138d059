/** Two angles in degrees as people type them: `0 to 180`. */

const MOST = 360;
const PAIR = /^(-?\d+(?:\.\d+)?)\s*°?\s*(?:to|:|,|–|\s)\s*(-?\d+(?:\.\d+)?)\s*°?$/;

/** @param {string} text @returns {{value: [number, number] | null} | {problem: string}} null: none are typed */
export function parseAngles(text) {
  const typed = text.trim();
  if (typed === "") return { value: null };
  const [, from, to] = PAIR.exec(typed) ?? [];
  if (from === undefined) return { problem: `“${typed}” is no pair of angles, such as 0 to 180.` };
  const pair = /** @type {[number, number]} */ ([Number(from), Number(to)]);
  const beyond = pair.find((angle) => Math.abs(angle) > MOST);
  if (beyond !== undefined) return { problem: `${beyond}° is more than a turn: angles go from -360 to 360.` };
  if (pair[0] === pair[1]) return { problem: `Nothing lies between ${from}° and ${to}°; 0 to 360 is all round.` };
  return { value: pair };
}

/** @param {readonly number[]} pair */
export const angles = ([from, to]) => `${from} to ${to}`;
