/** Below the panes: which corner is next, how well each is known, and the button that makes the box. */

import { html, useState } from "../../lib/view.js";
import { actions, classes, selectedBox } from "../../store.js";
import { CORNERS, NEEDED, begun, choose, corners, current, locations, points, startOver } from "./corners.js";
import { Diagram } from "./diagram.js";
import { isGoodAngle } from "./partner_frame.js";

const WHICH = ["lower corner", "above it", "then along x", "then along y"];
/** Pixels off, beyond which a corner is worth another look. */
const MUCH = 3;

/** @param {{onMade: (degrees: number) => void}} props */
export function Steps({ onMade }) {
  const done = CORNERS.map((corner) => corners.value[corner].size >= NEEDED);
  return html`<footer class="points-steps">
    <${Diagram} current=${current.value} done=${done} />
    <div class="middle">
      <ol class="cards" aria-label="Corners">
        ${CORNERS.map((corner) => html`<${Card} key=${corner} corner=${corner} />`)}
      </ol>
      <${Remarks} />
    </div>
    <${Making} onMade=${onMade} />
  </footer>`;
}

/** @param {{corner: number}} props */
function Card({ corner }) {
  const seen = corners.value[corner].size;
  const location = locations.value[corner];
  const answer = location?.answer ?? null;
  const off = answer === null ? 0 : Math.max(...answer.residuals_px);
  const doubtful = location !== null && (answer === null || answer.warnings.length > 0 || off > MUCH);
  return html`<li>
    <button
      type="button" class="corner-card" aria-current=${corner === current.value ? "step" : undefined}
      data-state=${doubtful ? "doubtful" : seen >= NEEDED ? "done" : "open"} onClick=${() => choose(corner)}
    >
      <strong>P${corner}</strong> <span class="which">${WHICH[corner]}</span>
      <span class="state">
        ${seen === 0
          ? html`<span class="muted">not marked</span>`
          : answer !== null
            ? html`<span title="How far the marks are from one point in space">${off.toFixed(1)} px</span>
                <span title="Between the views: 20 to 60 is good" class=${isGoodAngle(answer.angle_degrees) ? "" : "uncertain"}>${answer.angle_degrees.toFixed(0)}°</span>`
            : location?.problem
              ? html`<span class="uncertain">does not fit</span>`
              : html`<span class="muted">${seen} of ${NEEDED} frames</span>`}
      </span>
    </button>
  </li>`;
}

/** What is uncertain, corner by corner; else what is found so far. */
function Remarks() {
  const remarks = CORNERS.flatMap((corner) => {
    const location = locations.value[corner];
    if (location === null) return [];
    return (location.problem !== null ? [location.problem] : (location.answer?.warnings ?? [])).map((text) => `P${corner}: ${text}`);
  });
  if (remarks.length > 0) return html`<div class="remarks" role="status">${remarks.map((text) => html`<p class="problem">${text}</p>`)}</div>`;
  const edges = ["z", "x", "y"].flatMap((axis, i) => {
    const [a, b] = [locations.value[i]?.answer?.point, locations.value[i + 1]?.answer?.point];
    return a && b ? [`${axis} ${(Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]) * 1000).toFixed(1)} mm`] : [];
  });
  return html`<p class="remarks muted" role="status">${edges.length > 0 ? `Edges so far: ${edges.join(", ")}` : ""}</p>`;
}

/** @param {{onMade: (degrees: number) => void}} props */
function Making({ onMade }) {
  const [picked, setPicked] = useState(/** @type {number | null} */ (null));
  const [name, setName] = useState("");
  const [busy, setBusy] = useState(false);
  const [problem, setProblem] = useState(/** @type {string | null} */ (null));
  const known = [...classes.value.values()];
  const usual = selectedBox.value?.class_id ?? known[0]?.id ?? null;
  const classId = picked !== null && classes.value.has(picked) ? picked : usual;
  const ready = points.value;

  const make = async () => {
    if (ready === null) return;
    setBusy(true);
    setProblem(null);
    try {
      const id = classId ?? (await actions.addClass(name.trim())).id;
      onMade(await actions.boxFromPoints(id, ready));
    } catch (error) {
      setProblem(/** @type {Error} */ (error).message);
      setBusy(false);
    }
  };
  const color = classId === null ? "transparent" : (classes.value.get(classId)?.color ?? "transparent");
  return html`<form class="making" onSubmit=${(/** @type {Event} */ event) => {
    event.preventDefault();
    void make();
  }}>
    <label class="row">
      <span class="swatch" style=${{ background: color }}></span>
      ${known.length > 0
        ? html`<select class="field" aria-label="Class of the box" value=${classId} onChange=${(/** @type {any} */ event) => setPicked(Number(event.currentTarget.value))}>
            ${known.map((one) => html`<option key=${one.id} value=${one.id} selected=${one.id === classId}>${one.name}</option>`)}
          </select>`
        : html`<input
            class="field" aria-label="Name of the box's class" placeholder="Name a class" maxlength="200" value=${name}
            onInput=${(/** @type {any} */ event) => setName(event.currentTarget.value)}
          />`}
    </label>
    <button type="submit" class="button main" disabled=${busy || ready === null || (classId === null && name.trim() === "")}>Make box</button>
    <button type="button" class="button quiet" disabled=${!begun.value || busy} onClick=${startOver}>Start over</button>
    ${problem !== null && html`<p class="problem" role="alert">${problem}</p>`}
  </form>`;
}
