/** Options that belong together, each with its title, meaning and default as the server tells them. */

import { Icon } from "../../lib/icon.js";
import { html, useId } from "../../lib/view.js";
import { changes, clashes, isIdle, mistakes, refusals, reset, valueOf } from "./draft.js";
import { ChoiceField, FrameListField, NumberOption, RangeField, SessionsField } from "./fields.js";
import { valueWords } from "./words.js";

/** @typedef {import("./draft.js").Option} Option */

/** @type {Record<string, any>} */
const FIELDS = { integer: NumberOption, number: NumberOption, choice: ChoiceField, integers: FrameListField, texts: SessionsField, range: RangeField };

/** @param {{title: string, holder: string, options: readonly Option[]}} props `holder`: the object that they are in */
export function OptionGroup({ title, holder, options }) {
  const id = useId();
  const changed = options.map(({ name }) => name).filter((name) => changes.value.has(name) || mistakes.value.has(name));
  const refusal = refusals.value.get(holder);
  return html`<section class="option-group" aria-labelledby=${id}>
    <header>
      <h2 class="heading" id=${id}>${title}</h2>
      ${changed.length > 0 &&
      html`<button class="button link" aria-label=${`Reset ${title}`} onClick=${() => reset(changed)}>Reset ${changed.length}</button>`}
    </header>
    ${refusal !== undefined && !options.some(({ name }) => name === holder) && html`<p class="problem" role="alert">${refusal}</p>`}
    ${options.map((option) => html`<${OptionRow} key=${option.name} option=${option} alone=${options.length === 1 && option.title === title} />`)}
  </section>`;
}

/** @param {{option: Option, alone: boolean}} props `alone`: its group says its title already */
function OptionRow({ option, alone }) {
  const id = useId();
  const { name } = option;
  const changed = changes.value.has(name);
  const problem = mistakes.value.get(name) ?? clashes.value.get(name) ?? refusals.value.get(name);
  const Field = FIELDS[option.type];
  const idle = isIdle(name);
  const wide = ["choice", "integers", "texts"].includes(option.type);
  return html`<div class="option" data-name=${name} data-changed=${changed} data-idle=${idle} data-wide=${wide}>
    <div class="says">
      <span class=${alone ? "visually-hidden" : "title"} id=${`${id}-title`}>${option.title}</span>
      ${changed &&
      !alone &&
      html`<button
        class="button quiet reset" title=${`Reset to the default, ${valueWords(option, option.default)}`}
        aria-label=${`Reset ${option.title} to ${valueWords(option, option.default)}`} onClick=${() => reset([name])}
      ><${Icon} name="undo-2" size=${12} />${valueWords(option, option.default)}</button>`}
      <p class="meaning" id=${`${id}-meaning`}>${option.meaning}</p>
    </div>
    <div class="value">
      <${Field}
        option=${option} value=${valueOf(name)} idle=${idle} invalid=${problem !== undefined}
        labelledBy=${`${id}-title`} describedBy=${`${id}-meaning ${id}-problem`}
      />
    </div>
    ${problem !== undefined && html`<p class="problem" role="alert" id=${`${id}-problem`}>${problem}</p>`}
  </div>`;
}
