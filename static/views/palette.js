/** The command palette: every command by its name; a number goes to that frame, a name selects that box. */

import { commands } from "./commands.js";
import { Dialog } from "../lib/dialog.js";
import { html, useSignal } from "../lib/view.js";
import * as store from "../store.js";
import { Keys } from "./help.js";

/** @typedef {{id: string, title: string, keys?: string, run: () => void}} Entry */

export function Palette() {
  const text = useSignal("");
  const at = useSignal(0);
  const close = () => (store.overlay.value = null);
  const found = entries(text.value.trim().toLowerCase());
  const current = Math.min(at.value, found.length - 1);

  /** @param {Entry | undefined} entry */
  const run = (entry) => {
    if (entry === undefined) return;
    close();
    entry.run();
  };
  /** @param {KeyboardEvent} event */
  const keys = (event) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (step !== undefined && found.length > 0) {
      event.preventDefault();
      at.value = (current + step + found.length) % found.length;
      document.getElementById(`palette-${at.value}`)?.scrollIntoView({ block: "nearest" });
    } else if (event.key === "Enter") run(found[current]);
  };
  return html`<${Dialog} label="All commands" onClose=${close} class="palette">
    <input
      autofocus role="combobox" aria-expanded="true" aria-controls="palette-list" aria-activedescendant=${`palette-${current}`}
      aria-label="Command, box or frame number" placeholder="Command, box or frame number" onKeyDown=${keys}
      onInput=${(/** @type {any} */ event) => {
        text.value = event.currentTarget.value;
        at.value = 0;
      }}
    />
    ${found.length === 0 && html`<p class="muted">Nothing is called that. A number goes to that frame.</p>`}
    <ul id="palette-list" role="listbox" aria-label="Commands">
      ${found.map(
        (entry, i) => html`<li key=${entry.id} id=${`palette-${i}`} role="option" aria-selected=${i === current} onClick=${() => run(entry)}>
          ${entry.title}${entry.keys && html`<span class="keys"><${Keys} chord=${entry.keys} /></span>`}
        </li>`,
      )}
    </ul>
  </${Dialog}>`;
}

/** @param {string} text @returns {Entry[]} */
function entries(text) {
  const frames = /^\d+$/.test(text) && Number(text) < store.frames.value
    ? [{ id: "frame", title: `Enter frame ${Number(text)}`, run: () => store.actions.enterFrame(Number(text)) }]
    : [];
  const boxes = [...store.boxes.value.values()]
    .filter((box) => text !== "" && box.name.toLowerCase().includes(text))
    .slice(0, 8)
    .map((box) => ({ id: `box-${box.id}`, title: `Select ${box.name}`, run: () => store.actions.select(box.id) }));
  const able = commands
    .filter((one) => one.id !== "palette" && one.id !== "back" && (one.when?.() ?? true))
    .filter((one) => text.split(/\s+/).every((word) => one.title.toLowerCase().includes(word)))
    .map((one) => ({ id: one.id, title: one.title, keys: one.keys[0], run: one.run }));
  return [...frames, ...boxes, ...able];
}
