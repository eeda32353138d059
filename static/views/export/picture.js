/** One frame with what the chosen format would hold of its labels, drawn by the server as the options change. */

import { html, useEffect, useSignal, useSignalEffect } from "../../lib/view.js";
import { actions, revision } from "../../store.js";
import { asked, format, writer } from "./draft.js";

/** Milliseconds without a change before the server is asked. */
const PAUSE = 300;

/** The options that a picture depends on. */
const DRAWN_BY = ["shape", "min_visible", "max_truncated"];

export function FormatPicture() {
  /** The newest picture; it stays, dimmed, until the next one is there. */
  const shown = useSignal(/** @type {{address: string, format: string, title: string} | null} */ (null));
  const isCurrent = useSignal(false);
  const problem = useSignal(/** @type {string | null} */ (null));
  const again = useSignal(0);
  const aspect = useImageAspect();

  useSignalEffect(() => {
    const [kind, title, options] = [format.value, writer.value?.title ?? "", asked.value];
    void revision.value;
    void again.value;
    isCurrent.value = false;
    if (kind === "") return;
    const stop = new AbortController();
    const timer = setTimeout(async () => {
      const drawnBy = Object.fromEntries(DRAWN_BY.flatMap((name) => (name in options ? [[name, options[name]]] : [])));
      try {
        const found = await actions.exportPicture(kind, drawnBy, stop.signal);
        if (stop.signal.aborted) return;
        shown.value = { address: URL.createObjectURL(found), format: kind, title };
        problem.value = null;
      } catch (error) {
        if (stop.signal.aborted) return;
        problem.value = /** @type {Error} */ (error).message;
      }
    }, PAUSE);
    return () => {
      clearTimeout(timer);
      stop.abort();
    };
  });
  const address = shown.value?.address;
  useEffect(() => (address === undefined ? undefined : () => URL.revokeObjectURL(address)), [address]);

  const picture = shown.value;
  return html`<figure class="format-picture" aria-label="What the format holds" aria-busy=${!isCurrent.value && problem.value === null}>
    <div class="picture" style=${{ aspectRatio: String(aspect) }}>
      ${picture !== null &&
      problem.value === null &&
      html`<img
        src=${picture.address} alt=${`A frame with its labels as ${picture.title} holds them`} data-format=${picture.format}
        data-stale=${!isCurrent.value} draggable=${false} onLoad=${() => (isCurrent.value = true)}
      />`}
      ${problem.value !== null &&
      html`<div class="instead">
        <p class="problem" role="alert">${problem.value}</p>
        <button class="button" onClick=${() => again.value++}>Try again</button>
      </div>`}
    </div>
    <figcaption class="muted">${writer.value?.description ?? ""}</figcaption>
  </figure>`;
}

/** Width by height of the session's images: room is kept for the picture before it is there. */
function useImageAspect() {
  const aspect = useSignal(4 / 3);
  useEffect(() => {
    actions.cameras().then(
      ([first]) => first !== undefined && (aspect.value = first.width / first.height),
      () => {}, // the picture's own problem says that the server does not answer
    );
  }, []);
  return aspect.value;
}
