/**
 * A flat pane with one image in its own pixels, and lines and points over it: zoom about the pointer (wheel, pinch),
 * pan (drag, space or middle button), a loupe beside the pointer, and all of it by keys.
 *
 * Every place that goes in or comes out is in image coordinates: (0, 0) is the top left corner of the top left pixel.
 * The pane knows nothing of cameras, frames or boxes.
 *
 *     const pane = new ImagePane(element, { onClick: (at) => … });
 *     await pane.show(address);
 *     pane.overlay = { lines: [{ points: [[10, 20], [30, 20]], color: "--accent" }], points: [] };
 *     pane.stop();
 *
 * Keys, while the element has the focus: arrows move the active point, else the crosshair, by 1 pixel (Shift 10, Alt
 * 0.1); Enter clicks at the crosshair; + and - zoom, 0 shows the whole image, 1 shows it pixel by pixel. What else is
 * pressed goes on to the page.
 */

import { fitted, imageFromPane, kept, paneFromImage, revealed, shifted, within, zoomed } from "./image_view.js";
import { watchGestures } from "./pane_gestures.js";
import { paintBrush, paintImage, paintLoupe, paintOverlay } from "./pane_painting.js";

/** @typedef {import("./image_view.js").Place} Place */
/** @typedef {import("./image_view.js").View} View */
/** @typedef {import("./pane_painting.js").Line} Line */
/** @typedef {import("./pane_painting.js").Point} Point */
/** @typedef {import("./pane_painting.js").Overlay} Overlay */

/**
 * What happens in the pane. Places are in image coordinates, and within the image.
 * @typedef {object} PaneEvents
 * @property {(at: Place, event: Modifiers) => void} [onClick] also by Enter, at the crosshair
 * @property {(at: Place, event: PointerEvent) => {move: (at: Place) => void, end: (at: Place) => void, cancel: () => void} | null} [onPress]
 *   who answers with something takes the drag, instead of a click or a pan: to draw, for example
 * @property {(id: string, to: Place, phase: "move" | "end" | "cancel") => void} [onMovePoint]
 *   by dragging or by keys; at `cancel`, back to where it was. Without it points stay where they are
 * @property {(id: string, to: Place) => void} [onStepPoint] by keys; without it, `onMovePoint` at `end`
 * @property {(id: string) => void} [onChoosePoint] it was pressed
 * @property {(id: string, event: Modifiers) => void} [onClickPoint] it was pressed and let go where it was
 * @property {(at: Place) => void} [onDoubleClick] after its two clicks
 * @property {(at: Place | null, by: "pointer" | "finger" | "keys") => void} [onHover] where the pointer or the crosshair is now
 * @property {(view: View) => void} [onView] zoomed or panned
 */

/** @typedef {{altKey: boolean, shiftKey: boolean}} Modifiers */

/**
 * @typedef {object} PaneOptions
 * @property {"always" | "fingers"} [loupe] who sees magnified what is under the pointer; always
 */

/** How near to a point a press means it, CSS pixels, unless the point says; a finger is less exact. */
const REACH = 12;
const REACH_FINGER = 24;
const KEY_ZOOM = 1.25;
const UNSEEN = "rgb(0 0 0 / 0.004)";

/** @type {Readonly<Record<string, readonly [number, number]>>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** @typedef {{brightness: number, contrast: number}} Light */
const PLAIN = { brightness: 1, contrast: 1 };

export class ImagePane {
  #element;
  #events;
  #loupe;
  #picture = document.createElement("canvas");
  #drawing = document.createElement("canvas");
  /** @type {HTMLImageElement | null} only once it is loaded */
  #image = null;
  #address = "";
  /** @type {Overlay} */
  #overlay = { lines: [], points: [] };
  /** @type {View} */
  #view = { zoom: 1, x: 0, y: 0 };
  /** Whether the whole image is to be shown, whatever becomes of the pane's size. */
  #fits = true;
  #pane = { width: 0, height: 0 };
  /** A round brush that is seen at the aim; the diameter in image pixels. @type {{diameter: number, color: string} | null} */
  #brush = null;
  /** @type {Light} */
  #light = PLAIN;
  /** Where the crosshair is. @type {{at: Place, by: "pointer" | "finger" | "keys"} | null} */
  #aim = null;
  /** Where keys took the crosshair last. @type {Place | null} */
  #cursor = null;
  #refresh = 0;
  #stale = { picture: true, drawing: true };
  #stopped = new AbortController();

  /**
   * @param {HTMLElement} element that the pane fills; it must be positioned, take the focus and have a name
   * @param {PaneEvents} events
   * @param {PaneOptions} [options]
   */
  constructor(element, events, { loupe = "always" } = {}) {
    this.#element = element;
    this.#events = events;
    this.#loupe = loupe;
    element.classList.add("image-pane");
    for (const canvas of [this.#picture, this.#drawing]) {
      canvas.setAttribute("aria-hidden", "true");
      element.append(canvas);
    }
    const unwatch = watchGestures(element, {
      press: (at, event) => this.#press(at, event),
      click: (at, event) => this.#click(imageFromPane(this.#view, at), event),
      pan: (dx, dy) => this.#turn(shifted(this.#view, dx, dy, this.#size, this.#pane)),
      magnify: (factor, about) => this.zoomTo(this.#view.zoom * factor, about),
      hover: (at, touch) => this.#hover(at, touch),
    });
    const sizes = new ResizeObserver(() => this.#resize());
    sizes.observe(element);
    const { signal } = this.#stopped;
    element.addEventListener("keydown", (event) => this.#key(event), { signal });
    element.addEventListener("blur", () => this.#leave(), { signal });
    element.addEventListener("dblclick", (event) => this.#doubleClick(event), { signal });
    signal.addEventListener("abort", () => {
      unwatch();
      sizes.disconnect();
      cancelAnimationFrame(this.#refresh);
      this.#picture.remove();
      this.#drawing.remove();
    });
  }

  /** Let go of everything; the element stays. */
  stop() {
    this.#stopped.abort();
  }

  /**
   * Show another image; of the same size, it is seen as the one before it. Until it is there, nothing can be clicked.
   * @param {string} address
   * @returns {Promise<"shown" | "failed" | "replaced">} replaced: another one was asked for meanwhile
   */
  async show(address) {
    const before = this.#image;
    const image = new Image();
    image.decoding = "async";
    this.#address = address;
    this.#image = null;
    this.#element.ariaBusy = "true";
    this.#redraw("both");
    image.src = address;
    const loaded = await image.decode().then(
      () => true,
      () => false,
    );
    if (this.#address !== address || this.#stopped.signal.aborted) return "replaced";
    this.#element.ariaBusy = "false";
    if (!loaded) return "failed";
    this.#image = image;
    if (before === null || before.naturalWidth !== image.naturalWidth || before.naturalHeight !== image.naturalHeight) this.#fits = true;
    this.#resize();
    return "shown";
  }

  /** What is drawn over the image; replace it whole to change it. */
  get overlay() {
    return this.#overlay;
  }

  set overlay(overlay) {
    this.#overlay = overlay;
    this.#redraw("drawing");
  }

  /** How bright the image is shown, and how contrasted: 1, 1 as it is. */
  get light() {
    return this.#light;
  }

  set light(light) {
    this.#light = light;
    this.#picture.style.filter = filterOf(light);
    this.#redraw("drawing");
  }

  /** A round brush to be seen instead of the pointer; the diameter in image pixels. */
  get brush() {
    return this.#brush;
  }

  set brush(brush) {
    this.#brush = brush;
    this.#element.classList.toggle("brushing", brush !== null);
    this.#redraw("drawing");
  }

  /** How the image lies in the pane. */
  get view() {
    return this.#view;
  }

  /** The whole image, as large as the pane lets it. */
  fit() {
    this.#fits = true;
    this.#turn(fitted(this.#size, this.#pane));
  }

  /** Whether the whole image is seen, whatever becomes of the pane's size. */
  get fits() {
    return this.#fits;
  }

  /** As large as it takes to leave no room beside the image, with its middle in the middle. */
  fill() {
    const { width, height } = this.#size;
    this.fit();
    this.zoomTo(Math.max(this.#pane.width / width, this.#pane.height / height));
  }

  /**
   * @param {number} zoom CSS pixels an image pixel; held between the whole image and 32
   * @param {Place} [about] what stays where it is, in the pane; its middle
   */
  zoomTo(zoom, about = { x: this.#pane.width / 2, y: this.#pane.height / 2 }) {
    this.#fits = false;
    this.#turn(zoomed(this.#view, zoom, about, this.#size, this.#pane));
  }

  /** @param {Place} at in the image: bring it to the pane's middle */
  centre(at) {
    const { x, y } = paneFromImage(this.#view, at);
    this.#fits = false;
    this.#turn(shifted(this.#view, this.#pane.width / 2 - x, this.#pane.height / 2 - y, this.#size, this.#pane));
  }

  get #size() {
    return { width: this.#image?.naturalWidth ?? 1, height: this.#image?.naturalHeight ?? 1 };
  }

  /** @param {View} view */
  #turn(view) {
    if (this.#image === null) return;
    this.#view = view;
    this.#redraw("both");
    this.#events.onView?.(view);
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.#element;
    this.#pane = { width, height };
    for (const canvas of [this.#picture, this.#drawing]) {
      canvas.width = Math.round(width * devicePixelRatio);
      canvas.height = Math.round(height * devicePixelRatio);
    }
    if (this.#fits) this.#turn(fitted(this.#size, this.#pane));
    else this.#turn(kept(this.#view, this.#size, this.#pane));
    this.#redraw("both");
  }

  /** @param {"both" | "drawing"} what */
  #redraw(what) {
    this.#stale.drawing = true;
    if (what === "both") this.#stale.picture = true;
    if (this.#refresh !== 0 || this.#stopped.signal.aborted) return;
    this.#refresh = requestAnimationFrame(() => {
      this.#refresh = 0;
      this.#paint();
    });
  }

  #paint() {
    const style = getComputedStyle(this.#element);
    const paint = (/** @type {string} */ color) => (color.startsWith("--") ? style.getPropertyValue(color).trim() : color);
    if (this.#stale.picture) {
      const context = cleared(this.#picture, this.#pane);
      if (this.#image !== null) paintImage(context, this.#image, this.#view, this.#pane);
    }
    const context = cleared(this.#drawing, this.#pane);
    if (this.#image !== null) {
      paintOverlay(context, this.#overlay, this.#view, this.#size, paint);
      if (this.#aim !== null && this.#brush !== null) paintBrush(context, this.#aim.at, this.#brush, this.#view, paint);
      const seen = this.#aim?.by === "pointer" && this.#loupe === "fingers";
      if (this.#aim !== null && !seen) {
        const loupe = { at: this.#aim.at, cross: this.#aim.by !== "pointer", above: this.#aim.by === "finger" };
        const magnified = this.#loupe === "always" || loupe.above;
        paintLoupe(context, loupe, this.#image, this.#overlay, this.#view, this.#pane, paint, magnified ? filterOf(this.#light) : null);
      }
    }
    this.#stale = { picture: false, drawing: false };
  }

  /** @param {Place} at in the image @param {Modifiers} event */
  #click(at, event) {
    if (this.#image === null || !within(at, this.#size)) return;
    this.#cursor = at;
    this.#events.onClick?.(at, event);
  }

  /** @param {MouseEvent} event */
  #doubleClick(event) {
    if (this.#image === null) return;
    const { left, top } = this.#element.getBoundingClientRect();
    this.#events.onDoubleClick?.(imageFromPane(this.#view, { x: event.clientX - left, y: event.clientY - top }));
  }

  /** @param {Place} at in the pane @param {PointerEvent} event @returns {import("./pane_gestures.js").Drag | null} */
  #press(at, event) {
    if (this.#image === null) return null;
    const inImage = imageFromPane(this.#view, at);
    const point = this.#pointNear(at, event.pointerType === "touch");
    if (point !== null) return this.#dragOf(point, at, event);
    const taken = within(inImage, this.#size) ? this.#events.onPress?.(inImage, event) : null;
    if (taken === null || taken === undefined) return null;
    const held = (/** @type {Place} */ place) => this.#held(imageFromPane(this.#view, place));
    return { move: (to) => taken.move(held(to)), end: (to) => taken.end(held(to)), cancel: () => taken.cancel() };
  }

  /** @param {Point} point @param {Place} from in the pane @param {Modifiers} event @returns {import("./pane_gestures.js").Drag} */
  #dragOf(point, from, event) {
    const start = { x: point.x, y: point.y };
    const grip = paneFromImage(this.#view, start);
    // It is held where it was taken, and does not jump under the pointer.
    const place = (/** @type {Place} */ to) => this.#held(imageFromPane(this.#view, { x: to.x - from.x + grip.x, y: to.y - from.y + grip.y }));
    let movedBy = false;
    this.#events.onChoosePoint?.(point.id);
    return {
      move: (to) => {
        movedBy ||= Math.hypot(to.x - from.x, to.y - from.y) > 2;
        if (movedBy) this.#events.onMovePoint?.(point.id, place(to), "move");
      },
      end: (to) => {
        if (movedBy) this.#events.onMovePoint?.(point.id, place(to), "end");
        else this.#events.onClickPoint?.(point.id, event);
      },
      cancel: () => {
        if (movedBy) this.#events.onMovePoint?.(point.id, start, "cancel");
      },
    };
  }

  /** @param {Place} at in the image: within it @returns {Place} */
  #held(at) {
    const { width, height } = this.#size;
    return { x: Math.max(0, Math.min(width, at.x)), y: Math.max(0, Math.min(height, at.y)) };
  }

  /** @param {Place} at in the pane @param {boolean} finger */
  #pointNear(at, finger) {
    let nearest = null;
    let least = Infinity;
    for (const point of this.#overlay.points) {
      const { x, y } = paneFromImage(this.#view, point);
      const away = Math.hypot(x - at.x, y - at.y);
      if (away <= (finger ? REACH_FINGER : (point.reach ?? REACH)) && away < least) [nearest, least] = [point, away];
    }
    return nearest;
  }

  /** @param {Place | null} at in the pane @param {boolean} touch */
  #hover(at, touch) {
    const place = at === null ? null : imageFromPane(this.#view, at);
    this.#aim = place !== null && within(place, this.#size) ? { at: place, by: touch ? "finger" : "pointer" } : null;
    this.#events.onHover?.(this.#aim?.at ?? null, touch ? "finger" : "pointer");
    this.#redraw("drawing");
  }

  #leave() {
    if (this.#aim?.by !== "keys") return;
    this.#aim = null;
    this.#events.onHover?.(null, "keys");
    this.#redraw("drawing");
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (event.ctrlKey || event.metaKey || this.#image === null) return;
    const arrow = ARROWS[event.key];
    if (arrow !== undefined) this.#step(arrow, event.altKey ? 0.1 : event.shiftKey ? 10 : 1);
    else if (event.altKey) return;
    else if (event.key === "Enter") this.#click(this.#cursor ?? this.#middle(), event);
    else if (event.key === "+" || event.key === "=") this.#keyZoom(KEY_ZOOM);
    else if (event.key === "-") this.#keyZoom(1 / KEY_ZOOM);
    else if (event.key === "0") this.fit();
    else if (event.key === "1") this.zoomTo(1);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** @param {number} factor */
  #keyZoom(factor) {
    const about = this.#overlay.points.find((point) => point.active) ?? this.#cursor ?? this.#middle();
    this.zoomTo(this.#view.zoom * factor, paneFromImage(this.#view, about));
  }

  /** The place in the image that the pane's middle shows. */
  #middle() {
    return this.#held(imageFromPane(this.#view, { x: this.#pane.width / 2, y: this.#pane.height / 2 }));
  }

  /** @param {readonly [number, number]} arrow @param {number} far image pixels */
  #step([dx, dy], far) {
    const active = this.#events.onMovePoint === undefined ? undefined : this.#overlay.points.find((point) => point.active);
    const from = active ?? this.#cursor ?? this.#middle();
    // In tenths of a pixel, so that ten steps of a tenth make one pixel, and not 0.9999999.
    const to = this.#held({ x: Math.round((from.x + dx * far) * 1e6) / 1e6, y: Math.round((from.y + dy * far) * 1e6) / 1e6 });
    this.#cursor = to;
    this.#aim = { at: to, by: "keys" };
    this.#turn(revealed(this.#view, to, this.#size, this.#pane));
    if (active === undefined) this.#events.onHover?.(to, "keys");
    else if (this.#events.onStepPoint !== undefined) this.#events.onStepPoint(active.id, to);
    else this.#events.onMovePoint?.(active.id, to, "end");
  }
}

/** As CSS and canvases take it. @param {Light} light */
function filterOf({ brightness, contrast }) {
  return brightness === 1 && contrast === 1 ? "none" : `brightness(${brightness}) contrast(${contrast})`;
}

/** @param {HTMLCanvasElement} canvas @param {import("./image_view.js").Size} pane */
function cleared(canvas, pane) {
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.clearRect(0, 0, canvas.width, canvas.height);
  // Chromium may go on showing what was there where a frame does nothing but clear.
  context.fillStyle = UNSEEN;
  context.fillRect(0, 0, 1, 1);
  context.setTransform(canvas.width / Math.max(1, pane.width), 0, 0, canvas.height / Math.max(1, pane.height), 0, 0);
  return context;
}
