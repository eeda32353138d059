// @ts-check
/** The only module that talks to the server. */

/**
 * @typedef {object} Session
 * @property {string} id
 * @property {string} name
 * @property {number} revision
 * @property {string} format
 * @property {number} frames
 * @property {number} classes
 * @property {number} boxes
 * @property {number} skipped
 * @property {string} changed
 */

/** What went wrong, in the server's words: they are written to be shown. */
export class ApiError extends Error {
  /**
   * @param {string} message
   * @param {number} status the HTTP status; 0: the server did not answer
   */
  constructor(message, status) {
    super(message);
    this.status = status;
  }
}

/** @returns {Promise<Session[]>} */
export function sessions() {
  return request("/api/sessions");
}

/** @returns {Promise<{version: string}>} */
export function health() {
  return request("/api/health");
}

/**
 * Trade the token for the cookie.
 * @param {string} token
 * @returns {Promise<void>}
 */
export function logIn(token) {
  return request("/login", { method: "POST", body: JSON.stringify({ token }) });
}

/**
 * The address of a frame's image, no wider than `width` pixels.
 * @param {string} session
 * @param {number} index
 * @param {number} width
 */
export function imageAddress(session, index, width) {
  return `/api/sessions/${encodeURIComponent(session)}/frames/${index}/image?width=${width}`;
}

/**
 * @param {string} address
 * @param {RequestInit} [options]
 * @returns {Promise<any>}
 */
async function request(address, options) {
  let response;
  try {
    response = await fetch(address, { headers: { "Content-Type": "application/json" }, ...options });
  } catch {
    throw new ApiError("The server does not answer. Is it still running?", 0);
  }
  if (response.ok) return response.status === 204 ? undefined : response.json();
  const problem = await response.json().catch(() => ({}));
  throw new ApiError(problem.detail ?? `The server answered ${response.status}.`, response.status);
}
