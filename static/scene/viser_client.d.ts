/** The parts that are used of `window.__viserMutable`, viser 1.1.1's handle for tests. */

export interface Vector {
  x: number;
  y: number;
  z: number;
  clone(): Vector;
  set(x: number, y: number, z: number): Vector;
  setFromMatrixPosition(matrix: unknown): Vector;
  applyMatrix4(matrix: unknown): Vector;
}

/** three.js's PerspectiveCamera; `fov` is vertical, in degrees. */
export interface Camera {
  fov: number;
  position: Vector;
  matrixWorld: { toArray(): number[] };
  matrixWorldInverse: unknown;
  updateWorldMatrix(parents: boolean, children: boolean): void;
  projectionMatrix: unknown;
  updateProjectionMatrix(): void;
  setViewOffset(fullWidth: number, fullHeight: number, x: number, y: number, width: number, height: number): void;
  clearViewOffset(): void;
}

export interface Material {
  opacity: number;
  toneMapped: boolean;
  needsUpdate: boolean;
  colorWrite: boolean;
  depthWrite: boolean;
}

export interface Node {
  visible: boolean;
  parent: Node | null;
  material?: Material;
  matrixWorld: unknown;
  updateWorldMatrix(parents: boolean, children: boolean): void;
  scale: { x: number; setScalar(scale: number): void };
  traverse(callback: (node: Node) => void): void;
}

export interface Controls {
  enabled: boolean;
  mouseButtons: Record<string, number>;
  touches: Record<string, number>;
}

export interface Viser {
  canvas: HTMLCanvasElement;
  camera: Camera;
  cameraControl: Controls;
  /** null: not there any more. */
  nodeRefFromName: Record<string, Node | null | undefined>;
  requestRender(): void;
}
