/** Trades the token for the page's cookie. */

import { ApiError, logIn } from "./api.js";
import { followTheme } from "./lib/theme.js";
import { theme } from "./store.js";

followTheme(theme);

const form = /** @type {HTMLFormElement} */ (document.getElementById("login"));
const token = /** @type {HTMLInputElement} */ (document.getElementById("token"));
const problem = /** @type {HTMLElement} */ (document.getElementById("problem"));

form.addEventListener("submit", async (event) => {
  event.preventDefault();
  problem.textContent = "";
  try {
    await logIn(token.value.trim());
    location.replace(destination());
  } catch (error) {
    if (!(error instanceof ApiError)) throw error;
    problem.textContent = error.message;
    token.select();
  }
});

/** Where one wanted to go: the session's page that was asked for, here or by an address whose code was used up. */
function destination() {
  const wanted = location.pathname === "/login" ? new URLSearchParams(location.search).get("next") : location.pathname;
  return wanted !== null && /^\/sessions\/[a-z][a-z0-9]{11}$/.test(wanted) ? wanted : "/";
}
