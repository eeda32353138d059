/** What is painted in a pane: the image, and what lies over it, as sharp at any magnification. */

import { paneFromImage } from "./image_view.js";

/** @typedef {import("./image_view.js").View} View */
/** @typedef {import("./image_view.js").Place} Place */
/** @typedef {import("./image_view.js").Size} Size */

/**
 * In image coordinates. Colours are CSS colours, or names of the page's tokens such as `--accent`.
 * @typedef {object} Line
 * @property {readonly (readonly [number, number])[]} points
 * @property {string} color
 * @property {number} [width] CSS pixels; 2
 * @property {number[]} [dash] CSS pixels
 * @property {boolean} [closed]
 * @property {string} [fill]
 */

/**
 * @typedef {object} Point
 * @property {string} id
 * @property {number} x image coordinates
 * @property {number} y
 * @property {string} color
 * @property {string} [label]
 * @property {boolean} [active] what the arrow keys move
 * @property {"ring" | "handle" | "target" | "ghost"} [shape] a ring, which leaves seen what is under it; a disc: white, coloured, or faint
 * @property {number} [reach] how near a press means it, CSS pixels
 */

/**
 * Rings that are one area together by the even-odd rule, with its outline.
 * @typedef {object} Region
 * @property {readonly (readonly (readonly [number, number])[])[]} rings
 * @property {string} color
 * @property {number} [fill] opacity of what is inside; 0
 * @property {number} [width] of the outline, CSS pixels; 2
 * @property {number[]} [dash] CSS pixels
 * @property {boolean} [inside] only what lies in the image is seen
 */

/** A brush's path; its width in image pixels. @typedef {{points: readonly (readonly [number, number])[], width: number, color: string, opacity: number}} Stroke */

/** Regions lie lowest, then strokes, lines and points. @typedef {{lines: readonly Line[], points: readonly Point[], regions?: readonly Region[], strokes?: readonly Stroke[]}} Overlay */

/** From this magnification on, pixels are shown as squares. */
const SQUARES = 4;
const RADIUS = 6;
const HANDLE = 4.5;
/** Of the loupe, CSS pixels. */
const LOUPE_RADIUS = 60;
const LOUPE_OFFSET = 84;
/** How much larger than the pane the loupe shows things, and at least how large. */
const LOUPE_TIMES = 4;
const LOUPE_LEAST = 8;
/** From this magnification on the loupe would show nothing that is not seen already. */
const LOUPE_NEEDED = 10;
const HALO = "rgb(0 0 0 / 0.55)";
const FAINT_HALO = "rgb(0 0 0 / 0.35)";

/**
 * @param {CanvasRenderingContext2D} context whose unit is a CSS pixel
 * @param {HTMLImageElement} image
 * @param {View} view
 * @param {Size} pane
 */
export function paintImage(context, image, view, pane) {
  const { naturalWidth: width, naturalHeight: height } = image;
  // Only the part in sight, from whole pixels: a huge target rectangle is slow, and not exact everywhere.
  const left = Math.max(0, Math.floor(-view.x / view.zoom));
  const top = Math.max(0, Math.floor(-view.y / view.zoom));
  const right = Math.min(width, Math.ceil((pane.width - view.x) / view.zoom));
  const bottom = Math.min(height, Math.ceil((pane.height - view.y) / view.zoom));
  if (right <= left || bottom <= top) return;
  context.imageSmoothingEnabled = view.zoom < SQUARES;
  context.imageSmoothingQuality = view.zoom < 1 ? "high" : "low";
  const corner = paneFromImage(view, { x: left, y: top });
  context.drawImage(image, left, top, right - left, bottom - top, corner.x, corner.y, (right - left) * view.zoom, (bottom - top) * view.zoom);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Overlay} overlay
 * @param {View} view
 * @param {Size} image
 * @param {(color: string) => string} paint a colour as the canvas takes it
 */
export function paintOverlay(context, overlay, view, image, paint) {
  context.lineJoin = "round";
  context.lineCap = "round";
  for (const region of overlay.regions ?? []) paintRegion(context, region, view, image, paint);
  for (const stroke of overlay.strokes ?? []) paintStroke(context, stroke, view, paint);
  for (const line of overlay.lines) paintLine(context, line, view, paint);
  for (const point of overlay.points) {
    if (point.shape === undefined || point.shape === "ring") paintPoint(context, point, view, paint);
    else paintHandle(context, point, view, paint);
  }
}

/** @param {CanvasRenderingContext2D} context @param {Region} region @param {View} view @param {Size} image @param {(color: string) => string} paint */
function paintRegion(context, { rings, color, fill = 0, width = 2, dash = [], inside = false }, view, image, paint) {
  context.save();
  if (inside) {
    context.beginPath();
    context.rect(view.x, view.y, view.zoom * image.width, view.zoom * image.height);
    context.clip();
  }
  context.beginPath();
  for (const ring of rings) {
    ring.forEach(([x, y], i) => context[i === 0 ? "moveTo" : "lineTo"](view.x + view.zoom * x, view.y + view.zoom * y));
    context.closePath();
  }
  context.strokeStyle = context.fillStyle = paint(color);
  context.globalAlpha = fill;
  if (fill > 0) context.fill("evenodd");
  context.globalAlpha = 1;
  context.setLineDash(dash);
  if (dash.length === 0 && width > 1.5) halo(context, width);
  context.lineWidth = width;
  if (width > 0) context.stroke();
  context.restore();
}

/** Under the line that comes next, so that it is seen on what has its colour. @param {CanvasRenderingContext2D} context @param {number} width */
function halo(context, width) {
  const style = context.strokeStyle;
  context.strokeStyle = FAINT_HALO;
  context.lineWidth = width + 1.5;
  context.stroke();
  context.strokeStyle = style;
}

/** @param {CanvasRenderingContext2D} context @param {Stroke} stroke @param {View} view @param {(color: string) => string} paint */
function paintStroke(context, { points, width, color, opacity }, view, paint) {
  context.globalAlpha = opacity;
  context.strokeStyle = paint(color);
  context.lineWidth = width * view.zoom;
  context.beginPath();
  for (const [x, y] of points) context.lineTo(view.x + view.zoom * x, view.y + view.zoom * y);
  // A line of no length has no caps in some browsers.
  if (points.length === 1) context.lineTo(view.x + view.zoom * points[0][0] + 0.01, view.y + view.zoom * points[0][1]);
  context.stroke();
  context.globalAlpha = 1;
}

/**
 * The brush's edge, around its middle.
 * @param {CanvasRenderingContext2D} context @param {Place} at in the image @param {{diameter: number, color: string}} brush @param {View} view @param {(color: string) => string} paint
 */
export function paintBrush(context, at, { diameter, color }, view, paint) {
  const { x, y } = paneFromImage(view, at);
  const radius = Math.max(1, (diameter * view.zoom) / 2);
  for (const [style, width] of /** @type {[string, number][]} */ ([[HALO, 3.5], [paint(color), 1.5]])) {
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    // Where the edge is hardly seen, or far from the hand, the middle is marked too.
    if (radius > 6) {
      context.moveTo(x - 2.5, y);
      context.lineTo(x + 2.5, y);
      context.moveTo(x, y - 2.5);
      context.lineTo(x, y + 2.5);
    }
    context.strokeStyle = style;
    context.lineWidth = width;
    context.stroke();
  }
}

/**
 * A white disc with a coloured edge; what is active, or a target, the other way round.
 * @param {CanvasRenderingContext2D} context @param {Point} point @param {View} view @param {(color: string) => string} paint
 */
function paintHandle(context, point, view, paint) {
  const { x, y } = paneFromImage(view, point);
  const color = paint(point.color);
  const isFull = point.active === true || point.shape === "target";
  context.globalAlpha = point.shape === "ghost" ? 0.7 : 1;
  context.beginPath();
  context.arc(x, y, isFull ? HANDLE + 1.5 : HANDLE, 0, 2 * Math.PI);
  context.strokeStyle = FAINT_HALO;
  context.lineWidth = 4;
  context.stroke();
  context.fillStyle = isFull ? color : "#fff";
  context.fill();
  context.strokeStyle = isFull ? "#fff" : color;
  context.lineWidth = 2;
  context.stroke();
  context.globalAlpha = 1;
}

/** @param {CanvasRenderingContext2D} context @param {Line} line @param {View} view @param {(color: string) => string} paint */
function paintLine(context, { points, color, width = 2, dash = [], closed = false, fill }, view, paint) {
  context.beginPath();
  for (const [x, y] of points) context.lineTo(view.x + view.zoom * x, view.y + view.zoom * y);
  if (closed) context.closePath();
  if (fill !== undefined) {
    context.fillStyle = paint(fill);
    context.fill();
  }
  context.setLineDash(dash);
  context.strokeStyle = HALO;
  context.lineWidth = width + 1.5;
  context.stroke();
  context.strokeStyle = paint(color);
  context.lineWidth = width;
  context.stroke();
  context.setLineDash([]);
}

/**
 * A ring, so that what lies under the point stays seen.
 * @param {CanvasRenderingContext2D} context @param {Point} point @param {View} view @param {(color: string) => string} paint
 */
function paintPoint(context, point, view, paint) {
  const { x, y } = paneFromImage(view, point);
  const color = paint(point.color);
  const radius = point.active ? RADIUS + 2 : RADIUS;
  for (const [style, width] of /** @type {[string, number][]} */ ([[HALO, 4], [color, 2]])) {
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.strokeStyle = style;
    context.lineWidth = width;
    context.stroke();
  }
  context.beginPath();
  context.arc(x, y, 1.5, 0, 2 * Math.PI);
  context.fillStyle = "#fff";
  context.fill();
  if (point.label === undefined) return;
  context.font = "600 12px Inter, system-ui, sans-serif";
  context.textBaseline = "middle";
  context.lineWidth = 3;
  context.strokeStyle = HALO;
  context.strokeText(point.label, x + radius + 5, y);
  context.fillStyle = "#fff";
  context.fillText(point.label, x + radius + 5, y);
}

/**
 * A crosshair, and beside it what lies under it, magnified, with the image seen through `filter`; null: no such thing.
 * @param {CanvasRenderingContext2D} context
 * @param {object} of
 * @param {Place} of.at in the image
 * @param {boolean} of.cross whether the pane shows a crosshair itself: where no pointer does
 * @param {boolean} of.above a finger hides what is beside it
 * @param {HTMLImageElement} image
 * @param {Overlay} overlay
 * @param {View} view
 * @param {Size} pane
 * @param {(color: string) => string} paint
 * @param {string | null} filter
 */
export function paintLoupe(context, { at, cross, above }, image, overlay, view, pane, paint, filter) {
  const { x, y } = paneFromImage(view, at);
  if (cross) paintCross(context, x, y, 14, 4);
  if (filter === null || view.zoom >= LOUPE_NEEDED) return;

  const beside = x + LOUPE_OFFSET + LOUPE_RADIUS < pane.width ? x + LOUPE_OFFSET : x - LOUPE_OFFSET;
  const over = y - LOUPE_OFFSET - LOUPE_RADIUS > 0;
  const middle = { x: above && over ? x : beside, y: over ? y - LOUPE_OFFSET : y + LOUPE_OFFSET };
  const zoom = Math.max(LOUPE_LEAST, view.zoom * LOUPE_TIMES);
  const side = 2 * LOUPE_RADIUS;

  context.save();
  context.beginPath();
  context.arc(middle.x, middle.y, LOUPE_RADIUS, 0, 2 * Math.PI);
  context.clip();
  context.translate(middle.x - LOUPE_RADIUS, middle.y - LOUPE_RADIUS);
  context.fillStyle = paint("--stage");
  context.fillRect(0, 0, side, side);
  const magnified = { zoom, x: LOUPE_RADIUS - zoom * at.x, y: LOUPE_RADIUS - zoom * at.y };
  context.filter = filter;
  paintImage(context, image, magnified, { width: side, height: side });
  context.filter = "none";
  const size = { width: image.naturalWidth, height: image.naturalHeight };
  paintOverlay(context, { ...overlay, points: [] }, magnified, size, paint);
  paintCross(context, LOUPE_RADIUS, LOUPE_RADIUS, LOUPE_RADIUS, 5);
  context.restore();

  context.beginPath();
  context.arc(middle.x, middle.y, LOUPE_RADIUS, 0, 2 * Math.PI);
  context.strokeStyle = paint("--line-strong");
  context.lineWidth = 2;
  context.stroke();
}

/** @param {CanvasRenderingContext2D} context @param {number} x @param {number} y @param {number} arm @param {number} gap left open in the middle */
function paintCross(context, x, y, arm, gap) {
  context.beginPath();
  for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
    context.moveTo(x + dx * gap, y + dy * gap);
    context.lineTo(x + dx * arm, y + dy * arm);
  }
  for (const [style, width] of /** @type {[string, number][]} */ ([[HALO, 3], ["#fff", 1]])) {
    context.strokeStyle = style;
    context.lineWidth = width;
    context.stroke();
  }
}
