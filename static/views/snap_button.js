/** Whether drags snap, and to what. */

import { command } from "./commands.js";
import { Icon } from "../lib/icon.js";
import { Popover } from "../lib/popover.js";
import { parseQuantity, trimmed } from "../lib/quantity.js";
import { html, useRef, useSignal } from "../lib/view.js";
import * as store from "../store.js";

/** Metres and degrees that the server takes. */
const MOST = { length: 1e4, angle: 180 };

export function SnapButton() {
  const open = useSignal(false);
  const button = useRef(/** @type {HTMLElement | null} */ (null));
  const on = store.snapLength.value > 0 || store.snapAngle.value > 0;
  return html`<div class="joined">
    <button class="button small" aria-pressed=${on} onClick=${command("snap").run} title=${`Drags go in steps: ${words()} (${command("snap").keys[0]})`}>Snap</button>
    <button
      ref=${button} class="button small chooser" aria-haspopup="dialog" aria-expanded=${open.value} aria-label="Steps to snap to" title="Steps to snap to"
      onClick=${() => (open.value = !open.value)}
    ><${Icon} name="chevron-down" size=${14} /></button>
    ${open.value &&
    html`<${Popover} label="Steps to snap to" anchor=${button} onClose=${() => (open.value = false)}>
      <${Step} kind="length" label="Move and resize in steps of" shown=${() => `${trimmed(store.snapLength.value * 1000, 0, 3)} mm`}
        take=${(/** @type {number} */ metres) => (store.snapLength.value = metres)} />
      <${Step} kind="angle" label="Turn in steps of" shown=${() => `${trimmed(store.snapAngle.value, 0, 3)}°`}
        take=${(/** @type {number} */ degrees) => (store.snapAngle.value = degrees)} />
      <p class="muted">0: no steps.</p>
    </${Popover}>`}
  </div>`;
}

/** @param {{kind: "length" | "angle", label: string, shown: () => string, take: (value: number) => void}} props */
function Step({ kind, label, shown, take }) {
  const draft = useSignal(/** @type {string | null} */ (null));
  const problem = useSignal(/** @type {string | null} */ (null));
  const commit = () => {
    if (draft.value === null) return;
    const parsed = parseQuantity(draft.value, kind);
    if (!parsed.ok) problem.value = parsed.problem;
    else if (parsed.value < 0 || parsed.value > MOST[kind]) {
      problem.value = kind === "length" ? "A step is from 0 mm to 10 km." : "A step is from 0° to 180°.";
    } else {
      take(parsed.value);
      draft.value = null;
      problem.value = null;
    }
  };
  return html`<label class="step">${label}
      <input
        class="field" value=${draft.value ?? shown()} aria-invalid=${problem.value !== null} autocomplete="off" spellcheck=${false}
        onInput=${(/** @type {any} */ event) => (draft.value = event.currentTarget.value)} onBlur=${commit}
        onKeyDown=${(/** @type {KeyboardEvent} */ event) => event.key === "Enter" && commit()}
      />
    </label>
    ${problem.value !== null && html`<p class="problem" role="alert">${problem.value}</p>`}`;
}

function words() {
  const length = store.snapLength.value > 0 ? `${trimmed(store.snapLength.value * 1000, 0, 3)} mm` : "";
  const angle = store.snapAngle.value > 0 ? `${trimmed(store.snapAngle.value, 0, 3)}°` : "";
  return [length, angle].filter(Boolean).join(", ") || "off";
}
