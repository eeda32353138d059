/**
 * Lengths and angles as people type them: `85`, `85 mm`, `8,5cm`, `(10+5)*2`, `12°`.
 *
 * sum     = product (("+" | "-") product)*
 * product = signed (("*" | "/") signed unit?)*
 * signed  = ("+" | "-")* atom unit?
 * atom    = number | "(" sum ")"
 *
 * A number without a unit is in millimetres or degrees. In a product of bare numbers the unit belongs to the whole:
 * `85/2 mm` is 42.5 mm. Only a length (or an angle), or a bare number, may come out.
 */

/** @typedef {"length" | "angle"} Kind */
/** @typedef {{ok: true, value: number} | {ok: false, problem: string}} Parsed lengths in metres, angles in degrees */
/** @typedef {{value: number, measured: boolean}} Term `measured`: in metres or degrees; else a bare number */
/** @typedef {{text: string, kind: "number" | "unit" | "sign" | "end"}} Token */

export const LONGEST_TEXT = 100;

/**
 * How many of each unit make a metre; whole numbers, so that dividing by them rounds once.
 * @type {Record<string, number>}
 */
const PER_METRE = { mm: 1000, cm: 100, m: 1 };

/** @type {Record<Kind, {name: string, convert: (value: number, unit: string) => number | null, bare: string, units: string, example: string}>} */
const KINDS = {
  length: {
    name: "length",
    convert: (value, unit) => (Object.hasOwn(PER_METRE, unit) ? value / PER_METRE[unit] : null),
    bare: "mm",
    units: "mm, cm or m",
    example: "85, 8.5 cm or 85/2",
  },
  angle: {
    name: "angle",
    convert: (value, unit) => (unit === "°" || unit === "deg" ? value : unit === "rad" ? (value * 180) / Math.PI : null),
    bare: "°",
    units: "° or rad",
    example: "12, 12.5° or 90/4",
  },
};

const BLANK = /[\s\u00a0\u2009\u202f]+/y;
const NUMBER = /(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[+-]?\d+)?/iy;
const UNIT = /[°\p{Letter}]+/uy;
const SIGN = /[-+*/()]/y;
/** Other ways to write the signs, as keyboards and word processors do. */
const SIGNS = /** @type {Record<string, string>} */ ({ "−": "-", "–": "-", "×": "*", "·": "*", "÷": "/", ":": "/" });

/** What cannot be read, in words for the person who typed it. */
class Unreadable extends Error {}

/**
 * @param {string} text
 * @param {Kind} kind
 * @returns {Parsed}
 */
export function parseQuantity(text, kind) {
  try {
    return { ok: true, value: new Reader(text, kind).whole() };
  } catch (error) {
    if (error instanceof Unreadable) return { ok: false, problem: error.message };
    throw error;
  }
}

/**
 * A length for a field, in mm.
 * @param {number} metres
 * @param {number} [decimals]
 */
export function millimetres(metres, decimals = 1) {
  return fixed(metres * 1000, decimals);
}

/**
 * @param {number} value
 * @param {number} decimals
 */
export function fixed(value, decimals) {
  const text = value.toFixed(decimals);
  return Number(text) === 0 ? text.replace("-", "") : text;
}

/**
 * Rounded, but with no more decimals than it needs.
 * @param {number} value
 * @param {number} least decimals
 * @param {number} most decimals
 */
export function trimmed(value, least, most) {
  let text = fixed(value, most);
  for (let decimals = most; decimals > least && text.endsWith("0"); decimals -= 1) text = text.slice(0, -1);
  return text.endsWith(".") ? text.slice(0, -1) : text;
}

/**
 * A box's size in a list: `85 mm` where all sides are the same to the mm, else `120 × 80 × 45 mm`.
 * @param {readonly number[]} size metres
 */
export function sizeText(size) {
  const sides = size.map((side) => (side < 0.001 ? trimmed(side * 1000, 1, 3) : fixed(side * 1000, 0)));
  return `${sides.every((side) => side === sides[0]) ? sides[0] : sides.join(" × ")} mm`;
}

class Reader {
  /** @param {string} text @param {Kind} kind */
  constructor(text, kind) {
    this.kind = KINDS[kind];
    if (text.trim() === "") throw new Unreadable(`Type ${article(kind)} ${kind}, such as ${this.kind.example}.`);
    if (text.length > LONGEST_TEXT) throw new Unreadable(`At most ${LONGEST_TEXT} characters can be read.`);
    this.tokens = tokens(text.replace(/[−–×·÷:]/g, (sign) => SIGNS[sign]));
    this.at = 0;
  }

  /** All of the text. @returns {number} */
  whole() {
    const { value } = this.measure(this.sum());
    const { kind, text } = this.token;
    if (text === ")") throw new Unreadable("There is a ) without its (.");
    if (kind === "unit") throw new Unreadable(`“${shown(text)}” is one unit too many.`);
    if (kind !== "end") throw new Unreadable(`“${shown(text)}” is not expected there; is a sign such as + missing?`);
    if (!Number.isFinite(value)) throw new Unreadable("The result is too large.");
    return value;
  }

  get token() {
    return this.tokens[this.at];
  }

  /** Whether the next token is one of these signs; it is read if so. @param {string} signs */
  take(signs) {
    const { kind, text } = this.token;
    if (kind !== "sign" || !signs.includes(text)) return "";
    this.at += 1;
    return text;
  }

  /** @returns {Term} */
  sum() {
    let left = this.product();
    for (let sign = this.take("+-"); sign !== ""; sign = this.take("+-")) {
      const right = this.product();
      const alike = left.measured === right.measured;
      const [a, b] = alike ? [left, right] : [this.measure(left), this.measure(right)];
      left = { value: sign === "+" ? a.value + b.value : a.value - b.value, measured: a.measured };
    }
    return left;
  }

  /** @returns {Term} */
  product() {
    let left = this.unit(this.signed());
    for (let sign = this.take("*/"); sign !== ""; sign = this.take("*/")) {
      const right = this.signed();
      const unitFollows = this.token.kind === "unit";
      if (unitFollows && !left.measured && !right.measured) {
        left = this.unit({ value: combined(left.value, sign, right.value), measured: false });
      } else {
        left = this.combine(left, sign, this.unit(right));
      }
    }
    return left;
  }

  /** @returns {Term} */
  signed() {
    let negative = false;
    for (let sign = this.take("+-"); sign !== ""; sign = this.take("+-")) negative = negative !== (sign === "-");
    const { value, measured } = this.atom();
    return { value: negative ? -value : value, measured };
  }

  /** @returns {Term} */
  atom() {
    const { kind, text } = this.token;
    if (this.take("(") !== "") {
      const inner = this.sum();
      if (this.take(")") === "") throw new Unreadable("There is a ( without its ).");
      return inner;
    }
    if (kind === "number") {
      this.at += 1;
      return { value: number(text), measured: false };
    }
    if (kind === "end") throw new Unreadable("Something is missing at the end.");
    throw new Unreadable(`There is no number before “${shown(text)}”.`);
  }

  /** The term with the unit that follows it, if one does. @param {Term} term @returns {Term} */
  unit(term) {
    const { kind, text } = this.token;
    if (kind !== "unit") return term;
    const value = this.kind.convert(term.value, text.toLowerCase());
    if (value === null) {
      throw new Unreadable(`“${shown(text)}” is not a unit of ${this.kind.name}; use ${this.kind.units}.`);
    }
    if (term.measured) throw new Unreadable(`“${shown(text)}” is one unit too many.`);
    this.at += 1;
    return { value, measured: true };
  }

  /** @param {Term} left @param {string} sign @param {Term} right @returns {Term} */
  combine(left, sign, right) {
    const name = `${article(this.kind.name)} ${this.kind.name}`;
    if (sign === "*" && left.measured && right.measured) {
      throw new Unreadable(`${capital(name)} times ${name} is not ${name}.`);
    }
    if (sign === "/" && !left.measured && right.measured) {
      throw new Unreadable(`A number divided by ${name} is not ${name}.`);
    }
    const measured = sign === "*" ? left.measured || right.measured : left.measured && !right.measured;
    return { value: combined(left.value, sign, right.value), measured };
  }

  /** A bare number as what the field shows. @param {Term} term @returns {Term} */
  measure(term) {
    return term.measured ? term : { value: this.kind.convert(term.value, this.kind.bare) ?? NaN, measured: true };
  }
}

/** @param {string} text @returns {Token[]} */
function tokens(text) {
  /** @type {Token[]} */
  const found = [];
  for (let at = 0; at < text.length; ) {
    const blank = match(BLANK, text, at);
    at += blank.length;
    if (at === text.length) break;
    const token = tokenAt(text, at);
    found.push(token);
    at += token.text.length;
  }
  return [...found, { text: "", kind: "end" }];
}

/** @param {string} text @param {number} at @returns {Token} */
function tokenAt(text, at) {
  const number = match(NUMBER, text, at);
  if (number !== "") {
    if (/[.,]/.test(text.charAt(at + number.length))) {
      throw new Unreadable(`“${shown(number + text.slice(at + number.length))}” has more than one decimal point.`);
    }
    return { text: number, kind: "number" };
  }
  const unit = match(UNIT, text, at);
  if (unit !== "") return { text: unit, kind: "unit" };
  const sign = match(SIGN, text, at);
  if (sign !== "") return { text: sign, kind: "sign" };
  const [character] = text.slice(at);
  throw new Unreadable(`“${character}” cannot be read; type numbers, units and + - * / ( ).`);
}

/** @param {string} text @returns {number} */
function number(text) {
  if (/^[1-9]\d{0,2},\d{3}$/.test(text)) {
    const [before, after] = text.split(",");
    throw new Unreadable(`“${text}” can be read in two ways; type ${before}${after} or ${before}.${after}.`);
  }
  const value = Number(text.replace(",", "."));
  if (!Number.isFinite(value)) throw new Unreadable(`“${shown(text)}” is too large.`);
  return value;
}

/** @param {number} left @param {string} sign @param {number} right */
function combined(left, sign, right) {
  if (sign === "*") return left * right;
  if (right === 0) throw new Unreadable("Nothing can be divided by 0.");
  return left / right;
}

/** @param {RegExp} pattern sticky @param {string} text @param {number} at */
function match(pattern, text, at) {
  pattern.lastIndex = at;
  return pattern.exec(text)?.[0] ?? "";
}

/** Short enough to be quoted. @param {string} text */
function shown(text) {
  return text.length > 16 ? `${text.slice(0, 15)}…` : text;
}

/** @param {string} word */
function article(word) {
  return word.startsWith("a") ? "an" : "a";
}

/** @param {string} words */
function capital(words) {
  return words.charAt(0).toUpperCase() + words.slice(1);
}
