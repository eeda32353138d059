/** Rotations as unit quaternions [w, x, y, z], w >= 0, as the API has them. */

/** @typedef {[number, number, number, number]} Quaternion */
/** @typedef {[number, number, number]} Vector */

/** @param {Quaternion} wxyz @param {Vector} v @returns {Vector} */
export function rotated([w, x, y, z], [a, b, c]) {
  // v + 2 u x (u x v + w v), u the vector part
  const p = y * c - z * b + w * a;
  const q = z * a - x * c + w * b;
  const r = x * b - y * a + w * c;
  return [a + 2 * (y * r - z * q), b + 2 * (z * p - x * r), c + 2 * (x * q - y * p)];
}

/** @param {Quaternion} a @param {Quaternion} b the rotation that is done first @returns {Quaternion} */
export function composed([aw, ax, ay, az], [bw, bx, by, bz]) {
  return unit([
    aw * bw - ax * bx - ay * by - az * bz,
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
  ]);
}

/**
 * Turned further by a rotation vector in degrees.
 * @param {Quaternion} wxyz @param {Vector} degrees @param {"box" | "world"} axes whose axes `degrees` is along
 * @returns {Quaternion}
 */
export function rotatedByDegrees(wxyz, degrees, axes) {
  const angle = (Math.hypot(...degrees) * Math.PI) / 180;
  if (angle === 0) return wxyz;
  const scale = (Math.sin(angle / 2) * Math.PI) / 180 / angle;
  /** @type {Quaternion} */
  const turn = [Math.cos(angle / 2), degrees[0] * scale, degrees[1] * scale, degrees[2] * scale];
  return axes === "box" ? composed(wxyz, turn) : composed(turn, wxyz);
}

/** @param {Quaternion} q @returns {Quaternion} */
export function unit(q) {
  const length = Math.hypot(...q) * (q[0] < 0 ? -1 : 1);
  return [q[0] / length, q[1] / length, q[2] / length, q[3] / length];
}
