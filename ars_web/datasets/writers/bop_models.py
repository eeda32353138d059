"""BOP's models: `obj_000001.ply`, `models_info.json`, and the tables that say which object is what.

Millimetres, in the box's frame: the origin is the box's centre. Models have flat faces, every triangle with corners
and normals of its own, so that renderers show edges as edges.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from jaxtyping import Float
from scipy.spatial import ConvexHull, QhullError

from ars_web.datasets.planned import PlannedClass, PlannedSession
from ars_web.datasets.writers.bop_objects import BopObject
from ars_web.datasets.writers.writer import Dataset
from ars_web.geometry.symmetry import Symmetry, rotations_of

_MM = 1000.0

_DIGITS = 6
"""Decimals of lengths in mm and of directions."""


def write_models(dataset: Dataset, objects: Sequence[BopObject], folder: Path) -> None:
    """`models/`, `objects.json` and `dataset_info.md` below the dataset's folder."""
    models = folder / "models"
    models.mkdir(parents=True, exist_ok=True)
    info: dict[str, Any] = {}
    for an_object in objects:
        (models / f"obj_{an_object.id:06d}.ply").write_text(_ply(an_object), encoding="ascii")
        info[str(an_object.id)] = model_info(an_object, dataset.classes[an_object.class_place].symmetry)
    _write_json(models / "models_info.json", info)
    table = {str(o.id): _entry(o, dataset.classes, dataset.sessions) for o in objects}
    _write_json(folder / "objects.json", table)
    (folder / "dataset_info.md").write_text(_description(dataset, objects), encoding="utf-8")


def model_info(an_object: BopObject, symmetry: Symmetry) -> dict[str, Any]:
    """The object's entry in `models_info.json`: its extent and diameter in mm, and its symmetries."""
    points = an_object.vertices_box * _MM
    low, size = points.min(axis=0), np.ptp(points, axis=0)
    found: dict[str, Any] = {"diameter": _rounded(diameter(points))}
    for i, axis in enumerate("xyz"):
        found[f"min_{axis}"], found[f"size_{axis}"] = _rounded(low[i]), _rounded(size[i])
    return found | symmetry_entries(symmetry)


def symmetry_entries(symmetry: Symmetry) -> dict[str, Any]:
    """What BOP says of a symmetry: 4 x 4 matrices, row by row, without the identity, and axes with a point on them;
    all of ours turn about the origin."""
    found: dict[str, Any] = {}
    turns = rotations_of(symmetry)[1:]
    if len(turns):
        matrices = np.tile(np.eye(4), (len(turns), 1, 1))
        matrices[:, :3, :3] = turns
        found["symmetries_discrete"] = [[_rounded(v, 9) for v in matrix.ravel()] for matrix in matrices]
    if symmetry.axis is not None:
        found["symmetries_continuous"] = [{"axis": list(symmetry.axis), "offset": [0, 0, 0]}]
    return found


def diameter(points: Float[np.ndarray, "v 3"]) -> float:
    """The largest distance between two of the points; those are corners of the convex hull."""
    try:
        corners = points[ConvexHull(points).vertices]
    except QhullError:
        corners = points
    # A block of rows at a time: a hull of many corners would need a matrix of all pairs.
    blocks = np.array_split(corners, max(1, len(corners) // 512))
    return max(float(np.linalg.norm(block[:, None] - corners, axis=2).max()) for block in blocks)


def _ply(an_object: BopObject) -> str:
    triangles = an_object.vertices_box[an_object.faces] * _MM
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(lengths > 0, normals / np.where(lengths > 0, lengths, 1.0), [0.0, 0.0, 1.0])
    rows = np.concatenate([triangles.reshape(-1, 3), np.repeat(normals, 3, axis=0)], axis=1)
    # Adding zero turns a negative zero, which rounding leaves, into one without a sign.
    rows = np.round(rows, _DIGITS) + 0.0
    lines = [" ".join(f"{value:.{_DIGITS}f}" for value in row) for row in rows.tolist()]
    faces = [f"3 {i} {i + 1} {i + 2}" for i in range(0, len(rows), 3)]
    head = [
        "ply",
        "format ascii 1.0",
        f"element vertex {len(rows)}",
        *(f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    return "\n".join([*head, *lines, *faces]) + "\n"


def _entry(an_object: BopObject, classes: Sequence[PlannedClass], sessions: Sequence[PlannedSession]) -> dict[str, Any]:
    return {
        "class": classes[an_object.class_place].name,
        "shape": an_object.shape,
        "size_mm": [_rounded(value * _MM) for value in an_object.size],
        "boxes": [
            {"session": sessions[s].id, "box_id": sessions[s].box_ids[b], "name": sessions[s].box_names[b]}
            for s, b in an_object.boxes
        ],
    }


def _description(dataset: Dataset, objects: Sequence[BopObject]) -> str:
    lines = [
        f"# {dataset.description}",
        "",
        "In the format of BOP (https://github.com/thodan/bop_toolkit, docs/bop_datasets_format.md). Scene N of each"
        " split is session N of the table. An image's number is unique in the dataset; `frames.txt` says where it"
        " came from. There is no depth: `px_count_valid` counts all pixels of the silhouette in the image.",
        "",
        "| object | class | drawn round | size in mm (x y z) | boxes |",
        "|---|---|---|---|---|",
    ]
    for o in objects:
        size = " x ".join(f"{value * _MM:.1f}" for value in o.size)
        name = _cell(dataset.class_names[o.class_place])
        lines.append(f"| {o.id} | {name} | {o.shape} | {size} | {len(o.boxes)} |")
    lines += ["", "| scene | session | name |", "|---|---|---|"]
    lines += [f"| {place:06d} | {s.id} | {_cell(s.name)} |" for place, s in enumerate(dataset.sessions)]
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    """`text` within a cell of a Markdown table: one line, its bars escaped."""
    return "".join(c if c.isprintable() else " " for c in text).replace("\\", "\\\\").replace("|", "\\|")


def _rounded(value: float, digits: int = _DIGITS) -> float:
    return round(float(value), digits) + 0.0


def _write_json(path: Path, content: dict[str, Any]) -> None:
    # One entry a line, as BOP's own files have it.
    lines = [b'  "%s": %s' % (key.encode(), orjson.dumps(value)) for key, value in content.items()]
    path.write_bytes(b"{\n" + b",\n".join(lines) + (b"\n}\n" if lines else b"}\n"))
