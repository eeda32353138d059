/** How each type of option is set. */

import { html, useEffect, useSignal } from "../../lib/view.js";
import { actions, frames, sid } from "../../store.js";
import { angles, parseAngles } from "./angles.js";
import { setMistake, setOption, valueOf, wrong } from "./draft.js";
import { parseFrames } from "./frame_list.js";
import { capital, figure, many, runs, unit } from "./words.js";

/** @typedef {import("./draft.js").Option} Option */
/** @typedef {import("../../store.js").Session} Session */

/**
 * @typedef {object} FieldProps
 * @property {Option} option
 * @property {any} value
 * @property {boolean} idle it means nothing beside the others
 * @property {boolean} invalid
 * @property {string} labelledBy
 * @property {string} describedBy
 */

/** What stands in a field that nothing is typed in. @type {Record<string, () => string>} */
const PLACEHOLDERS = {
  "frames.stop": () => figure(frames.value),
  "frames.count": () => "all",
  "frames.sector_box": () => "all",
};

/** @param {FieldProps} props */
export function NumberOption(props) {
  const { option, value } = props;
  const isShare = option.type === "number" && option.minimum === 0 && option.maximum === 1;
  return html`
    ${isShare &&
    html`<input
      type="range" min="0" max="1" step="0.01" value=${value} tabindex="-1" aria-hidden="true"
      style=${{ "--part": `${value * 100}%` }}
      onInput=${(/** @type {any} */ event) => setOption(option.name, Number(event.currentTarget.value))}
    />`}
    <${TypedField}
      ...${props} text=${value === null ? "" : String(value)} placeholder=${PLACEHOLDERS[option.name]?.() ?? ""}
      read=${(/** @type {string} */ text) => readNumber(option, text)} step=${isShare ? 0.05 : 1}
    />
    ${unit(option) !== "" && html`<span class="unit">${unit(option)}</span>`}
  `;
}

/** @param {FieldProps} props */
export function FrameListField(props) {
  const { value } = props;
  return html`<${TypedField} ...${props} text=${value === null ? "" : runs(value)} placeholder="such as 0-9, 20, 35" read=${parseFrames} />
    ${value !== null && html`<span class="unit">${many(value.length, "frame")}</span>`}`;
}

/** @param {FieldProps} props */
export function RangeField(props) {
  const { value } = props;
  return html`<${TypedField} ...${props} text=${value === null ? "" : angles(value)} placeholder="such as 0 to 180" read=${parseAngles} />
    <span class="unit">${unit(props.option)}</span>`;
}

/**
 * A field of text that is read while it is typed. What cannot be read stays, with the reason beneath.
 * @param {FieldProps & {text: string, placeholder: string, read: (text: string) => {value: any} | {problem: string}, step?: number}} props
 */
function TypedField({ option, value, idle, invalid, labelledBy, describedBy, text, placeholder, read, step }) {
  /** What is being typed; null: nothing. */
  const draft = useSignal(/** @type {string | null} */ (null));
  // A reset, or another field, took the place of what was typed.
  useEffect(() => {
    if (!invalid) return;
    return () => void (draft.value = null);
  }, [invalid]);

  /** @param {unknown} next */
  const take = (next) => {
    const problem = wrong(option, next);
    setMistake(option.name, problem);
    if (problem === null) setOption(option.name, next);
    return problem === null;
  };
  /** @param {string} typed */
  const type = (typed) => {
    draft.value = typed;
    const found = read(typed);
    if ("problem" in found) setMistake(option.name, found.problem);
    else take(found.value);
  };
  /** @param {KeyboardEvent} event */
  const keys = (event) => {
    const input = /** @type {HTMLInputElement} */ (event.currentTarget);
    if (event.key === "Escape") {
      event.stopPropagation();
      if (draft.value === null) input.blur();
      draft.value = null;
      setMistake(option.name, null);
    } else if (event.key === "Enter") {
      if (!invalid) draft.value = null;
    } else if (step !== undefined && (event.key === "ArrowUp" || event.key === "ArrowDown")) {
      event.preventDefault();
      event.stopPropagation();
      const least = option.type === "integer" ? 1 : 0;
      const by = Math.max(least, step * (event.shiftKey ? 10 : event.altKey ? 0.1 : 1)) * (event.key === "ArrowUp" ? 1 : -1);
      const [low, high] = [option.minimum ?? -Infinity, option.maximum ?? Infinity];
      const from = value ?? (option.name === "frames.stop" ? frames.value : 0);
      draft.value = null;
      take(Math.min(high, Math.max(low, Math.round((from + by) * 1e6) / 1e6)));
    }
  };
  const number = step !== undefined;
  return html`<input
    class="field" type="text" inputmode=${number ? "decimal" : "text"} role=${number ? "spinbutton" : undefined}
    aria-labelledby=${labelledBy} aria-describedby=${describedBy} aria-invalid=${invalid}
    aria-valuenow=${number && value !== null ? value : undefined} autocomplete="off" spellcheck=${false}
    disabled=${idle} placeholder=${placeholder} value=${draft.value ?? text}
    onInput=${(/** @type {any} */ event) => type(event.currentTarget.value)}
    onBlur=${() => !invalid && (draft.value = null)} onKeyDown=${keys}
  />`;
}

/** @param {Option} option @param {string} text @returns {{value: number | null} | {problem: string}} */
function readNumber(option, text) {
  const typed = text.trim().replace(",", ".");
  if (typed === "" && option.optional) return { value: null };
  if (typed === "") return { problem: `Type a number; the default is ${option.default}.` };
  const value = Number(typed.replace(/\s*px$/, ""));
  return Number.isFinite(value) ? { value } : { problem: `“${typed}” is not a number.` };
}

/** @param {FieldProps} props */
export function ChoiceField({ option, value, idle, labelledBy, describedBy, invalid }) {
  return html`<div class="choices" role="radiogroup" aria-labelledby=${labelledBy} aria-describedby=${describedBy} aria-invalid=${invalid}>
    ${option.choices.map(
      (choice) => html`<label key=${choice.value} class="choice">
        <input
          type="radio" aria-label=${capital(choice.value)} aria-describedby=${`${describedBy.split(" ")[0]}-${choice.value}`} name=${option.name} value=${choice.value} checked=${choice.value === value} disabled=${idle}
          onChange=${() => setOption(option.name, choice.value)}
        />
        <span><span class="name">${capital(choice.value)}</span>${choice.value === option.default && html` <span class="default">default</span>`}
          <span class="meaning" id=${`${describedBy.split(" ")[0]}-${choice.value}`}>${choice.meaning}</span></span>
      </label>`,
    )}
  </div>`;
}

/** Further sessions, or those of the dataset that are held out, by their names. @param {FieldProps} props */
export function SessionsField({ option, value, idle, labelledBy, describedBy }) {
  const others = useSignal(/** @type {readonly Session[] | null} */ (null));
  const problem = useSignal(/** @type {string | null} */ (null));
  useEffect(() => {
    actions.sessions().then(
      (found) => (others.value = found),
      (error) => (problem.value = error.message),
    );
  }, []);
  if (problem.value !== null) return html`<p class="problem" role="alert">${problem.value}</p>`;
  if (others.value === null) return html`<p class="meaning" role="status">Looking for other sessions</p>`;
  const merged = /** @type {string[]} */ (valueOf("sessions") ?? []);
  const heldOut = option.name === "split.hold_out";
  const offered = others.value.filter(({ id }) => (heldOut ? id === sid.value || merged.includes(id) : id !== sid.value));
  if (heldOut && offered.length < 2) return html`<p class="meaning">There is one session in this dataset: merge another to hold one out.</p>`;
  if (offered.length === 0) return html`<p class="meaning">There is no other session yet.</p>`;
  /** @param {string} id @param {boolean} wanted */
  const merge = (id, wanted) => setOption(option.name, wanted ? [...value, id] : value.filter((/** @type {string} */ one) => one !== id));
  return html`<div class="choices sessions" role="group" aria-labelledby=${labelledBy} aria-describedby=${describedBy}>
    ${offered.map(
      (one) => html`<label key=${one.id} class="choice">
        <input type="checkbox" checked=${value.includes(one.id)} disabled=${idle} onChange=${(/** @type {any} */ event) => merge(one.id, event.currentTarget.checked)} />
        <span><span class="name">${one.name}</span> <span class="default">${many(one.frames, "frame")}, ${many(one.boxes, "box", "boxes")}</span></span>
      </label>`,
    )}
  </div>`;
}
