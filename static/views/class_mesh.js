/** The mesh of a class's objects: from a file, whose unit and axes are asked for and never guessed. */

import { html, useEffect, useRef, useSignal } from "../lib/view.js";
import * as store from "../store.js";

const UNITS = [
  ["mm", "millimetres"],
  ["cm", "centimetres"],
  ["m", "metres"],
  ["in", "inches"],
];
const AXES = [
  ["x,y,z", "as in the file"],
  ["x,-z,y", "the file's y is up"],
  ["x,z,-y", "the file's y is down"],
  ["z,x,y", "y up, z to the front"],
];

/** @param {import("./class_editor.js").ClassPart} props */
export function ClassMesh({ one, tried, say, wrong }) {
  const { mesh } = one;
  const chosen = useSignal(/** @type {File | null} */ (null));
  const notes = useSignal(/** @type {readonly string[]} */ ([]));
  const over = useSignal(false);
  const input = useRef(/** @type {HTMLInputElement | null} */ (null));
  // Edits, such as an undo, tell the mesh's digest alone.
  const isTold = mesh === null || "vertices" in mesh;
  useEffect(() => {
    if (!isTold) void tried("mesh", store.actions.completeClass(one.id));
  }, [isTold]);

  /** @param {FileList | null | undefined} files */
  const choose = (files) => {
    chosen.value = files?.[0] ?? null;
    notes.value = [];
    say("mesh", null);
    if (input.current !== null) input.current.value = "";
  };
  const remove = () => {
    notes.value = [];
    void tried("mesh", store.actions.deleteClassMesh(one.id));
  };
  return html`<div
    class="class-part" role="group" aria-label="Mesh" data-over=${over.value}
    onDragOver=${(/** @type {DragEvent} */ event) => {
      event.preventDefault();
      over.value = true;
    }}
    onDragLeave=${() => (over.value = false)}
    onDrop=${(/** @type {DragEvent} */ event) => {
      event.preventDefault();
      over.value = false;
      choose(event.dataTransfer?.files);
    }}
  >
    <div class="line"><span class="muted">Mesh</span>
      <span class="row spread">
        <span class=${mesh === null ? "muted cut" : "cut"} title=${mesh?.source?.name ?? ""}>${mesh === null ? "none" : (mesh.source?.name ?? "…")}</span>
        <span class="row">
          <button class="button small" title="An obj, ply, glb or stl file; one can be dropped here, too" onClick=${() => input.current?.click()}>${mesh === null ? "Choose a file" : "Replace"}</button>
          ${mesh !== null && html`<button class="button small" aria-label="Remove mesh" onClick=${remove}>Remove</button>`}
        </span>
      </span>
    </div>
    <input ref=${input} type="file" accept=".obj,.ply,.glb,.stl" hidden aria-label="Mesh file" onChange=${(/** @type {any} */ event) => choose(event.currentTarget.files)} />
    ${mesh !== null && isTold && chosen.value === null && html`<${Told} mesh=${mesh} />`}
    ${chosen.value !== null &&
    html`<${Meaning} key=${chosen.value.name} file=${chosen.value} id=${one.id} tried=${tried} say=${say} wrong=${wrong}
      onGiven=${(/** @type {readonly string[]} */ told) => {
        chosen.value = null;
        notes.value = told;
      }}
      onCancel=${() => choose(null)} />`}
    ${notes.value.map((text) => html`<p key=${text} class="muted small" role="status">${text}</p>`)}
    ${wrong("mesh")}
  </div>`;
}

/** @param {{mesh: import("../store.js").Schemas["MeshJson"]}} props */
function Told({ mesh }) {
  const { unit, axes, origin } = mesh.source;
  const extent = mesh.extent.map((side) => +(side * 1000).toFixed(1)).join(" × ");
  return html`<p class="muted small told">
    ${extent} mm, ${mesh.vertices.toLocaleString("en")} vertices, ${mesh.faces.toLocaleString("en")} faces;
    read in ${unit} along ${axes}, ${origin === "centre" ? "its middle" : "its own origin"} at the box's centre
  </p>`;
}

/**
 * What a file's numbers mean. @param {{
 *   file: File, id: number, onGiven: (notes: readonly string[]) => void, onCancel: () => void,
 * } & Pick<import("./class_editor.js").ClassPart, "tried" | "say" | "wrong">} props
 */
function Meaning({ file, id, tried, say, wrong, onGiven, onCancel }) {
  const unit = useSignal("");
  const axes = useSignal("");
  const isOther = useSignal(false);
  const origin = useSignal("centre");
  const busy = useSignal(false);
  const give = async () => {
    if (busy.value) return;
    if (unit.value === "") return say("mesh unit", "Say in which unit the file's numbers are: the file does not.");
    if (axes.value.trim() === "") return say("mesh axes", "Say which axes of the file run along the box's x, y and z.");
    const form = new FormData();
    const parts = { unit: unit.value, axes: axes.value.trim(), origin: origin.value };
    for (const [name, value] of Object.entries(parts)) form.append(name, value);
    form.append("file", file, file.name);
    busy.value = true;
    const sent = store.actions.putClassMesh(id, form);
    // What is refused of a field is said there.
    const at = await sent.then(
      () => "mesh",
      (error) => (/\baxes\b/.test(error.message) ? "mesh axes" : /\bunit\b/.test(error.message) ? "mesh unit" : "mesh"),
    );
    busy.value = false;
    if (await tried(at, sent)) onGiven(await sent);
  };
  return html`<div class="meaning-of-mesh" role="group" aria-label="What the file's numbers mean">
    <p class="cut" title=${file.name}>${file.name}</p>
    <label class="line"><span class="muted">Unit</span>
      <select class="field" aria-label="Unit of the file" value=${unit.value} onChange=${(/** @type {any} */ event) => (unit.value = event.currentTarget.value)}>
        <option value="">Choose</option>
        ${UNITS.map(([value, words]) => html`<option key=${value} value=${value}>${value}, ${words}</option>`)}
      </select>
    </label>
    ${wrong("mesh unit")}
    <label class="line"><span class="muted">Axes</span>
      <select class="field" aria-label="Axes of the file" value=${isOther.value ? "other" : axes.value}
        onChange=${(/** @type {any} */ event) => {
          isOther.value = event.currentTarget.value === "other";
          axes.value = isOther.value ? "" : event.currentTarget.value;
        }}
      >
        <option value="">Choose</option>
        ${AXES.map(([value, words]) => html`<option key=${value} value=${value}>${value}, ${words}</option>`)}
        <option value="other">Other</option>
      </select>
    </label>
    ${isOther.value &&
    html`<label class="line"><span></span>
      <input class="field" aria-label="Other axes" placeholder="such as y,-x,z" maxlength="20" autocomplete="off" spellcheck=${false}
        value=${axes.value} onInput=${(/** @type {any} */ event) => (axes.value = event.currentTarget.value)} />
    </label>`}
    <p class="muted small">Which of them run along the box's X, Y, Z.</p>
    ${wrong("mesh axes")}
    <label class="line"><span class="muted">At the centre</span>
      <select class="field" aria-label="What lies at the box's centre" value=${origin.value} onChange=${(/** @type {any} */ event) => (origin.value = event.currentTarget.value)}>
        <option value="centre">its middle</option>
        <option value="file">the file's own origin</option>
      </select>
    </label>
    <div class="line actions">
      <button class="button small" aria-disabled=${busy.value} onClick=${give}>${busy.value ? "Reading…" : "Use this mesh"}</button>
      <button class="button small quiet" onClick=${onCancel}>Cancel</button>
    </div>
  </div>`;
}
