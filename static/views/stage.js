/** The centre: viser's scene in a frame of the same origin, and what lies over it. */

import { command, press } from "./commands.js";
import { Icon } from "../lib/icon.js";
import { html, useEffect, useRef, useSignal, useSignalEffect } from "../lib/view.js";
import * as store from "../store.js";
import { AsExported } from "./as_exported.js";
import { FlatFrame } from "./flat_frame.js";
import { Hints } from "./hints.js";
import { asked } from "./photo_sight.js";
import { MadeBox, PointsTool } from "./points_tool.js";
import { ExportPanel } from "./export/panel.js";
import { CoverageDock } from "./coverage/dock.js";
import { MasksMode } from "./masks/mode.js";

/** @param {{view: string}} props `view`: the name by which the server knows the page's scene */
export function Stage({ view }) {
  const frame = useRef(/** @type {HTMLIFrameElement | null} */ (null));
  const ready = useSignal(false);

  useEffect(() => {
    /** @param {MessageEvent} event */
    const hear = (event) => {
      if (event.origin !== location.origin || event.source !== frame.current?.contentWindow) return;
      const told = event.data;
      if (told?.ars === "ready") {
        ready.value = true;
        tellBridge();
        tellNames();
        tellNumbers();
      } else if (told?.ars === "key" && told.type === "keydown") {
        press({ key: told.key, code: told.code, ctrlKey: told.ctrl, metaKey: told.meta, shiftKey: told.shift, altKey: told.alt, repeat: told.repeat });
      } else if (told?.ars === "zoom") store.zoom.value = told.zoom;
      else if (told?.ars === "pointer" && store.dragged.value !== null) {
        store.dragged.value = { ...store.dragged.value, x: told.x, y: told.y };
      }
    };
    addEventListener("message", hear);
    return () => removeEventListener("message", hear);
  }, []);

  const tellBridge = () =>
    frame.current?.contentWindow?.postMessage(
      { ars: "view", mode: store.mode.value === "frame" ? "frame" : "scene", blend: store.blend.value, dark: store.theme.value === "dark" },
      location.origin,
    );
  useSignalEffect(tellBridge);
  const tellNames = () => {
    const boxes = [...store.boxes.value.values()].map(({ id, name, class_id }) => ({
      id,
      name,
      color: store.classes.value.get(class_id)?.color,
    }));
    frame.current?.contentWindow?.postMessage({ ars: "names", boxes }, location.origin);
  };
  useSignalEffect(tellNames);
  const tellNumbers = () => {
    const at = store.mode.value === "coverage" ? store.tour.value.map(({ position }) => position) : [];
    frame.current?.contentWindow?.postMessage({ ars: "numbers", at }, location.origin);
  };
  useSignalEffect(tellNumbers);
  useSignalEffect(() => {
    if (asked.value !== null) frame.current?.contentWindow?.postMessage(asked.value, location.origin);
  });

  const mode = store.mode.value;
  const filled = mode === "export" || mode === "masks" || store.tool.value === "points";
  const isFlat = mode === "frame" && !filled && store.markFunction.value !== "";
  const inCoverage = mode === "coverage" && !filled;
  return html`<main class="stage" aria-label="Scene" data-docked=${inCoverage}>
    <iframe
      ref=${frame} title="3D scene: the tracked cameras and the virtual boxes" inert=${filled || isFlat}
      src=${`/scene/${encodeURIComponent(store.sid.value)}/${view}/?fixedDpr=${fixedRatio()}`}
    ></iframe>
    ${!ready.value && !filled && !isFlat && html`<div class="cover" role="status">Opening the scene</div>`}
    ${isFlat && html`<${FlatFrame} />`}
    ${!filled && html`<${Overlays} /><${Hints} />`}
    ${inCoverage && html`<${CoverageDock} />`}
    ${mode === "export" && html`<div class="filled"><${ExportPanel} /></div>`}
    ${mode === "masks" && html`<div class="filled"><${MasksMode} /></div>`}
    ${mode !== "export" && mode !== "masks" && store.tool.value === "points" && html`<div class="filled"><${PointsTool} /></div>`}
  </main>`;
}

/** viser lowers the resolution of slow scenes, which would move lines between pixels: it is told not to. */
function fixedRatio() {
  return Math.min(2, Math.max(1, devicePixelRatio));
}

function Overlays() {
  const inFrame = store.mode.value === "frame";
  const isFlat = inFrame && store.markFunction.value !== "";
  const problem = store.problems.value.get("scene");
  const drag = store.dragged.value;
  return html`
    <div class="corner top-left">
      <div class="chip">
        <strong>Frame ${store.frame.value}</strong>
        <span class="muted">of ${store.frames.value}</span>
        ${inFrame && html`<${FrameName} />`}
      </div>
      <${FrameSteps} />
      ${inFrame
        ? html`${!isFlat && html`<div class="chip" title="Wheel: zoom. Drag: pan. L: zoom to the selected box. 0: the whole photo.">${store.zoom.value.toFixed(1)}x</div>`}
            <button class="chip button" onClick=${() => store.actions.leaveFrame()} title="Leave the frame (F)">Leave</button>`
        : html`<button class="chip button" onClick=${() => store.actions.enterFrame()} title="Enter this frame (F)">
            <${Icon} name="image" size=${14} />Enter
          </button>`}
      <${MadeBox} />
    </div>
    <div class="corner bottom-left">
      ${inFrame && html`<div class="chip"><${AsExported} /></div>`}
      ${inFrame &&
      !isFlat &&
      html`<label class="chip">Photo
        <input
          type="range" min="0" max="1" step="0.05" value=${store.blend.value} aria-label="Photo over the 3D scene"
          onInput=${(/** @type {any} */ event) => (store.blend.value = Number(event.currentTarget.value))}
        />
      </label>`}
      ${store.mode.value === "coverage" && store.sphereBox.value !== null &&
      html`<button class="chip button" onClick=${lookCloser} title="Look at the object inside the sphere (L, once it is selected)">Look closer</button>`}
      <button class="chip button" aria-pressed=${store.snapLength.value > 0 || store.snapAngle.value > 0} onClick=${command("snap").run} title="Snap (N)">
        ${snapWords()}
      </button>
      <button class="chip button" aria-pressed=${store.upright.value} onClick=${command("upright").run} title="Stand the selected box upright, and turn boxes about the vertical only (U)">Upright</button>
    </div>
    ${drag !== null && html`<div class="readout" style=${{ left: `${drag.x + 16}px`, top: `${drag.y + 12}px` }}>${drag.text}</div>`}
    ${problem !== undefined &&
    html`<div class="stage-problem">
      <span class="problem" role="alert">${problem}</span>
      <button class="button quiet icon-only" aria-label="Dismiss" onClick=${() => store.setProblem("scene", null)}><${Icon} name="x" /></button>
    </div>`}
  `;
}

/** Coverage looks at the first object where none is selected, and at a class's by one of them. */
function lookCloser() {
  const box = store.sphereBox.peek();
  if (box !== store.selected.peek()) store.actions.select(box);
  command("look-selected").run();
}

/** How far a jump can go. */
const JUMPS = [2, 5, 10, 25, 50, 100, 250, 1000];

function FrameSteps() {
  const steps = [["jump-back", "chevrons-left"], ["previous", "chevron-left"], ["next", "chevron-right"], ["jump-on", "chevrons-right"]];
  return html`<div class="chip frame-steps" role="group" aria-label="Step through the frames">
    ${steps.map(([id, icon]) => {
      const { title, keys, run } = command(id);
      return html`<button key=${id} class="button quiet icon-only" aria-label=${title} title=${`${title} (${keys[0]})`} onClick=${run}>
        <${Icon} name=${icon} size=${14} />
      </button>`;
    })}
    <select
      aria-label="Frames in a jump" title="How far a jump goes" value=${store.jump.value}
      onChange=${(/** @type {any} */ event) => (store.jump.value = Number(event.currentTarget.value))}
    >${JUMPS.map((jump) => html`<option key=${jump} value=${jump}>${jump}</option>`)}</select>
  </div>`;
}

function snapWords() {
  const words = [
    ...(store.snapLength.value > 0 ? [`${+(store.snapLength.value * 1000).toFixed(3)} mm`] : []),
    ...(store.snapAngle.value > 0 ? [`${+store.snapAngle.value.toFixed(3)}°`] : []),
  ];
  return words.length > 0 ? `Snap ${words.join(", ")}` : "Snap off";
}

function FrameName() {
  const name = useSignal("");
  const index = store.frame.value;
  useEffect(() => {
    let current = true;
    store.actions.frameName(index).then(
      (found) => current && (name.value = found),
      () => current && (name.value = ""), // the page says already that the server does not answer
    );
    return () => void (current = false);
  }, [index]);
  return html`<span class="muted">${name.value}</span>`;
}
