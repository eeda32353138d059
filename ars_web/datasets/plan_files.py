"""An export's plan on disk, in the partial folder: all that a worker needs, without a database.

`plan.json` and `arrays.npz` hold what grows with the sessions, `columns/` what grows with their frames
(`plan_columns`), `digest` the plan's SHA-256. The digest is written last: a folder without it holds no whole plan.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from ars_web.datasets import plan_columns
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.planned import ExportPlan, PlannedClass, PlannedFrames, PlannedSession
from ars_web.geometry.box import Box, stack
from ars_web.geometry.camera import Camera
from ars_web.geometry.keypoints import Keypoint
from ars_web.geometry.mesh import Mesh
from ars_web.geometry.symmetry import Symmetry

_VERSION = 3
"""Of these files and of what a shard's folder holds; another version's partial folder is not resumed."""

FILES = ("plan.json", "arrays.npz", *plan_columns.FILES)
"""Of a plan, all but its digest."""


def digest_of(plan: ExportPlan) -> str:
    """The plan's SHA-256 in hex: over everything but where `out` is, so equal digests mean equal datasets."""
    digest = hashlib.sha256(_document(plan))
    for name, array in sorted((_arrays(plan) | _columns(plan)).items()):
        digest.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


def write_plan(plan: ExportPlan, folder: Path) -> None:
    """Write the plan into the folder, on the disk when this returns."""
    _write_synced(folder / "plan.json", _document(plan))
    plan_columns.write_columns(_columns(plan), folder)
    with (folder / "arrays.npz").open("wb") as file:
        np.savez(file, allow_pickle=False, **_arrays(plan))
        file.flush()
        os.fsync(file.fileno())
    _write_synced(folder / "digest", digest_of(plan).encode())


def read_digest(folder: Path) -> str | None:
    """The digest of the plan in the folder, None where there is no whole plan."""
    path = folder / "digest"
    return path.read_text() if path.is_file() else None


def read_plan(folder: Path, *, out: Path) -> ExportPlan:
    """The plan in the folder, for the dataset at `out`; its frames' columns stay there until they are looked at."""
    document: dict[str, Any] = json.loads((folder / "plan.json").read_bytes())
    with np.load(folder / "arrays.npz", allow_pickle=False) as arrays:
        boxes = [
            tuple(Box(T, size) for T, size in zip(arrays[f"Ts_world_box_{i}"], arrays[f"sizes_{i}"], strict=True))
            for i in range(len(document["sessions"]))
        ]
        meshes = [_meshes(arrays, i, len(boxes[i])) for i in range(len(boxes))]
    numbers, texts = plan_columns.read_columns(folder)
    sessions = tuple(
        PlannedSession(
            id=session["id"],
            name=session["name"],
            revision=session["revision"],
            cameras={int(i): _camera(values) for i, values in session["cameras"].items()},
            boxes=boxes[number],
            meshes=meshes[number],
            box_ids=tuple(session["box_ids"]),
            box_names=tuple(session["box_names"]),
            drawn_round=tuple(session["drawn_round"]),
            class_of_box=tuple(session["class_of_box"]),
        )
        for number, session in enumerate(document["sessions"])
    )
    return ExportPlan(
        out=out,
        format=document["format"],
        options=ExportOptions.model_validate(document["options"]),
        classes=tuple(_class(values) for values in document["classes"]),
        sessions=sessions,
        frames=PlannedFrames(**numbers, names=texts["names"], stems=texts["stems"], sources=texts["sources"]),
        shards=tuple((start, stop) for start, stop in document["shards"]),
        seconds_per_frame=document["seconds_per_frame"],
    )


def _document(plan: ExportPlan) -> bytes:
    return json.dumps(
        {
            "version": _VERSION,
            "format": plan.format,
            "options": plan.options.model_dump(mode="json"),
            "classes": [asdict(a_class) for a_class in plan.classes],
            "sessions": [
                {
                    "id": s.id,
                    "name": s.name,
                    "revision": s.revision,
                    "cameras": {str(i): asdict(camera) for i, camera in s.cameras.items()},
                    "box_ids": s.box_ids,
                    "box_names": s.box_names,
                    "drawn_round": s.drawn_round,
                    "class_of_box": s.class_of_box,
                }
                for s in plan.sessions
            ],
            "shards": plan.shards,
            "seconds_per_frame": plan.seconds_per_frame,
        }
    ).encode()


def _columns(plan: ExportPlan) -> dict[str, np.ndarray]:
    columns = {name: np.asarray(getattr(plan.frames, name)) for name in plan_columns.NUMBERS}
    for name in plan_columns.TEXTS:
        columns[name], columns[f"{name}_ends"] = plan_columns.text_arrays(getattr(plan.frames, name))
    return columns


def _arrays(plan: ExportPlan) -> dict[str, np.ndarray]:
    arrays: dict[str, np.ndarray] = {}
    for number, session in enumerate(plan.sessions):
        Ts, sizes = stack(list(session.boxes))
        arrays |= {f"Ts_world_box_{number}": Ts, f"sizes_{number}": sizes}
        meshes = [mesh for mesh in session.meshes if mesh is not None]
        if meshes:
            # A session whose labels are drawn round its boxes has none of these.
            counts = [
                (0, 0) if mesh is None else (len(mesh.vertices_world), len(mesh.faces)) for mesh in session.meshes
            ]
            arrays |= {
                f"mesh_counts_{number}": np.array(counts, dtype=np.int64),
                f"mesh_vertices_{number}": np.concatenate([mesh.vertices_world for mesh in meshes]),
                f"mesh_faces_{number}": np.concatenate([mesh.faces for mesh in meshes]),
            }
    return arrays


def _meshes(arrays: Mapping[str, np.ndarray], number: int, boxes: int) -> tuple[Mesh | None, ...]:
    """The meshes of a session's boxes, None for those without one."""
    if f"mesh_counts_{number}" not in arrays:
        return (None,) * boxes
    counts = arrays[f"mesh_counts_{number}"]
    ends = np.cumsum(counts, axis=0)[:-1]
    vertices = np.split(arrays[f"mesh_vertices_{number}"], ends[:, 0])
    faces = np.split(arrays[f"mesh_faces_{number}"], ends[:, 1])
    return tuple(Mesh(v, f) if len(f) else None for v, f in zip(vertices, faces, strict=True))


def _class(values: dict[str, Any]) -> PlannedClass:
    symmetry = values["symmetry"]
    rotations = tuple((tuple(axis), order) for axis, order in symmetry["rotations"])
    axis = None if symmetry["axis"] is None else tuple(symmetry["axis"])
    return PlannedClass(
        name=values["name"],
        keypoints=tuple(Keypoint(point["name"], tuple(point["place"])) for point in values["keypoints"]),
        symmetry=Symmetry(**symmetry | {"rotations": rotations, "axis": axis}),
    )


def _camera(values: dict[str, Any]) -> Camera:
    known: dict[str, Any] = values | {"distortion": tuple(values["distortion"])}
    return Camera(**known)


def _write_synced(path: Path, content: bytes) -> None:
    with path.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
