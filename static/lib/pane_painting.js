/** What is painted in a pane: the image, and the lines and points over it, as sharp at any magnification. */

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
 */

/** @typedef {{lines: readonly Line[], points: readonly Point[]}} Overlay */

/** From this magnification on, pixels are shown as squares. */
const SQUARES = 4;
const RADIUS = 6;
/** Of the loupe, CSS pixels. */
const LOUPE_RADIUS = 60;
const LOUPE_OFFSET = 84;
/** How much larger than the pane the loupe shows things, and at least how large. */
const LOUPE_TIMES = 4;
const LOUPE_LEAST = 8;
/** From this magnification on the loupe would show nothing that is not seen already. */
const LOUPE_NEEDED = 10;
const HALO = "rgb(0 0 0 / 0.55)";

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
 * @param {(color: string) => string} paint a colour as the canvas takes it
 */
export function paintOverlay(context, overlay, view, paint) {
  context.lineJoin = "round";
  context.lineCap = "round";
  for (const line of overlay.lines) paintLine(context, line, view, paint);
  for (const point of overlay.points) paintPoint(context, point, view, paint);
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
 * A crosshair, and beside it what lies under it, magnified.
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
 */
export function paintLoupe(context, { at, cross, above }, image, overlay, view, pane, paint) {
  const { x, y } = paneFromImage(view, at);
  if (cross) paintCross(context, x, y, 14, 4);
  if (view.zoom >= LOUPE_NEEDED) return;

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
  paintImage(context, image, magnified, { width: side, height: side });
  for (const line of overlay.lines) paintLine(context, line, magnified, paint);
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
