/** Dark or light: as the system has it, until someone chooses; a choice is kept in this browser. */

import { effect } from "./view.js";

const KEPT = "ars-web.theme";

/** @param {import("./view.js").Signal<"dark" | "light">} theme */
export function followTheme(theme) {
  const light = matchMedia("(prefers-color-scheme: light)");
  const kept = localStorage.getItem(KEPT);
  const system = () => (light.matches ? "light" : "dark");
  theme.value = kept === "dark" || kept === "light" ? kept : system();
  light.addEventListener("change", () => {
    if (localStorage.getItem(KEPT) === null) theme.value = system();
  });
  effect(() => {
    document.documentElement.dataset.theme = theme.value;
    if (theme.value !== system()) localStorage.setItem(KEPT, theme.value);
    else localStorage.removeItem(KEPT);
  });
}
