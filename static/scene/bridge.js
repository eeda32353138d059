/**
 * Runs in viser's page and joins it to the page around it: tells it of keys, zoom and the pointer, and in frame mode
 * locks the camera to the photo, zooms and pans without moving it, and fades the photo.
 *
 * What it says to the page around it, always to this origin:
 *   {ars: "ready"}
 *   {ars: "key", type: "keydown" | "keyup", key, code, ctrl, shift, alt, meta, repeat}
 *   {ars: "zoom", zoom}                      1 where the whole photo shows
 *   {ars: "pointer", x, y, buttons}          CSS pixels in the iframe, while a button is down and once when it is not
 * What it hears, from the page around it alone:
 *   {ars: "view", mode: "scene" | "frame", blend, dark}         blend: 0 no photo, 1 the photo as it is
 *   {ars: "names", boxes: [{id, name, color}]}                  written over the boxes; color: #rrggbb
 *   {ars: "numbers", at: [[x, y, z]]}                           1, 2, … written at points of the world
 *   {ars: "fit"}                                                zoom 1, as a double-click does here
 *   {ars: "zoom", by}                                           times that about the middle
 *   {ars: "show", box}                                          zoom to the box of this id, and stay with it from frame
 *                                                               to frame until it is zoomed or moved otherwise
 *
 * A classic script, since it has to hear keys before viser's own, deferred one.
 */
(() => {
  "use strict";

  /** @typedef {import("./viser_client").Viser} Viser */
  /** @typedef {import("./viser_client").Node} Node */
  /** @typedef {import("./viser_client").Controls} Controls */

  const PARTS = ["canvas", "camera", "cameraControl", "nodeRefFromName", "requestRender"];
  const PATIENCE = 30_000;
  const LARGEST_ZOOM = 20;
  const STILL = 4; // CSS pixels that a press may move and be a click
  const [PHOTO, SPHERE] = ["/photo", "/coverage/sphere"]; // as in scene/frame_view.py and scene/coverage_sphere.py
  /** Of a box: a cube of side 1 in its own coordinates. @param {number} id */
  const edgesOf = (id) => `/boxes/${id}/at/edges`; // as in scene/boxes.py
  const SHARE = 0.6; // of the window, that a box fills which is zoomed to
  const HANDLES = "/edit/handle/"; // as in scene/face_handles.py
  const BALL = 0.01; // their radius there, metres
  const HANDLE_PIXELS = 11; // radius of what takes the press; the dot is smaller, see bridge.css

  const view = { mode: "scene", blend: 1 };
  /** Zoom, and the middle of what is seen, in tangents of the angles right of and below the optical axis. */
  const window2d = { zoom: 1, x: 0, y: 0 };
  /** The camera's own field of view, and what it was set to last here. */
  const fov = { base: 0, set: 0 };
  let offset = "";
  /** The box that is stayed with, and from where it was last seen. @type {{box: number, from: string} | null} */
  let follows = null;
  /** @type {{controls: Controls, mouseButtons: Record<string, number>, touches: Record<string, number>} | null} */
  let locked = null;
  /** @type {{id: number, x: number, y: number, moving: boolean} | null} */
  let pan = null;
  let space = false;
  /** @type {{x: number, y: number, buttons: number} | null} */
  let pointer = null;

  /** @param {object} message */
  function tell(message) {
    if (window.parent !== window) window.parent.postMessage(message, location.origin);
  }

  /** viser's parts, once all are there. @returns {Viser | null} */
  function found() {
    const parts = /** @type {any} */ (window).__viserMutable;
    return parts && PARTS.every((part) => parts[part] != null) ? parts : null;
  }

  addEventListener("message", (event) => {
    if (event.origin !== location.origin || event.source !== window.parent || window.parent === window) return;
    const told = event.data;
    if (told === null || typeof told !== "object") return;
    if (told.ars === "fit") fit();
    if (told.ars === "zoom" && Number.isFinite(told.by) && told.by > 0) zoomAboutMiddle(told.by);
    if (told.ars === "show" && Number.isInteger(told.box) && view.mode === "frame") follows = { box: told.box, from: "" };
    if (told.ars === "numbers" && Array.isArray(told.at)) numberPoints(told.at);
    if (told.ars === "names" && Array.isArray(told.boxes)) nameBoxes(told.boxes);
    if (told.ars !== "view") return;
    if (told.mode === "scene" || told.mode === "frame") view.mode = told.mode;
    if (Number.isFinite(told.blend)) view.blend = Math.min(1, Math.max(0, told.blend));
    if (typeof told.dark === "boolean") document.documentElement.classList.toggle("ars-light", !told.dark);
  });

  // ---------------------------------------------------------------- a server that went away

  // viser tries to reach it again only while its own page has the focus, which mostly the page around it has.
  document.hasFocus = () => !document.hidden;
  document.addEventListener("visibilitychange", () => dispatchEvent(new Event(document.hidden ? "blur" : "focus")));

  /** What a browser does with these keys is not wanted: scroll, find, save, bookmark. */
  const OURS_WITH_CONTROL = new Set(["z", "y", "k", "d", "s", "home", "end"]);

  /** @param {KeyboardEvent} event */
  function hearKey(event) {
    const target = event.composedPath()[0];
    if (target instanceof HTMLElement && (target.isContentEditable || /^(INPUT|TEXTAREA|SELECT)$/.test(target.tagName))) return;
    if (["Shift", "Control", "Alt", "Meta"].includes(event.key)) return; // viser minds these itself
    const { type, key, code, ctrlKey: ctrl, shiftKey: shift, altKey: alt, metaKey: meta, repeat } = event;
    tell({ ars: "key", type, key, code, ctrl, shift, alt, meta, repeat });
    // The page has other meanings for the keys by which viser moves its camera and opens its palette.
    event.stopImmediatePropagation();
    const plain = !ctrl && !alt && !meta;
    if (plain ? !/^(Tab|F\d+)$/.test(key) : (ctrl || meta) && OURS_WITH_CONTROL.has(key.toLowerCase())) event.preventDefault();
    if (code === "Space") space = type === "keydown";
  }

  addEventListener("keydown", hearKey, true);
  addEventListener("keyup", hearKey, true);
  addEventListener("blur", () => (space = false));

  const half = () => Math.tan((fov.base * Math.PI) / 360);

  function fit() {
    follows = null;
    Object.assign(window2d, { zoom: 1, x: 0, y: 0 });
    tell({ ars: "zoom", zoom: 1 });
  }

  /** @param {number} factor */
  function zoomAboutMiddle(factor) {
    const viser = found();
    if (viser === null || view.mode !== "frame") return;
    zoomAbout(viser, viser.canvas.clientWidth / 2, viser.canvas.clientHeight / 2, factor);
  }

  /**
   * Between which tangents, right of and below the direction of view, a box is seen; null: partly behind the camera.
   * @param {Viser} viser @param {Node} edges the box's node of that name
   */
  function tangentsOf({ camera }, edges) {
    let unit = edges; // what is scaled to the box's size is in it
    edges.traverse((each) => void (each.material !== undefined && (unit = each)));
    unit.updateWorldMatrix(true, false);
    const [across, down] = [[], []].map(() => ({ least: Infinity, most: -Infinity }));
    for (const x of [-0.5, 0.5]) for (const y of [-0.5, 0.5]) for (const z of [-0.5, 0.5]) {
      const eye = camera.position.clone().set(x, y, z).applyMatrix4(unit.matrixWorld).applyMatrix4(camera.matrixWorldInverse);
      if (eye.z >= 0) return null;
      for (const [side, tangent] of /** @type {const} */ ([[across, -eye.x / eye.z], [down, eye.y / eye.z]])) {
        side.least = Math.min(side.least, tangent);
        side.most = Math.max(side.most, tangent);
      }
    }
    return { across, down };
  }

  /**
   * Put the box that is stayed with in the middle, whenever the camera or the window is another than before: not while
   * the box itself is moved.
   * @param {Viser} viser
   */
  function follow(viser) {
    const { camera, canvas, nodeRefFromName } = viser;
    const { clientWidth: width, clientHeight: height } = canvas;
    if (follows === null || width === 0 || height === 0) return;
    camera.updateWorldMatrix(true, false);
    const from = [...camera.matrixWorld.toArray(), fov.base, width, height].join();
    const node = nodeRefFromName[edgesOf(follows.box)];
    if (from === follows.from || node == null || !isVisible(node)) return;
    follows.from = from;
    const sides = tangentsOf(viser, node);
    if (sides === null) return;
    const { across, down } = sides;
    const fitting = Math.min((half() * width) / height / (across.most - across.least), half() / (down.most - down.least));
    window2d.zoom = Math.min(LARGEST_ZOOM, Math.max(1, 2 * SHARE * fitting));
    window2d.x = (across.least + across.most) / 2;
    window2d.y = (down.least + down.most) / 2;
    keepInside(width / height);
    tell({ ars: "zoom", zoom: window2d.zoom });
  }

  /**
   * Zoom so that what is under a point of the canvas stays there.
   * @param {Viser} viser @param {number} x @param {number} y @param {number} factor
   */
  function zoomAbout(viser, x, y, factor) {
    const { clientWidth: width, clientHeight: height } = viser.canvas;
    follows = null;
    const before = (2 * half()) / window2d.zoom / height;
    window2d.zoom = Math.min(LARGEST_ZOOM, Math.max(1, window2d.zoom * factor));
    const after = (2 * half()) / window2d.zoom / height;
    window2d.x += (x - width / 2) * (before - after);
    window2d.y += (y - height / 2) * (before - after);
    keepInside(width / height);
    tell({ ars: "zoom", zoom: window2d.zoom });
  }

  /** @param {Viser} viser @param {number} dx @param {number} dy CSS pixels */
  function panBy(viser, dx, dy) {
    const { clientWidth: width, clientHeight: height } = viser.canvas;
    follows = null;
    const tangent = (2 * half()) / window2d.zoom / height;
    window2d.x -= dx * tangent;
    window2d.y -= dy * tangent;
    keepInside(width / height);
  }

  /** Show nothing beyond what shows at zoom 1. @param {number} aspect */
  function keepInside(aspect) {
    const down = half() * (1 - 1 / window2d.zoom);
    window2d.x = Math.min(down * aspect, Math.max(-down * aspect, window2d.x));
    window2d.y = Math.min(down, Math.max(-down, window2d.y));
  }

  addEventListener(
    "wheel",
    (event) => {
      const viser = found();
      if (view.mode !== "frame" || viser === null) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      const lines = event.deltaMode === 1 ? 33 : event.deltaMode === 2 ? 400 : 1;
      const bounds = viser.canvas.getBoundingClientRect();
      // A pinch comes as a wheel with Control, in smaller steps.
      const steps = Math.min(400, Math.max(-400, event.deltaY * lines)) * (event.ctrlKey ? 5 : 1);
      zoomAbout(viser, event.clientX - bounds.x, event.clientY - bounds.y, Math.exp(-steps * 0.0018));
    },
    { capture: true, passive: false },
  );

  addEventListener(
    "pointerdown",
    (event) => {
      // viser calls it from a passive listener when a handle is pressed, where it does nothing but log an error.
      event.preventDefault = () => {};
      if (view.mode !== "frame" || pan !== null || event.button > 2) return;
      if (!(space && event.button === 0) && event.button === 0) return; // viser first: a handle, an arrow, a click
      beginPan(event);
      event.stopImmediatePropagation();
    },
    true,
  );

  addEventListener("pointerdown", (event) => {
    const viser = found();
    if (view.mode !== "frame" || viser === null || pan !== null || event.button !== 0) return;
    // Handles disable the camera's controls as they are pressed, arrows and rings take the pointer for themselves.
    if (viser.cameraControl.enabled && !viser.canvas.hasPointerCapture(event.pointerId)) beginPan(event);
  });

  /** @param {PointerEvent} event */
  function beginPan(event) {
    pan = { id: event.pointerId, x: event.clientX, y: event.clientY, moving: event.button !== 0 };
  }

  addEventListener(
    "pointermove",
    (event) => {
      if (event.buttons !== 0) pointer = { x: event.clientX, y: event.clientY, buttons: event.buttons };
      const viser = found();
      if (pan === null || viser === null || event.pointerId !== pan.id) return;
      const [dx, dy] = [event.clientX - pan.x, event.clientY - pan.y];
      if (!pan.moving && Math.hypot(dx, dy) < STILL) return;
      pan = { ...pan, x: event.clientX, y: event.clientY, moving: true };
      panBy(viser, dx, dy);
    },
    true,
  );

  /** @param {PointerEvent} event */
  function endPan(event) {
    if (pan?.id === event.pointerId) pan = null;
    pointer = { x: event.clientX, y: event.clientY, buttons: event.buttons };
  }
  addEventListener("pointerup", endPan, true);
  addEventListener("pointercancel", endPan, true);
  addEventListener("mousedown", (event) => view.mode === "frame" && event.button === 1 && event.preventDefault(), true);
  addEventListener("contextmenu", (event) => view.mode === "frame" && event.preventDefault(), true);
  addEventListener("dblclick", () => view.mode === "frame" && fit(), true);

  /** @param {Viser} viser */
  function lock(viser) {
    const controls = viser.cameraControl;
    if (view.mode === "frame" && locked?.controls !== controls) {
      unlock();
      locked = { controls, mouseButtons: { ...controls.mouseButtons }, touches: { ...controls.touches } };
      for (const button of Object.keys(controls.mouseButtons)) controls.mouseButtons[button] = 0;
      for (const touch of Object.keys(controls.touches)) controls.touches[touch] = 0;
    } else if (view.mode === "scene" && locked !== null) {
      unlock();
      fit();
    }
  }

  function unlock() {
    if (locked === null) return;
    Object.assign(locked.controls.mouseButtons, locked.mouseButtons);
    Object.assign(locked.controls.touches, locked.touches);
    locked = null;
  }

  /**
   * Narrow the view to what is zoomed to. The field of view is narrowed and the window on it shifted, rather than a
   * part of it cut out, so that what has a size on the screen keeps it: names, the gizmo, dots.
   * @param {Viser} viser
   */
  function aim(viser) {
    const { camera, canvas } = viser;
    if (camera.fov !== fov.set) fov.base = camera.fov; // the server has set another one
    const { clientWidth: width, clientHeight: height } = canvas;
    if (width === 0 || height === 0) return;
    follow(viser);
    keepInside(width / height);
    const tangent = half() / window2d.zoom;
    const wanted = window2d.zoom === 1 ? fov.base : (Math.atan(tangent) * 360) / Math.PI;
    const pixels = height / (2 * tangent);
    const next = window2d.zoom === 1 ? "" : [width, height, window2d.x * pixels, window2d.y * pixels].join();
    if (camera.fov === wanted && next === offset) return;
    fov.set = camera.fov = wanted;
    if (next === "") camera.clearViewOffset();
    else camera.setViewOffset(width, height, window2d.x * pixels, window2d.y * pixels, width, height);
    offset = next;
    camera.updateProjectionMatrix();
    viser.requestRender();
  }

  /** @param {Viser} viser */
  function fade(viser) {
    viser.nodeRefFromName[PHOTO]?.traverse(({ material }) => {
      if (material === undefined || material.opacity === view.blend) return;
      material.opacity = view.blend;
      viser.requestRender();
    });
  }

  /** Colours that mean numbers are shown as they are, not as a film would. @param {Viser} viser */
  function showTrueColours(viser) {
    viser.nodeRefFromName[SPHERE]?.traverse(({ material }) => {
      if (!material?.toneMapped) return;
      [material.toneMapped, material.needsUpdate] = [false, true];
      viser.requestRender();
    });
  }

  /** @type {Map<string, HTMLElement>} */
  const dots = new Map();

  /** Give the handles their size, and each a dot over everything. @param {Viser} viser */
  function dress(viser) {
    const { camera, canvas } = viser;
    const bounds = canvas.getBoundingClientRect();
    // After an interruption viser begins with an empty scene.
    for (const [name, dot] of dots) if (viser.nodeRefFromName[name] == null) dot.hidden = true;
    for (const [name, node] of Object.entries(viser.nodeRefFromName)) {
      if (!name.startsWith(HANDLES) || node == null) continue;
      const eye = camera.position.clone().setFromMatrixPosition(node.matrixWorld).applyMatrix4(camera.matrixWorldInverse);
      const depth = -eye.z;
      const shown = depth > 0 && isVisible(node);
      const dot = dots.get(name) ?? addDot(name);
      if (dot.hidden === shown) dot.hidden = !shown;
      if (!shown) continue;
      const scale = (HANDLE_PIXELS * depth * 2 * Math.tan((camera.fov * Math.PI) / 360)) / bounds.height / BALL;
      if (Math.abs(node.scale.x - scale) > 1e-3 * scale) {
        node.scale.setScalar(scale);
        viser.requestRender();
      }
      node.traverse(({ material }) => {
        if (material !== undefined) material.colorWrite = material.depthWrite = false; // the dot is what one sees
      });
      const at = eye.applyMatrix4(camera.projectionMatrix);
      dot.style.left = `${bounds.x + ((at.x + 1) / 2) * bounds.width}px`;
      dot.style.top = `${bounds.y + ((1 - at.y) / 2) * bounds.height}px`;
    }
  }

  /** @param {Node} node */
  function isVisible(node) {
    for (let each = /** @type {Node | null} */ (node); each !== null; each = each.parent) if (!each.visible) return false;
    return true;
  }

  /** @param {string} name */
  function addDot(name) {
    const dot = hiddenOver("ars-dot");
    document.body.append(dot);
    dots.set(name, dot);
    return dot;
  }

  /** Something that is to lie over the canvas, hidden at first. @param {string} kind */
  function hiddenOver(kind) {
    const over = document.createElement("div");
    over.className = kind;
    over.hidden = true;
    return over;
  }

  /** What is written over each box, by its id. @type {Map<number, HTMLElement>} */
  const names = new Map();

  /** @param {any[]} boxes */
  function nameBoxes(boxes) {
    const known = boxes.filter(({ id, name, color }) => Number.isInteger(id) && typeof name === "string" && /^#[0-9a-f]{6}$/i.test(color));
    const gone = new Set(names.keys());
    for (const { id, name, color } of known) {
      gone.delete(id);
      const chip = names.get(id) ?? hiddenOver("ars-name");
      names.set(id, chip);
      chip.textContent = name;
      chip.style.background = color;
      chip.style.color = isDark(color) ? "#ffffff" : "#0d1117";
    }
    for (const id of gone) {
      names.get(id)?.remove();
      names.delete(id);
    }
  }

  /** Whether white is read better than black on a colour: its relative luminance of WCAG 2. @param {string} color */
  function isDark(color) {
    const [red, green, blue] = [1, 3, 5].map((at) => (parseInt(color.slice(at, at + 2), 16) / 255) ** 2.2);
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue < 0.179;
  }

  /** Put each name over the top of its box, within the canvas. @param {Viser} viser */
  function placeNames(viser) {
    const { camera, canvas, nodeRefFromName } = viser;
    const { x: left, y: top, width, height } = canvas.getBoundingClientRect();
    const pixels = height / (2 * Math.tan((camera.fov * Math.PI) / 360));
    const shift = window2d.zoom === 1 ? { x: 0, y: 0 } : window2d;
    if (names.size > 0) camera.updateWorldMatrix(true, false);
    for (const [id, chip] of names) {
      const edges = nodeRefFromName[edgesOf(id)];
      const sides = edges == null || !isVisible(edges) ? null : tangentsOf(viser, edges);
      const x = sides === null ? NaN : width / 2 + ((sides.across.least + sides.across.most) / 2 - shift.x) * pixels;
      const [above, below] = sides === null ? [NaN, NaN] : [sides.down.least, sides.down.most].map((side) => height / 2 + (side - shift.y) * pixels);
      const shown = x > 0 && x < width && below > 0 && above < height;
      if (chip.hidden === shown) chip.hidden = !shown;
      if (!shown) continue;
      if (!chip.isConnected) document.body.append(chip); // names may be told before the page has a body
      // Over a box that begins above the canvas the name stays in sight.
      chip.style.transform = `translate(-50%, -100%) translate(${(left + x).toFixed(1)}px, ${(top + Math.max(24, above - 4)).toFixed(1)}px)`;
    }
  }

  /** What is written at points of the world: each its place in a list, from 1. @type {{point: [number, number, number], chip: HTMLElement}[]} */
  let numbers = [];

  /** @param {any[]} points */
  function numberPoints(points) {
    for (const { chip } of numbers) chip.remove();
    numbers = points
      .filter((point) => Array.isArray(point) && point.length === 3 && point.every(Number.isFinite))
      .map((point, i) => {
        const chip = hiddenOver("ars-number");
        chip.textContent = String(i + 1);
        document.body.append(chip);
        return { point, chip };
      });
  }

  /** @param {Viser} viser */
  function placeNumbers(viser) {
    const { camera, canvas, nodeRefFromName: { "": root } } = viser;
    if (numbers.length === 0 || root == null) return;
    const { x: left, y: top, width, height } = canvas.getBoundingClientRect();
    for (const node of [root, camera]) node.updateWorldMatrix(true, false);
    for (const { point, chip } of numbers) {
      const eye = camera.position.clone().set(...point).applyMatrix4(root.matrixWorld).applyMatrix4(camera.matrixWorldInverse);
      const ahead = eye.z < 0;
      const at = eye.applyMatrix4(camera.projectionMatrix);
      const shown = ahead && view.mode === "scene" && Math.abs(at.x) < 1 && Math.abs(at.y) < 1;
      if (chip.hidden === shown) chip.hidden = !shown;
      if (!shown) continue;
      const [x, y] = [left + ((at.x + 1) / 2) * width, top + ((1 - at.y) / 2) * height];
      chip.style.transform = `translate(-50%, -50%) translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
    }
  }

  const begun = performance.now();
  let announced = false;
  let complained = false;

  function eachFrame() {
    requestAnimationFrame(eachFrame);
    const viser = found();
    if (viser === null) {
      if (!announced && !complained && performance.now() - begun > PATIENCE) {
        complained = true;
        const there = /** @type {any} */ (window).__viserMutable ?? {};
        const missing = PARTS.filter((part) => there[part] == null).join(", ");
        console.error(`ARS Web: this is not viser 1.1.1, or WebGL is off: window.__viserMutable lacks ${missing}`);
      }
      return;
    }
    lock(viser);
    aim(viser);
    fade(viser);
    dress(viser);
    placeNames(viser);
    placeNumbers(viser);
    showTrueColours(viser);
    if (pointer !== null) {
      tell({ ars: "pointer", ...pointer });
      pointer = null;
    }
    if (!announced) {
      announced = true;
      tell({ ars: "ready" });
    }
  }
  requestAnimationFrame(eachFrame);
})();
