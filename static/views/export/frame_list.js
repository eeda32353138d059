/** Numbers of frames as people type them: `0-9, 20, 35`. */

/** More than any recording has, so that a typing error does not fill the memory. */
const MOST = 1_000_000;

/** @param {string} text @returns {{value: number[] | null} | {problem: string}} ascending, each once; null: none is typed */
export function parseFrames(text) {
  const parts = text.replace(/\s*[-–]\s*/g, "-").split(/[\s,;]+/).filter((part) => part !== "");
  if (parts.length === 0) return { value: null };
  const found = new Set(/** @type {number[]} */ ([]));
  for (const part of parts) {
    const [, from, to = from] = /^(\d{1,9})(?:-(\d{1,9}))?$/.exec(part) ?? [];
    if (from === undefined) return { problem: `“${part}” is no frame and no range of frames, such as 20 or 0-9.` };
    const [first, last] = [Number(from), Number(to)];
    if (last < first) return { problem: `${part} runs backwards; type ${last}-${first}.` };
    if (last >= MOST) return { problem: `${last} is beyond any recording.` };
    for (let index = first; index <= last; index++) found.add(index);
  }
  return { value: [...found].sort((a, b) => a - b) };
}
