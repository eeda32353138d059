/**
 * How a flat image lies in a pane: magnified and shifted, nothing else.
 *
 * Image coordinates: (0, 0) is the top left corner of the top left pixel. Pane coordinates: CSS pixels from the pane's
 * top left corner; pane = shift + zoom * image.
 */

/** Pane pixels an image pixel, at most. */
export const MOST_ZOOM = 32;

/** @typedef {{x: number, y: number}} Place */
/** @typedef {{width: number, height: number}} Size */
/**
 * @typedef {object} View
 * @property {number} zoom pane pixels an image pixel
 * @property {number} x where the image's corner lies in the pane
 * @property {number} y
 */

/** @param {View} view @param {Place} place in the image @returns {Place} in the pane */
export function paneFromImage(view, { x, y }) {
  return { x: view.x + view.zoom * x, y: view.y + view.zoom * y };
}

/** @param {View} view @param {Place} place in the pane @returns {Place} in the image */
export function imageFromPane(view, { x, y }) {
  return { x: (x - view.x) / view.zoom, y: (y - view.y) / view.zoom };
}

/** @param {Place} place @param {Size} image */
export function within({ x, y }, { width, height }) {
  return x >= 0 && y >= 0 && x <= width && y <= height;
}

/**
 * All of the image, as large as it can be, in the middle.
 * @param {Size} image
 * @param {Size} pane
 * @returns {View}
 */
export function fitted(image, pane) {
  return centred(image, pane, Math.min(pane.width / image.width, pane.height / image.height, MOST_ZOOM));
}

/**
 * @param {Size} image @param {Size} pane @param {number} zoom
 * @returns {View}
 */
function centred(image, pane, zoom) {
  return { zoom, x: (pane.width - zoom * image.width) / 2, y: (pane.height - zoom * image.height) / 2 };
}

/**
 * Magnified otherwise, with what lies at `about` left where it is; between the whole image and MOST_ZOOM.
 * @param {View} view
 * @param {number} zoom
 * @param {Place} about in the pane
 * @param {Size} image
 * @param {Size} pane
 * @returns {View}
 */
export function zoomed(view, zoom, about, image, pane) {
  const held = Math.max(Math.min(fitted(image, pane).zoom, 1), Math.min(MOST_ZOOM, zoom));
  const at = imageFromPane(view, about);
  return kept({ zoom: held, x: about.x - held * at.x, y: about.y - held * at.y }, image, pane);
}

/**
 * Shifted by so many pane pixels.
 * @param {View} view @param {number} dx @param {number} dy @param {Size} image @param {Size} pane
 * @returns {View}
 */
export function shifted(view, dx, dy, image, pane) {
  return kept({ zoom: view.zoom, x: view.x + dx, y: view.y + dy }, image, pane);
}

/**
 * Kept from getting lost: the pane's middle shows some of the image, and what fits wholly is seen wholly.
 * @param {View} view @param {Size} image @param {Size} pane
 * @returns {View}
 */
export function kept(view, image, pane) {
  /** @param {number} at @param {number} length of the image in the pane @param {number} room */
  const axis = (at, length, room) =>
    length <= room ? Math.max(0, Math.min(room - length, at)) : Math.max(room / 2 - length, Math.min(room / 2, at));
  return {
    zoom: view.zoom,
    x: axis(view.x, view.zoom * image.width, pane.width),
    y: axis(view.y, view.zoom * image.height, pane.height),
  };
}

/**
 * Shifted just so far that a place in the image is in sight.
 * @param {View} view @param {Place} at @param {Size} image @param {Size} pane
 * @returns {View}
 */
export function revealed(view, at, image, pane) {
  const { x, y } = paneFromImage(view, at);
  const [dx, dy] = [Math.max(0, Math.min(pane.width, x)) - x, Math.max(0, Math.min(pane.height, y)) - y];
  return dx === 0 && dy === 0 ? view : shifted(view, dx, dy, image, pane);
}
