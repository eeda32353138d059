/** The only module that talks to the server. */

/** @typedef {import("./store.js").Schemas} Schemas */
/** @typedef {import("./store.js").Box} Box */
/** @typedef {import("./store.js").Mask} Mask */
/** @typedef {import("./store.js").Polygon} Polygon */

/** What went wrong, in the server's words: they are written to be shown. */
export class ApiError extends Error {
  /**
   * @param {string} message
   * @param {number} status the HTTP status; 0: the server did not answer
   * @param {unknown} [current] of a conflict: the thing as it is now
   * @param {readonly Schemas["FieldProblem"][]} [errors] of a request that does not fit: which parts of it, and why
   * @param {readonly {frame: number, misfit_px: number | null}[]} [views] of outlines that no one object can have: which
   */
  constructor(message, status, current = undefined, errors = [], views = []) {
    super(message);
    this.status = status;
    this.current = current;
    this.errors = errors;
    this.views = views;
  }
}

/** @returns {Promise<Schemas["HealthJson"]>} */
export const health = () => request("GET", "/api/health");

/**
 * Trade the token for the cookie.
 * @param {string} token
 * @returns {Promise<void>}
 */
export const logIn = (token) => request("POST", "/login", { body: { token } });

// Sessions.

/** @returns {Promise<Schemas["SessionJson"][]>} */
export const sessions = () => request("GET", "/api/sessions");

/** @param {string} sid @returns {Promise<Schemas["SessionJson"]>} */
export const session = (sid) => request("GET", under(sid, ""));

/** @param {string} sid @param {number} revision @param {string} name @returns {Promise<Schemas["SessionJson"]>} */
export const renameSession = (sid, revision, name) => request("PATCH", under(sid, ""), { revision, body: { name } });

/** @param {string} sid @param {number} revision @returns {Promise<void>} */
export const deleteSession = (sid, revision) => request("DELETE", under(sid, ""), { revision });

/** @param {string} sid @returns {Promise<Schemas["SessionJson"]>} */
export const restoreSession = (sid) => request("POST", under(sid, "/restore"), { key: true });

/** @param {string} sid @returns {Promise<Schemas["SkippedFrameJson"][]>} */
export const skipped = (sid) => request("GET", under(sid, "/skipped"));

// Recordings to import.

/** @returns {Promise<Schemas["RootJson"][]>} */
export const roots = () => request("GET", "/api/roots");

/** @param {string} root @param {string} path @returns {Promise<Schemas["FoldersJson"]>} */
export const folders = (root, path) => request("GET", `/api/roots/${encodeURIComponent(root)}/folders?${query({ path })}`);

/** @param {import("./store.js").Source} source @returns {Promise<Schemas["LookJson"]>} */
export const lookAtRecording = (source) => request("POST", "/api/imports/look", { body: source });

/**
 * The address of a frame's picture before it is imported.
 * @param {string} look
 * @param {number} frame
 * @param {number} width
 */
export const lookImageAddress = (look, frame, width) => `/api/imports/look/image?${query({ look, frame, width })}`;

/** @param {object} draft @returns {Promise<Schemas["ImportJson"]>} */
export const startImport = (draft) => request("POST", "/api/imports", { body: draft, key: true });

/** @param {string} id @returns {Promise<Schemas["ImportJson"]>} */
export const importState = (id) => request("GET", `/api/imports/${encodeURIComponent(id)}`);

/** @param {string} id @returns {Promise<Schemas["ImportJson"]>} */
export const cancelImport = (id) => request("POST", `/api/imports/${encodeURIComponent(id)}/cancel`);

/**
 * Send a zip. Not by fetch, which does not tell how much is sent.
 * @param {File} file
 * @param {(sent: number, total: number) => void} onProgress
 * @param {AbortSignal} [signal]
 * @returns {Promise<Schemas["UploadJson"]>}
 */
export function upload(file, onProgress, signal) {
  return new Promise((resolve, reject) => {
    const sending = new XMLHttpRequest();
    sending.open("POST", "/api/imports/uploads");
    sending.responseType = "json";
    sending.upload.onprogress = (event) => onProgress(event.loaded, event.lengthComputable ? event.total : file.size);
    sending.onload = () =>
      sending.status >= 200 && sending.status < 300 ? resolve(sending.response) : reject(failure(sending.status, sending.response));
    sending.onerror = () => reject(new ApiError(`${file.name} could not be sent: the server does not answer.`, 0));
    sending.onabort = () => reject(new ApiError("Cancelled.", 0));
    signal?.addEventListener("abort", () => sending.abort(), { once: true });
    const form = new FormData();
    form.append("file", file, file.name);
    sending.send(form);
  });
}

// Boxes and classes.

/** @param {string} sid @returns {Promise<Box[]>} */
export const boxes = (sid) => request("GET", under(sid, "/boxes"));

/** @param {string} sid @returns {Promise<Schemas["ClassAnswer"][]>} */
export const classes = (sid) => request("GET", under(sid, "/classes"));

/** @param {string} sid @param {number} id @param {number} revision @param {object} changes @returns {Promise<Box>} */
export const changeBox = (sid, id, revision, changes) => request("PATCH", under(sid, `/boxes/${id}`), { revision, body: changes });

/** @param {string} sid @param {number} id @param {number} revision @returns {Promise<void>} */
export const deleteBox = (sid, id, revision) => request("DELETE", under(sid, `/boxes/${id}`), { revision });

/** @param {string} sid @param {number} id @returns {Promise<Box>} */
export const duplicateBox = (sid, id) => request("POST", under(sid, `/boxes/${id}/duplicate`), { body: {}, key: true });

/** @param {string} sid @param {number} id @param {number} revision @returns {Promise<Box>} */
export const restOnGround = (sid, id, revision) => request("POST", under(sid, `/boxes/${id}/to-ground`), { revision });

/**
 * @param {string} sid @param {number} classId @param {[number, number, number][]} points in the world
 * @returns {Promise<Schemas["BoxFromPointsAnswer"]>}
 */
export const boxFromPoints = (sid, classId, points) =>
  request("POST", under(sid, "/boxes/from-points"), { body: { class_id: classId, points, frame_of: "world" }, key: true });

/** @param {string} sid @param {number} id @returns {Promise<Schemas["ClassAnswer"]>} */
export const classOf = (sid, id) => request("GET", under(sid, `/classes/${id}`));

/** @param {string} sid @param {number} id @param {number} revision @param {FormData} form @returns {Promise<Schemas["ClassMeshAnswer"]>} */
export const putClassMesh = (sid, id, revision, form) => request("PUT", under(sid, `/classes/${id}/mesh`), { revision, body: form });

/** @param {string} sid @param {number} id @param {number} revision @returns {Promise<Schemas["ClassAnswer"]>} */
export const deleteClassMesh = (sid, id, revision) => request("DELETE", under(sid, `/classes/${id}/mesh`), { revision });

/** @param {string} sid @param {string} name @returns {Promise<Schemas["ClassAnswer"]>} */
export const addClass = (sid, name) => request("POST", under(sid, "/classes"), { body: { name }, key: true });

/** @param {string} sid @param {number} id @param {number} revision @param {object} changes @returns {Promise<Schemas["ClassAnswer"]>} */
export const changeClass = (sid, id, revision, changes) => request("PATCH", under(sid, `/classes/${id}`), { revision, body: changes });

/** @param {string} sid @param {number} id @param {number} revision @returns {Promise<void>} */
export const deleteClass = (sid, id, revision) => request("DELETE", under(sid, `/classes/${id}`), { revision });

/** @param {string} sid @returns {Promise<Schemas["EditJson"]>} */
export const undo = (sid) => request("POST", under(sid, "/undo"), { key: true });

/** @param {string} sid @returns {Promise<Schemas["EditJson"]>} */
export const redo = (sid) => request("POST", under(sid, "/redo"), { key: true });

/** @param {string} sid @param {number} [before] @returns {Promise<Schemas["HistoryPage"]>} */
export const history = (sid, before) => request("GET", under(sid, `/history?${query({ limit: 50, before })}`));

// Frames, and what the boxes look like in them.

/** @param {string} sid @returns {Promise<Schemas["CameraJson"][]>} */
export const cameras = (sid) => request("GET", under(sid, "/cameras"));

/** @param {string} sid @param {number} offset @param {number} limit @returns {Promise<Schemas["FramePage"]>} */
export const frames = (sid, offset, limit) => request("GET", under(sid, `/frames?${query({ offset, limit })}`));

/** @param {string} sid @param {number} index @returns {Promise<Schemas["LabelJson"][]>} */
export const frameLabels = (sid, index) => request("GET", under(sid, `/frames/${index}/labels?shape=box`));

/** @param {string} sid @param {number} index @param {string} labelFunction @param {string} shape @param {AbortSignal} [signal] @returns {Promise<Schemas["MarkJson"][]>} */
export const frameMarks = (sid, index, labelFunction, shape, signal) =>
  request("GET", under(sid, `/frames/${index}/marks?${query({ function: labelFunction, shape })}`), { signal });

/**
 * @param {string} sid
 * @param {{T_world_box: object, size: number[]}[]} boxes
 * @param {number[]} frames
 * @returns {Promise<Schemas["FramePreviewJson"][]>}
 */
export const labelsOf = (sid, boxes, frames) => request("POST", under(sid, "/labels"), { body: { boxes, frames } });

/** @param {string} sid @param {number} id @returns {Promise<Schemas["TellingFrameJson"][]>} */
export const tellingFrames = (sid, id) => request("GET", under(sid, `/boxes/${id}/telling-frames?count=6`));

/** @param {string} sid @param {{frame: number, x: number, y: number}[]} observations @returns {Promise<Schemas["PointAnswer"]>} */
export const locatePoint = (sid, observations) => request("POST", under(sid, "/points"), { body: { observations } });

/**
 * @param {string} sid @param {{frame: number, x: number, y: number}} of @param {number} frame
 * @returns {Promise<Schemas["EpipolarAnswer"]>}
 */
export const epipolar = (sid, of, frame) =>
  request("GET", under(sid, `/frames/${frame}/epipolar?${query({ of: of.frame, x: of.x, y: of.y })}`));

/**
 * The address of a frame's image: at most `width` pixels wide, or only `crop` (x0, y0, x1, y1 in the original).
 * @param {string} sid
 * @param {number} index
 * @param {{width?: number, crop?: [number, number, number, number]}} [options]
 */
export const imageAddress = (sid, index, options = {}) =>
  under(sid, `/frames/${index}/image?${query({ width: options.width, crop: options.crop?.join(",") })}`);

/** Why a frame's image cannot be shown, in words: an <img> does not tell. @param {string} sid @param {number} index */
export async function imageProblem(sid, index) {
  try {
    await request("GET", imageAddress(sid, index, { width: 16 }), { as: "nothing" });
    return "The image could not be loaded just now. Try again.";
  } catch (error) {
    if (error instanceof ApiError) return error.message;
    throw error;
  }
}

// Masks, and the hulls that they give.

/** @param {string} sid @returns {Promise<Mask[]>} */
export const masks = (sid) => request("GET", under(sid, "/masks"));

/**
 * @param {string} sid
 * @param {{box_id: number | null, class_id: number, frame: number, polygons: readonly Polygon[], origin: string}} mask
 * @returns {Promise<Mask>}
 */
export const addMask = (sid, mask) => request("POST", under(sid, "/masks"), { body: mask, key: true });

/**
 * @param {string} sid @param {number} id @param {number} revision
 * @param {{polygons?: readonly Polygon[], origin?: string, accepted?: boolean}} changes
 * @returns {Promise<Mask>}
 */
export const changeMask = (sid, id, revision, changes) => request("PUT", under(sid, `/masks/${id}`), { revision, body: changes });

/** @param {string} sid @param {number} id @param {number} revision @returns {Promise<void>} */
export const deleteMask = (sid, id, revision) => request("DELETE", under(sid, `/masks/${id}`), { revision });

/** @param {string} sid @param {number} id @param {number | undefined} revision undefined: there is no box yet @param {object} options @returns {Promise<Box & {hull: object}>} */
export const makeHull = (sid, id, revision, options) => request("PUT", under(sid, `/boxes/${id}/hull`), { revision, body: options });

/** @param {string} sid @param {object} wish @returns {Promise<import("./store.js").HullPreview>} */
export const previewHull = (sid, wish) => request("POST", under(sid, "/hull-preview"), { body: wish });

/** @param {string} sid @param {object} change @returns {Promise<{polygons: Polygon[]}>} */
export const combine = (sid, change) => request("POST", under(sid, "/polygons/combine"), { body: change });

/** @param {string} sid @param {number} frame @param {object} prompt @returns {Promise<{polygons: Polygon[], seconds: number}>} */
export const segment = (sid, frame, prompt) => request("POST", under(sid, `/frames/${frame}/segment`), { body: prompt });

/** @param {string} sid @param {number} id @returns {Promise<import("./store.js").OutlineJob>} */
export const outlineRest = (sid, id) => request("POST", under(sid, `/boxes/${id}/outline-rest`), { body: {}, key: true });

/** @param {string} sid @param {string} id @returns {Promise<import("./store.js").OutlineJob>} */
export const outlineState = (sid, id) => request("GET", under(sid, `/outline-jobs/${encodeURIComponent(id)}`));

/** @param {string} sid @param {string} id @returns {Promise<import("./store.js").OutlineJob>} */
export const cancelOutline = (sid, id) => request("POST", under(sid, `/outline-jobs/${encodeURIComponent(id)}/cancel`));

/** @param {string} sid @param {number} id @param {number} revision @param {object} wish @returns {Promise<import("./store.js").Refinement>} */
export const refineBox = (sid, id, revision, wish) => request("POST", under(sid, `/boxes/${id}/refine`), { revision, body: wish });

// Coverage.

/** @typedef {import("./store.js").Seen} Seen */
/** @typedef {import("./store.js").Counting} Counting */

/** @param {Counting} counting */
const counted = ({ degrees, min_visible }) => ({ azimuth_bins: 360 / degrees, polar_bins: 180 / degrees, min_visible });

/** @param {string} sid @param {Seen} of @param {Counting} counting @param {AbortSignal} [signal] @returns {Promise<Schemas["CoverageJson"]>} */
export const coverage = (sid, of, counting, signal) => request("GET", coverageAddress(sid, of, counting, "json"), { signal });

/** @param {string} sid @param {Counting} counting @param {AbortSignal} [signal] @returns {Promise<Schemas["ObjectsCoverage"]>} */
export const coverageOfObjects = (sid, counting, signal) =>
  request("GET", under(sid, `/coverage/objects?${query(counted(counting))}`), { signal });

/**
 * @param {string} sid @param {Seen} of @param {Counting} counting @param {import("./store.js").Direction} direction @param {AbortSignal} [signal]
 * @returns {Promise<Schemas["BinFrames"]>}
 */
export function coverageFrames(sid, of, counting, { by, index }, signal) {
  const polar = 180 / counting.degrees;
  const where = by === "area" ? { cell: index } : { azimuth: Math.floor(index / polar), polar: index % polar };
  return request("GET", under(sid, `/coverage/frames?${query({ ...of, ...counted(counting), ...where })}`), { signal });
}

/**
 * Where the report of a session is, a page of its own: of what an export with these options would hold.
 * @param {string} sid @param {Record<string, unknown>} options
 */
export const reportAddress = (sid, options) =>
  under(sid, Object.keys(options).length === 0 ? "/report" : `/report?${query({ options: JSON.stringify(options) })}`);

/** @param {string} sid @param {Seen} of @param {Counting} counting @param {"json" | "png"} as */
export const coverageAddress = (sid, of, counting, as) =>
  under(sid, `/coverage${as === "png" ? "/picture" : ""}?${query({ ...of, ...counted(counting) })}`);

/** @param {string} sid @param {object} wish @returns {Promise<Schemas["TourJson"]>} */
export const planTour = (sid, wish) => request("POST", under(sid, "/coverage/tour"), { body: wish, key: true });

// Exports.

/** @returns {Promise<Schemas["FormatsJson"]>} */
export const formats = () => request("GET", "/api/formats");

/** @param {string} sid @param {string} format @param {object} options @param {AbortSignal} [signal] @returns {Promise<Schemas["Forecast"]>} */
export const previewExport = (sid, format, options, signal) =>
  request("POST", under(sid, "/exports/preview"), { body: { format, options }, signal });

/**
 * One frame as a format holds its labels.
 * @param {string} sid @param {string} format @param {Record<string, unknown>} options those that a picture depends on @param {AbortSignal} [signal]
 * @returns {Promise<Blob>}
 */
export const exportPicture = (sid, format, options, signal) =>
  request("GET", under(sid, `/exports/picture?${query({ format, ...options })}`), { signal, as: "blob" });

/** @param {string} sid @param {string} format @param {object} options @returns {Promise<Schemas["ExportJson"]>} */
export const startExport = (sid, format, options) => request("POST", under(sid, "/exports"), { body: { format, options }, key: true });

/** @param {string} sid @returns {Promise<Schemas["ExportJson"][]>} */
export const exports = (sid) => request("GET", under(sid, "/exports"));

/** @param {string} id @returns {Promise<Schemas["ExportJson"]>} */
export const exportState = (id) => request("GET", `/api/exports/${encodeURIComponent(id)}`);

/** @param {string} id @returns {Promise<Schemas["ExportJson"]>} */
export const cancelExport = (id) => request("POST", `/api/exports/${encodeURIComponent(id)}/cancel`);

/** @param {string} id @returns {Promise<void>} */
export const removeExport = (id) => request("DELETE", `/api/exports/${encodeURIComponent(id)}`);

/** @param {string} id */
export const downloadAddress = (id) => `/api/exports/${encodeURIComponent(id)}/download`;

// The live line.

/**
 * A line that carries the session's edits to the page and the page's view to the scene.
 * @param {string} sid
 * @param {string} view the page's own name, 32 hex digits
 * @param {number} after the newest revision that the page has
 * @param {{opened: () => void, message: (message: any) => void, closed: (code: number, reason: string) => void}} on
 * @returns {{send: (message: object) => void, close: () => void}} `close`: nothing more is heard of it, not even `closed`
 */
export function openLine(sid, view, after, on) {
  const scheme = location.protocol === "https:" ? "wss" : "ws";
  const socket = new WebSocket(`${scheme}://${location.host}${under(sid, `/live?${query({ view, after })}`)}`);
  socket.onopen = () => on.opened();
  socket.onmessage = (event) => on.message(JSON.parse(event.data));
  socket.onclose = (event) => on.closed(event.code, event.reason);
  return {
    send: (message) => {
      if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
    },
    close: () => {
      socket.onopen = socket.onmessage = socket.onclose = null;
      socket.close();
    },
  };
}

/** @param {string} sid @param {string} rest */
function under(sid, rest) {
  return `/api/sessions/${encodeURIComponent(sid)}${rest}`;
}

/** @param {Record<string, unknown>} values those that are undefined are left out */
function query(values) {
  const known = Object.entries(values).filter(([, value]) => value !== undefined);
  return new URLSearchParams(known.map(([name, value]) => [name, String(value)])).toString();
}

/**
 * @param {string} method
 * @param {string} address
 * @param {{body?: object, revision?: number, key?: boolean, signal?: AbortSignal, as?: "json" | "blob" | "nothing"}} [options]
 *   `body`: a form, or what is sent as JSON; `revision`: what the change was made to; `key`: a repeat after a lost answer
 *   must not do it twice; `as`: what the answer is read as
 * @returns {Promise<any>}
 */
async function request(method, address, { body, revision, key, signal, as = "json" } = {}) {
  /** @type {Record<string, string>} */
  const headers = {};
  const isForm = body instanceof FormData; // of which the browser says the type itself
  if (body !== undefined && !isForm) headers["Content-Type"] = "application/json";
  if (revision !== undefined) headers["If-Match"] = `"${revision}"`;
  if (key) headers["Idempotency-Key"] = randomName();
  // A change that is small, as these are, goes on its way also where the page is being closed.
  const keepalive = method === "PATCH" || method === "DELETE";
  const send = () => fetch(address, { method, headers, body: isForm ? body : body && JSON.stringify(body), signal, keepalive });
  let response;
  try {
    response = await send().catch((error) => {
      // An answer that was lost on the way: the key lets the server tell a repeat from a second wish.
      if (key && error.name !== "AbortError") return send();
      throw error;
    });
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    throw new ApiError("The server does not answer. Is it still running?", 0);
  }
  if (response.ok) return response.status === 204 || as === "nothing" ? undefined : response[as]();
  throw failure(response.status, await response.json().catch(() => ({})));
}

/** @param {number} status @param {any} problem */
function failure(status, problem) {
  return new ApiError(problem?.detail ?? `The server answered ${status}.`, status, problem?.current, problem?.errors, problem?.views);
}

/** 32 hex digits; not crypto.randomUUID, which plain http on a lab's network does not have. */
export function randomName() {
  return Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, "0")).join("");
}
