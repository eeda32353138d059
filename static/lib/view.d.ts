import type { VNode } from "preact";

export { Fragment, createRef, h, render } from "preact";
export type { ComponentChildren, RefObject, VNode } from "preact";
export { useCallback, useEffect, useId, useLayoutEffect, useMemo, useRef, useState } from "preact/hooks";
export { batch, computed, effect, signal, untracked, useComputed, useSignal, useSignalEffect } from "@preact/signals";
export type { ReadonlySignal, Signal } from "@preact/signals";

/** A tagged template of markup; what is put into it is text, never markup. */
export function html(strings: TemplateStringsArray, ...values: unknown[]): VNode;
