/** The tools, one key each. */

import { command } from "./commands.js";
import { Icon } from "../lib/icon.js";
import { html } from "../lib/view.js";
import * as store from "../store.js";
import { drawing, TOOLS as DRAWING_TOOLS } from "./masks/drawing.js";

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

/** @type {typeof TOOLS} */
const MASK_TOOLS = [
  ...DRAWING_TOOLS.slice(0, 1).map(({ tool, icon }) => /** @type {[string, string]} */ ([`mask-${tool}`, icon])),
  ["new-box", "box"],
  null,
  ...DRAWING_TOOLS.slice(1).map(({ tool, icon }) => /** @type {[string, string]} */ ([`mask-${tool}`, icon])),
  null,
  ["contact-sheet", "film"],
];

export function ToolRail() {
  const inMasks = store.mode.value === "masks";
  const now = inMasks ? `mask-${drawing.tool.value}` : store.tool.value;
  return html`<nav class="tools" aria-label="Tools">
    ${(inMasks ? MASK_TOOLS : TOOLS).map((entry, i) => {
      if (entry === null) return html`<hr key=${i} />`;
      const { title, keys, run, when } = command(entry[0]);
      const isTool = entry[0].startsWith("mask-") || ["select", "move", "rotate", "resize", "points"].includes(entry[0]);
      return html`<button
        key=${entry[0]} aria-label=${title} title=${`${title} (${keys[0]})`} onClick=${run} disabled=${!(when?.() ?? true)}
        aria-pressed=${isTool ? now === entry[0] : undefined}
      ><${Icon} name=${entry[1]} size=${18} /><span class="key" aria-hidden="true">${keys[0]}</span></button>`;
    })}
  </nav>`;
}
