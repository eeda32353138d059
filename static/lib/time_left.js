/** How much longer work takes, from how fast it has gone. */

/** Milliseconds before anything is said: the first steps tell little of the rest. */
const PATIENCE = 1500;

/** One stretch of work whose steps take about as long as each other. */
export class Pace {
  /** @param {number} done steps that were done already @param {number} now milliseconds, of any clock that only goes on */
  constructor(done, now) {
    this.done = done;
    this.since = now;
  }

  /**
   * Seconds until all is done; null: it cannot be known yet.
   * @param {number} done @param {number} total @param {number} now as in the constructor
   */
  left(done, total, now) {
    const [steps, spent] = [done - this.done, now - this.since];
    if (steps <= 0 || total <= 0 || spent < PATIENCE) return null;
    return (Math.max(0, total - done) * spent) / steps / 1000;
  }
}

/** Seconds in words, as roughly as they are known: "about 20 s left". @param {number} seconds */
export function leftInWords(seconds) {
  if (seconds < 5) return "a few seconds left";
  if (seconds < 55) return `about ${Math.ceil(seconds / 5) * 5} s left`;
  if (seconds < 3570) return `about ${Math.round(seconds / 60) || 1} min left`;
  const minutes = Math.round(seconds / 600) * 10;
  return `about ${Math.floor(minutes / 60)} h ${minutes % 60} min left`;
}
