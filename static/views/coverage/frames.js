/** The frames that see the object from the chosen direction. */

import { Icon } from "../../lib/icon.js";
import { html, useRef, useSignal } from "../../lib/view.js";
import * as store from "../../store.js";
import { FrameImage } from "../frame_image.js";
import { binFrames } from "./found.js";

/** CSS pixels of a picture. */
const WIDTH = 132;

export function BinFramesView() {
  const list = useRef(/** @type {HTMLElement | null} */ (null));
  const at = useSignal(0);
  if (store.direction.value === null) return html`<${NothingChosen} />`;
  const { by, index } = store.direction.value;
  const last = binFrames.value.value;
  // What is known of another direction says nothing about this one.
  const found = last !== null && last.of.by === by && last.of.index === index ? last : null;
  const problem = binFrames.problem.value;
  const items = found?.items ?? [];
  const active = Math.max(0, Math.min(items.length - 1, at.value));

  /** @param {KeyboardEvent} event */
  const keys = (event) => {
    const to = { ArrowRight: active + 1, ArrowLeft: active - 1, Home: 0, End: items.length - 1 }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    at.value = Math.max(0, Math.min(items.length - 1, to));
    /** @type {HTMLElement | null} */ (list.current?.children[at.value]?.querySelector("button"))?.focus();
  };
  const more = (found?.total ?? 0) - items.length;
  return html`<section class="bin-frames" aria-label="Frames from this direction" aria-busy=${!binFrames.isCurrent.value}>
    <header>
      <h2 class="heading">${found === null ? "Frames" : found.total === 0 ? "No frame from here" : `${found.total.toLocaleString("en")} ${found.total === 1 ? "view" : "views"} from here`}</h2>
      ${more > 0 && html`<span class="muted">${items.length} of them, evenly</span>`}
      <button class="button quiet icon-only" aria-label="Choose no direction" title="Choose no direction (Escape)" onClick=${() => (store.direction.value = null)}><${Icon} name="x" /></button>
    </header>
    ${problem !== null &&
    html`<p class="problem" role="alert">${problem} <button class="button" onClick=${() => binFrames.retry()}>Try again</button></p>`}
    ${problem === null && found === null && html`<p class="muted teach" role="status">Looking for its frames…</p>`}
    ${problem === null && found !== null && found.total === 0 &&
    html`<p class="muted teach">No frame sees it from this direction. Film it from there, or let <strong>Plan views</strong> on the right say where to stand.</p>`}
    <ul class="tiles" ref=${list} onKeyDown=${keys} data-stale=${!binFrames.isCurrent.value}>
      ${items.map(({ frame, box_id }, i) => {
        const name = store.boxes.value.get(box_id)?.name ?? "";
        return html`<li key=${`${frame} ${box_id}`}>
          <button
            class="seen-frame" tabindex=${i === active ? 0 : -1} data-frame=${frame} data-box=${box_id} aria-label=${`Enter frame ${frame}, which shows ${name}`}
            onFocus=${() => (at.value = i)}
            onClick=${() => {
              store.actions.select(box_id);
              store.actions.enterFrame(frame);
            }}
          ><span class="picture"><${FrameImage} index=${frame} width=${WIDTH} wanted=${true} /></span>
            <span class="caption"><strong>${frame}</strong>${"class_id" in (store.seen.value ?? {}) && html`<span class="muted">${name}</span>`}</span></button>
        </li>`;
      })}
    </ul>
  </section>`;
}

function NothingChosen() {
  return html`<section class="bin-frames" aria-label="Frames from this direction">
    <div class="teach">
      <p>Each bin is a direction to look at the object from. The brighter it is, the more frames do.</p>
      <p class="muted">Click one, here or on the sphere, and its frames are shown. A dot marks a direction that no frame has.</p>
    </div>
  </section>`;
}
