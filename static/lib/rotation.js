/**
 * Rotations as unit quaternions [w, x, y, z], w >= 0, as the API has them, and as roll, pitch and yaw in degrees:
 * R = Rz(yaw) Ry(pitch) Rx(roll), a turn about the fixed axes x, then y, then z.
 */

/** @typedef {[roll: number, pitch: number, yaw: number]} Angles degrees */
/** @typedef {[w: number, x: number, y: number, z: number]} Quaternion */
/** @typedef {[x: number, y: number, z: number]} Vector */

/** Two rotations closer than this, in radians, are the same: far below what a float of the server's loses. */
const SAME = 1e-9;
/** Below this, roll and yaw turn about one axis and only their sum or difference is known. */
const LOCKED = 1e-9;
const DEGREE = Math.PI / 180;

/** @param {Readonly<Angles>} angles @returns {Quaternion} */
export function wxyzOfAngles([roll, pitch, yaw]) {
  const [cr, sr] = halfTurn(roll);
  const [cp, sp] = halfTurn(pitch);
  const [cy, sy] = halfTurn(yaw);
  return unit([
    cr * cp * cy + sr * sp * sy,
    sr * cp * cy - cr * sp * sy,
    cr * sp * cy + sr * cp * sy,
    cr * cp * sy - sr * sp * cy,
  ]);
}

/**
 * The angles of a rotation: those of `last` where they describe it still; else, of the two triples that do, the one
 * nearer to `last`, or, without it, the one with a pitch of -90 to 90. Where the pitch is 90 or -90 the roll stays as
 * in `last`.
 *
 * By half sums and differences, exact at every pitch (Bernardes and Viollet 2022, "Quaternion to Euler angles
 * conversion: a direct, general and computationally efficient method").
 *
 * @param {Readonly<Quaternion>} wxyz of unit length
 * @param {Readonly<Angles> | null} [last] what was shown before
 * @returns {Angles}
 */
export function anglesOfWxyz(wxyz, last = null) {
  if (last !== null && angleBetween(wxyz, wxyzOfAngles(last)) < SAME) return [...last];
  const [w, x, y, z] = wxyz;
  // With a = cos(pitch/2), b = sin(pitch/2): these are (a - b) and (a + b) times the cosine and sine of
  // (yaw + roll)/2 and (yaw - roll)/2.
  const minus = Math.hypot(w - y, z + x);
  const plus = Math.hypot(w + y, z - x);
  let halfSum = Math.atan2(z + x, w - y) / DEGREE;
  let halfDifference = Math.atan2(z - x, w + y) / DEGREE;
  const pitch = 90 - (2 * Math.atan2(minus, plus)) / DEGREE;
  const roll = last === null ? 0 : last[0];
  if (minus < LOCKED) halfSum = halfDifference + roll;
  if (plus < LOCKED) halfDifference = halfSum - roll;
  /** @type {Angles} */
  const usual = [wrapped(halfSum - halfDifference), pitch, wrapped(halfSum + halfDifference)];
  if (last === null) return usual;
  /** @type {Angles} */
  const other = [wrapped(usual[0] + 180), wrapped(180 - pitch), wrapped(usual[2] + 180)];
  return distance(other, last) < distance(usual, last) ? other : usual;
}

/**
 * The angle in radians of the turn from one rotation to another.
 * @param {Readonly<Quaternion>} a
 * @param {Readonly<Quaternion>} b
 */
export function angleBetween(a, b) {
  const sign = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] < 0 ? -1 : 1;
  const apart = Math.hypot(a[0] - sign * b[0], a[1] - sign * b[1], a[2] - sign * b[2], a[3] - sign * b[3]);
  return 4 * Math.asin(Math.min(1, apart / 2));
}

/**
 * Of unit length, and of the two that are one rotation the one with w >= 0.
 * @param {Readonly<Quaternion>} q
 * @returns {Quaternion}
 */
export function unit(q) {
  const length = Math.hypot(...q) * (q[0] < 0 ? -1 : 1);
  return [q[0] / length, q[1] / length, q[2] / length, q[3] / length];
}

/** @param {Readonly<Quaternion>} wxyz @param {Readonly<Vector>} v @returns {Vector} */
export function rotated([w, x, y, z], [a, b, c]) {
  // v + 2 u x (u x v + w v), u the vector part
  const p = y * c - z * b + w * a;
  const q = z * a - x * c + w * b;
  const r = x * b - y * a + w * c;
  return [a + 2 * (y * r - z * q), b + 2 * (z * p - x * r), c + 2 * (x * q - y * p)];
}

/** @param {Readonly<Quaternion>} a @param {Readonly<Quaternion>} b the rotation that is done first @returns {Quaternion} */
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
 * @param {Quaternion} wxyz @param {Readonly<Vector>} degrees @param {"box" | "world"} axes whose axes `degrees` is along
 * @returns {Quaternion}
 */
export function rotatedByDegrees(wxyz, degrees, axes) {
  const angle = Math.hypot(...degrees) * DEGREE;
  if (angle === 0) return wxyz;
  const scale = (Math.sin(angle / 2) * DEGREE) / angle;
  /** @type {Quaternion} */
  const turn = [Math.cos(angle / 2), degrees[0] * scale, degrees[1] * scale, degrees[2] * scale];
  return axes === "box" ? composed(wxyz, turn) : composed(turn, wxyz);
}

/**
 * Turned by the least angle that makes one of the box's axes vertical.
 * @param {Readonly<Quaternion>} wxyz
 * @returns {Quaternion}
 */
export function uprighted(wxyz) {
  /** @type {Vector[]} */
  const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  const [x, y, z] = axes.map((axis) => rotated(wxyz, axis)).reduce((best, axis) => (Math.abs(axis[2]) > Math.abs(best[2]) ? axis : best));
  const up = z < 0 ? -1 : 1;
  // Half way from that axis to the vertical, z is 1/sqrt(3) at least.
  return composed(unit([1 + up * z, up * y, -up * x, 0]), wxyz);
}

/** To -180 up to 180, 180 included. @param {number} degrees */
export function wrapped(degrees) {
  const turned = degrees - 360 * Math.round(degrees / 360);
  return turned <= -180 ? turned + 360 : turned;
}

/** Cosine and sine of half the angle. @param {number} degrees @returns {[number, number]} */
function halfTurn(degrees) {
  return [Math.cos((degrees * DEGREE) / 2), Math.sin((degrees * DEGREE) / 2)];
}

/** @param {Readonly<Angles>} a @param {Readonly<Angles>} b */
function distance(a, b) {
  return a.reduce((sum, angle, i) => sum + Math.abs(wrapped(angle - b[i])), 0);
}
