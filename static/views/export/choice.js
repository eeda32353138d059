/** How frames are chosen, and from how many sides they show the objects, beside all frames and evenly spaced ones. */

import { html } from "../../lib/view.js";
import { figure, many } from "./words.js";

/** @typedef {import("../../store.js").Schemas["Forecast"]} Forecast */
/** @typedef {import("../../store.js").Schemas["ChoiceMade"]} ChoiceMade */

/** @param {{found: Forecast}} props */
export function ChoiceView({ found }) {
  const made = found.choice;
  if (made === null || made === undefined) return null;
  const rows = /** @type {[string, string, number][]} */ ([
    ["chosen", many(made.chosen, "chosen frame"), made.directions],
    ["evenly", "As many, evenly spaced", made.directions_evenly],
    ["candidates", `All ${many(made.candidates, "frame")}`, made.directions_of_candidates],
  ]);
  const most = Math.max(1, ...rows.map(([, , directions]) => directions));
  return html`<section class="choice-made" aria-label="How frames are chosen">
    <h3 class="muted" title="An object seen from one of 648 equal parts of the sphere round it is one">Directions that objects are seen from</h3>
    <dl>
      ${rows.map(
        ([name, words, directions]) => html`<div key=${name} data-frames=${name}>
          <dt>${words}</dt>
          <dd><span class="track"><span class="bar" style=${{ width: `${(100 * directions) / most}%` }}></span></span><span class="count">${figure(directions)}</span></dd>
        </div>`,
      )}
    </dl>
    ${leftOut(made) !== "" && html`<p class="muted">${leftOut(made)}</p>`}
  </section>`;
}

/** What is less than was asked for, and why. @param {ChoiceMade} made */
function leftOut(made) {
  const reasons = [];
  if (made.outside_sector > 0) reasons.push(`${many(made.outside_sector, "frame")} looked from another side.`);
  if (made.near_twins > 0) reasons.push(`${many(made.near_twins, "near twin")} left out.`);
  if (typeof made.asked === "number" && made.chosen < made.asked) reasons.push(`Fewer are left than the ${figure(made.asked)} asked for: all are taken.`);
  return reasons.join(" ");
}
