/** Where the selected object's masks are, for the scrubber and the film strip. */

import { computed } from "../lib/view.js";
import * as store from "../store.js";

/** @type {import("../lib/view.js").ReadonlySignal<readonly import("./scrubber.js").Mark[]>} */
export const maskMarks = computed(() =>
  store.masksOfSelected.value.map(({ frame, class_id, accepted }) => ({
    frame,
    color: store.classes.value.get(class_id)?.color ?? "#ffffff",
    title: accepted ? `Mask in frame ${frame}` : `Mask in frame ${frame}: waits for a yes or a no`,
    faint: !accepted,
  })),
);
