/** The list of keys. */

import { commands } from "./commands.js";
import { Dialog } from "../lib/dialog.js";
import { Icon } from "../lib/icon.js";
import { html } from "../lib/view.js";
import * as store from "../store.js";

const NAMES = { Escape: "Esc", ArrowLeft: "←", ArrowRight: "→", ArrowUp: "↑", ArrowDown: "↓", PageUp: "PgUp", PageDown: "PgDn", Delete: "Del" };

/** The keys of one chord. @param {{chord: string}} props */
export function Keys({ chord }) {
  return chord
    .split(/\+(?=.)/)
    .map((key) => html`<kbd key=${key}>${NAMES[/** @type {keyof NAMES} */ (key)] ?? key}</kbd>`);
}

/** Six keys, each with and without Shift, that are said in one line. */
const NUDGES = "nudge-";

/** Not keys of commands: what mouse and wheel do. */
const POINTER = [
  ["Scene: turn, pan, come nearer", "Drag, right drag, wheel"],
  ["Frame: zoom, pan", "Wheel, drag"],
  ["Scrub the strip closer or wider", "Ctrl+wheel"],
  ["Step a number; ten times; a tenth", "Arrows; Shift; Alt"],
];

const GROUPS = /** @type {const} */ (["View", "Frames", "Tools", "Masks", "Box", "Session"]);

function Nudges() {
  return html`<div><dt>Nudge by 1 mm; turn by 0.2° with Rotate</dt><dd><kbd>Arrows</kbd><kbd>PgUp</kbd><kbd>PgDn</kbd></dd></div>
    <div><dt>Ten times as far</dt><dd><kbd>Shift</kbd> and these</dd></div>`;
}

export function Help() {
  const close = () => (store.overlay.value = null);
  return html`<${Dialog} label="Keys" onClose=${close} class="wide">
    <header><h2>Keys</h2><button class="button quiet icon-only" aria-label="Close" onClick=${close}><${Icon} name="x" /></button></header>
    <div class="body key-list">
      ${GROUPS.map(
        (group) => html`<section key=${group}>
          <h3 class="heading">${group}</h3>
          <dl>${commands
            .filter((one) => one.group === group && one.keys.length > 0 && !one.id.startsWith(NUDGES))
            .map((one) => html`<div key=${one.id}><dt>${one.title}</dt><dd><${Keys} chord=${one.keys[0]} /></dd></div>`)}
            ${group === "Box" && html`<${Nudges} />`}
          </dl>
        </section>`,
      )}
      <section>
        <h3 class="heading">Pointer</h3>
        <dl>${POINTER.map(([what, how]) => html`<div key=${what}><dt>${what}</dt><dd>${how}</dd></div>`)}</dl>
      </section>
    </div>
  </${Dialog}>`;
}
