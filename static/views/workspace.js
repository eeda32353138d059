/** The workspace: every part in its place. */

import { html } from "../lib/view.js";
import * as store from "../store.js";
import { BottomBar } from "./bottom_bar.js";
import { ContactSheet } from "./contact_sheet.js";
import { Help } from "./help.js";
import { maskMarks } from "./mask_marks.js";
import { Palette } from "./palette.js";
import { SidePanel } from "./side_panel.js";
import { Stage } from "./stage.js";
import { ToolRail } from "./tool_rail.js";
import { TopBar } from "./top_bar.js";

/** @param {{view: string}} props `view`: the name by which the server knows this page's scene */
export function Workspace({ view }) {
  const problem = store.problems.value.get("page");
  return html`<div class="workspace">
      <${TopBar} />
      <${ToolRail} />
      <${Stage} view=${view} />
      <aside class="side-panel" aria-label="Boxes and numbers"><${SidePanel} /></aside>
      <div class="bottom-bar"><${BottomBar} marks=${maskMarks} /></div>
    </div>
    ${store.overlay.value === "help" && html`<${Help} />`}
    ${store.overlay.value === "palette" && html`<${Palette} />`}
    ${store.overlay.value === "contact-sheet" && html`<${ContactSheet} />`}
    ${problem !== undefined && html`<div class="page-problem"><span class="problem" role="alert">${problem}</span> <a href="/">All sessions</a></div>`}`;
}
