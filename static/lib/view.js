/** Rendering and state, from the vendored libraries: the one place that names them. */

import { Fragment, h, render } from "../vendor/preact/preact.js";
import htm from "../vendor/htm/htm.js";

export { Fragment, h, render };
export { createRef } from "../vendor/preact/preact.js";
export {
  useCallback,
  useEffect,
  useId,
  useLayoutEffect,
  useMemo,
  useRef,
  useState,
} from "../vendor/preact/hooks.js";
export {
  batch,
  computed,
  effect,
  signal,
  untracked,
  useComputed,
  useSignal,
  useSignalEffect,
} from "../vendor/signals/signals.js";

/** A tagged template of markup; what is put into it is text, never markup. */
export const html = htm.bind(h);
