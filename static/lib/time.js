// @ts-check

/** @type {[Intl.RelativeTimeFormatUnit, number][]} */
const UNITS = [
  ["day", 86_400],
  ["hour", 3_600],
  ["minute", 60],
];

/**
 * A moment as a person would say it: "5 minutes ago", and the date after a week.
 * @param {Date} moment
 * @param {Date} now
 */
export function ago(moment, now) {
  const seconds = (now.getTime() - moment.getTime()) / 1000;
  if (seconds > 7 * 86_400) return moment.toLocaleDateString("en", { dateStyle: "medium" });
  for (const [unit, length] of UNITS) {
    if (seconds >= length) {
      return new Intl.RelativeTimeFormat("en", { numeric: "auto" }).format(-Math.floor(seconds / length), unit);
    }
  }
  return "just now";
}
