/** How people at a session are shown. */

const COLORS = ["#56b4e9", "#cc79a7", "#e69f00", "#3fb68b", "#f0e442", "#ff9d76", "#a5b8ff"];

/** At most two letters. @param {string} name */
export function initials(name) {
  const words = name.trim().split(/\s+/).filter(Boolean);
  if (words.length === 0) return "?";
  const letters = words.length === 1 ? [...words[0]].slice(0, 2) : [words[0], words[words.length - 1]].map((word) => [...word][0]);
  return letters.join("").toUpperCase();
}

/** A colour that stays the same for the same page. @param {string} view */
export function personColor(view) {
  return COLORS[[...view].reduce((sum, letter) => (sum * 31 + letter.charCodeAt(0)) % 9973, 7) % COLORS.length];
}
