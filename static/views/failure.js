/** What is shown where nothing else can be. */

import { html } from "../lib/view.js";

/** @param {{message: string}} props */
export function Failure({ message }) {
  return html`<main class="failure">
    <p class="problem" role="alert">${message}</p>
    <p class="row">
      <button class="button" onClick=${() => location.reload()}>Try again</button>
      <a class="button" href="/">All sessions</a>
    </p>
  </main>`;
}
