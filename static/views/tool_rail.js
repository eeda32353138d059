/** The tools, one key each. */

import { command } from "./commands.js";
import { Icon } from "../lib/icon.js";
import { html } from "../lib/view.js";
import * as store from "../store.js";

/** @type {([id: string, icon: string] | null)[]} null: a line between two groups */
const TOOLS = [
  ["select", "mouse-pointer-2"],
  ["move", "move"],
  ["rotate", "rotate-cw"],
  ["resize", "move-diagonal-2"],
  null,
  ["new-box", "box"],
  ["points", "waypoints"],
  null,
  ["contact-sheet", "film"],
];

export function ToolRail() {
  return html`<nav class="tools" aria-label="Tools">
    ${TOOLS.map((entry, i) => {
      if (entry === null) return html`<hr key=${i} />`;
      const { title, keys, run, when } = command(entry[0]);
      const isTool = ["select", "move", "rotate", "resize", "points"].includes(entry[0]);
      return html`<button
        key=${entry[0]} aria-label=${title} title=${`${title} (${keys[0]})`} onClick=${run} disabled=${!(when?.() ?? true)}
        aria-pressed=${isTool ? store.tool.value === entry[0] : undefined}
      ><${Icon} name=${entry[1]} size=${18} /><span class="key" aria-hidden="true">${keys[0]}</span></button>`;
    })}
  </nav>`;
}
