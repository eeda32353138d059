/** All boxes: what they are, how large, who is at them; select, rename, hide, lock. Long lists draw only what is seen. */

import { Icon } from "../lib/icon.js";
import { Menu } from "../lib/menu.js";
import { computed, html, useEffect, useLayoutEffect, useRef, useSignal } from "../lib/view.js";
import * as store from "../store.js";
import { boxMenu, classMenu } from "./box_menu.js";
import { BoxRow, DraftRow } from "./box_row.js";
import { NoBoxes } from "./new_box.js";

/** @typedef {import("../store.js").Box} Box */
/** An object in the list; `box` null: it is not made yet. @typedef {{id: number, class_id: number, name: string, box: Box | null}} Row */

/** Pixels, as in side_panel.css. */
const ROW = 30;
/** Rows drawn above and below what is seen. */
const SPARE = 6;
/** Above so many boxes, one looks for them by name. */
const MANY = 12;

/** The boxes, and after them the objects that are being outlined. @type {import("../lib/view.js").ReadonlySignal<Row[]>} */
const ordered = computed(() => {
  const boxes = [...store.shownBoxes.value.values()].sort((a, b) => a.id - b.id);
  const unmade = [...store.drafts.value];
  if (store.selected.value === store.NEW && store.newClass.value !== null) unmade.push({ id: store.NEW, class_id: store.newClass.value });
  return [
    ...boxes.map((box) => ({ id: box.id, class_id: box.class_id, name: box.name, box })),
    ...unmade.map(({ id, class_id }) => ({ id, class_id, name: store.classes.value.get(class_id)?.name ?? "object", box: null })),
  ];
});
/** Who else has a box selected, by its id. */
const visitors = computed(() => {
  /** @type {Map<number, import("../store.js").Person[]>} */
  const found = new Map();
  for (const person of store.people.value) {
    if (person.own || person.selected === null) continue;
    found.set(person.selected, [...(found.get(person.selected) ?? []), person]);
  }
  return found;
});

export function BoxesList() {
  const filter = useSignal("");
  const all = ordered.value;
  const problem = store.problems.value.get("boxes");
  const many = all.length > MANY;
  const wanted = filter.value.trim().toLowerCase();
  const rows = many && wanted !== "" ? all.filter((row) => matches(row, wanted)) : all;
  return html`<section class="panel-section boxes" aria-label="Boxes">
    ${problem !== undefined &&
    html`<p class="problem dismissible" role="alert">${problem}
      <button class="button link" onClick=${() => store.setProblem("boxes", null)}>Dismiss</button>
    </p>`}
    ${many &&
    html`<div class="filter"><${Icon} name="search" size=${14} /><input
      class="field" type="search" placeholder="Name or class" aria-label="Find boxes by name or class" value=${filter.value} spellcheck=${false}
      onInput=${(/** @type {any} */ event) => (filter.value = event.currentTarget.value)}
      onKeyDown=${(/** @type {KeyboardEvent} */ event) => event.key === "Escape" && (filter.value = "")}
    /></div>`}
    ${all.length === 0 ? html`<${NoBoxes} />` : html`<${Rows} rows=${rows} />`}
    ${many && rows.length === 0 && html`<p class="muted nothing" role="status">No box or class is called “${filter.value.trim()}”.</p>`}
    <${OtherProblems} />
  </section>`;
}

/** @param {Row} row @param {string} wanted lower case */
function matches(row, wanted) {
  const className = store.classes.value.get(row.class_id)?.name ?? "";
  return row.name.toLowerCase().includes(wanted) || className.toLowerCase().includes(wanted);
}

/** @param {{rows: Row[]}} props */
function Rows({ rows }) {
  const list = useRef(/** @type {HTMLElement | null} */ (null));
  const top = useSignal(0);
  const height = useSignal(0);
  const renaming = useSignal(/** @type {number | null} */ (null));
  const menu = useSignal(/** @type {{id: number, x: number, y: number, of: "box" | "class"} | null} */ (null));
  const at = rows.findIndex((row) => row.id === store.selected.value);

  useLayoutEffect(() => {
    const element = /** @type {HTMLElement} */ (list.current);
    const watch = new ResizeObserver(() => (height.value = element.clientHeight));
    watch.observe(element);
    height.value = element.clientHeight;
    return () => watch.disconnect();
  }, []);
  useEffect(() => {
    const element = list.current;
    if (element === null || at < 0) return;
    if (at * ROW < element.scrollTop) element.scrollTop = at * ROW;
    else if ((at + 1) * ROW > element.scrollTop + element.clientHeight) element.scrollTop = (at + 1) * ROW - element.clientHeight;
  }, [at, store.selected.value]);

  /** @param {number} index */
  const select = (index) => {
    if (rows.length > 0) store.actions.select(rows[Math.max(0, Math.min(rows.length - 1, index))].id);
  };
  const page = Math.max(1, Math.floor(height.value / ROW) - 1);
  /** @param {KeyboardEvent} event */
  const keys = (event) => {
    const to = {
      ArrowDown: at + 1, ArrowUp: at < 0 ? rows.length - 1 : at - 1, Home: 0, End: rows.length - 1,
      PageDown: at + page, PageUp: at - page, ArrowLeft: at, ArrowRight: at,
    }[event.key];
    if (to !== undefined && !event.ctrlKey && !event.metaKey && !event.altKey) {
      // Elsewhere these keys would move the box.
      event.preventDefault();
      event.stopPropagation();
      if (to !== at) select(to);
    } else if (event.key === "F2" && at >= 0 && rows[at].box !== null) {
      event.preventDefault();
      renaming.value = rows[at].id;
    } else if (event.key === "Enter" && at >= 0) {
      event.preventDefault();
      /** @type {HTMLElement | null} */ (document.querySelector(".numbers input"))?.focus();
    }
  };
  /** @param {MouseEvent} event */
  const openMenu = (event) => {
    const row = /** @type {HTMLElement} */ (event.target).closest("[data-box]");
    const box = (row === null ? rows[at] : rows.find((one) => one.id === Number(row.getAttribute("data-box"))))?.box;
    if (box === undefined || box === null) return;
    event.preventDefault();
    store.actions.select(box.id);
    // The menu key says no place, or that of the whole list.
    const place = (row ?? document.getElementById(rowId(box.id)))?.getBoundingClientRect();
    const byMouse = row !== null && event.clientX > 0;
    menu.value = { id: box.id, of: "box", x: byMouse ? event.clientX : (place?.left ?? 0) + 24, y: byMouse ? event.clientY : (place?.bottom ?? 0) };
  };

  const first = Math.max(0, Math.floor(top.value / ROW) - SPARE);
  const last = Math.min(rows.length, Math.ceil((top.value + height.value) / ROW) + SPARE);
  const open = menu.value;
  const menuBox = open === null ? undefined : store.boxes.value.get(open.id);
  return html`<div
      class="boxes-list" role="grid" aria-label="Boxes" aria-rowcount=${rows.length} tabindex="0" ref=${list}
      aria-activedescendant=${at >= first && at < last ? rowId(rows[at].id) : undefined}
      onScroll=${() => (top.value = list.current?.scrollTop ?? 0)} onKeyDown=${keys} onContextMenu=${openMenu}
    >
      <div class="rows" role="presentation" style=${{ height: `${rows.length * ROW}px` }}>
        ${rows.slice(first, last).map(
          (row, i) => html`<${row.box === null ? DraftRow : BoxRow}
            key=${row.id} id=${rowId(row.id)} box=${row.box} draft=${row} index=${first + i} offset=${(first + i) * ROW}
            visitors=${visitors.value.get(row.id)} renaming=${renaming.value === row.id}
            onRename=${(/** @type {boolean} */ begin) => {
              renaming.value = begin ? row.id : null;
              if (!begin) list.current?.focus();
            }}
          />`,
        )}
      </div>
    </div>
    ${open !== null && menuBox !== undefined &&
    html`<${Menu}
      key=${open.of} label=${open.of === "box" ? menuBox.name : `Class of ${menuBox.name}`} x=${open.x} y=${open.y}
      onClose=${() => (menu.value = null)}
      items=${open.of === "class"
        ? classMenu(menuBox)
        : boxMenu(menuBox, {
            rename: () => (renaming.value = menuBox.id),
            chooseClass: () => (menu.value = { ...open, of: "class" }),
          })}
    />`}`;
}

/** What is wrong with boxes that are not selected; that of the selected one is shown with its numbers. */
function OtherProblems() {
  const found = [...store.problems.value].flatMap(([place, text]) => {
    const box = place.startsWith("box:") ? store.boxes.value.get(Number(place.slice(4))) : undefined;
    return box === undefined || box.id === store.selected.value ? [] : [{ box, place, text }];
  });
  return html`${found.map(
    ({ box, place, text }) => html`<p class="problem dismissible" role="alert" key=${place}>${box.name}: ${text}
      <button class="button link" onClick=${() => store.setProblem(place, null)}>Dismiss</button>
    </p>`,
  )}`;
}

/** @param {number} id */
function rowId(id) {
  return `box-row-${id}`;
}
