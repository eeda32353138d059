// Copies the page's libraries out of node_modules into static/vendor/: `npm run vendor`. With --check it copies nothing
// and fails where something differs. Changes nothing in them but the names of modules: an import map would need an inline
// script, which the page's content security policy forbids.
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const top = join(dirname(fileURLToPath(import.meta.url)), "..");
const here = join(top, "static", "vendor");
const modules = join(top, "node_modules");
const checking = process.argv.includes("--check");

/** Each icon that the page uses, by Lucide's name. */
const ICONS = [
  "axis-3d", "badge-check", "box", "boxes", "brush", "check", "chevron-down", "chevron-left", "chevron-right", "chevron-up",
  "chevrons-left", "chevrons-right", "circle-alert", "circle-question-mark", "clipboard-list", "cloud-off", "command", "copy",
  "crosshair", "download", "ellipsis", "eraser", "eye", "eye-off", "file-archive", "film", "folder", "folder-open",
  "grid-3x3", "hand", "rotate-ccw-clock", "house", "image", "info", "keyboard", "lasso", "layers", "lightbulb", "list", "loader-circle",
  "lock", "lock-open", "magnet", "maximize", "minus", "moon", "mouse-pointer-2", "move", "move-3d", "move-diagonal-2",
  "package", "pencil", "play", "plus", "redo-2", "refresh-cw", "rotate-3d", "rotate-cw", "scale-3d", "search", "skip-back",
  "skip-forward", "square-dashed", "sun", "tag", "trash", "triangle-alert", "undo-2", "upload", "users", "wand-sparkles", "waypoints", "x",
];

/** Where each module lies, seen from another vendored module's folder. */
const ADDRESSES = {
  preact: "../preact/preact.js",
  "preact/hooks": "../preact/hooks.js",
  "@preact/signals-core": "../signals/signals-core.js",
};

/** @type {[from: string, to: string][]} */
const SCRIPTS = [
  ["preact/dist/preact.mjs", "preact/preact.js"],
  ["preact/hooks/dist/hooks.mjs", "preact/hooks.js"],
  ["@preact/signals-core/dist/signals-core.mjs", "signals/signals-core.js"],
  ["@preact/signals/dist/signals.mjs", "signals/signals.js"],
  ["htm/dist/htm.mjs", "htm/htm.js"],
];

/** @type {[from: string, to: string][]} */
const FILES = [
  ["preact/LICENSE", "preact/LICENSE"],
  ["@preact/signals/LICENSE", "signals/LICENSE"],
  ["htm/LICENSE", "htm/LICENSE"],
  ["lucide-static/LICENSE", "lucide/LICENSE"],
  ["@fontsource-variable/inter/LICENSE", "inter/LICENSE"],
  ["@fontsource-variable/inter/files/inter-latin-wght-normal.woff2", "inter/inter-latin.woff2"],
  ["@fontsource-variable/inter/files/inter-latin-ext-wght-normal.woff2", "inter/inter-latin-ext.woff2"],
  ["@fontsource-variable/inter/files/inter-greek-wght-normal.woff2", "inter/inter-greek.woff2"],
  ["@fontsource-variable/inter/files/inter-cyrillic-wght-normal.woff2", "inter/inter-cyrillic.woff2"],
];

for (const [from, to] of SCRIPTS) {
  const source = readFileSync(join(modules, from), "utf8").replace(/\n?\/\/# sourceMappingURL=.*\n?$/, "\n");
  put(to, source.replace(/(from\s*)"([^".][^"]*)"/g, (_, word, name) => `${word}"${address(name)}"`));
}
for (const [from, to] of FILES) {
  put(to, readFileSync(join(modules, from)));
}

const nodes = JSON.parse(readFileSync(join(modules, "lucide-static/icon-nodes.json"), "utf8"));
const lines = ICONS.map((name) => `  ${JSON.stringify(name)}: ${JSON.stringify(nodes[name] ?? fail(name))},\n`);
put("lucide/icons.js", `// Of lucide-static, see README.md: each icon's elements, on a field of 24 x 24.\nexport const ICONS = {\n${lines.join("")}};\n`);
put("lucide/icons.d.ts", "export const ICONS: Record<string, [string, Record<string, string>][]>;\n");

const packages = ["preact", "@preact/signals", "@preact/signals-core", "htm", "lucide-static", "@fontsource-variable/inter"];
const rows = packages.map((name) => {
  const { version, license } = JSON.parse(readFileSync(join(modules, name, "package.json"), "utf8"));
  return `| ${name} | ${version} | ${license} |\n`;
});
put(
  "README.md",
  `# Vendored libraries\n\nWritten by \`npm ci && npm run vendor\`; not to be edited. Each folder holds its licence.\n\n| package | version | licence |\n|---|---|---|\n${rows.join("")}`,
);

/** @param {string} name */
function address(name) {
  return ADDRESSES[/** @type {keyof ADDRESSES} */ (name)] ?? fail(name);
}

/** @param {string} to @param {string | Buffer} content */
function put(to, content) {
  const path = join(here, to);
  if (checking) {
    if (readFileSync(path).equals(Buffer.from(content))) return;
    throw new Error(`${path} is not what the packages hold: run \`npm run vendor\``);
  }
  mkdirSync(dirname(path), { recursive: true });
  writeFileSync(path, content);
}

/** @param {string} name @returns {never} */
function fail(name) {
  throw new Error(`${name}: not found in the packages that are installed`);
}
