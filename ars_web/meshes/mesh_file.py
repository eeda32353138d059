"""Meshes from obj, ply, glb and stl files of strangers. No other file is opened, and nothing is fetched."""

import re
import struct
import warnings
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from ars_web.errors import BadFile, BadInput
from ars_web.geometry.mesh_repair import repaired
from ars_web.meshes.glb import check_glb
from ars_web.meshes.placement import METRES, checked_origin, checked_unit, rotation_from_axes, unit_fault

FORMATS = ("obj", "ply", "glb", "stl")

MOST_BYTES = 128 << 20
MOST_FACES = 200_000

FARTHEST = 100.0
"""Metres, of a corner from the box's centre along each of its axes."""

# All that trimesh, and reading structures of numbers as such, raises for files that are not what they say.
_FAULTS = (
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    ArithmeticError,
    AssertionError,
    MemoryError,
    RuntimeError,
    OSError,
    EOFError,
    BufferError,
    struct.error,
    re.error,
)


class MeshFile(NamedTuple):
    """A mesh as a file holds it.

    Attributes:
        vertices: (v, 3) metres along the box's axes, origin at its centre.
        faces: (f, 3) rows of `vertices`, counter-clockwise seen from outside; closed, as `geometry.mesh.Mesh` needs it.
        notes: what was changed, in sentences.
    """

    vertices: Float[np.ndarray, "v 3"]
    faces: Int[np.ndarray, "f 3"]
    notes: tuple[str, ...]


def read_mesh_file(source: Path | bytes, *, name: str, unit: str, axes: str, origin: str = "centre") -> MeshFile:
    """The mesh in a file, or in its bytes; `name` is what people call it, and says its format by its ending.

    `unit` is that of its numbers: mm, cm, m or in; `axes` says which of its axes run along the box's x, y and z, such
    as `x,-z,y`. `origin`: the `centre` of the mesh's bounds lies at the box's centre, or the `file`'s own origin does.
    A surface that ends somewhere is made closed by a back to every face, which a note tells.

    Raises:
        BadInput: unit, axes or origin say nothing that can be.
        BadFile: it is no mesh, is damaged or too large, has no faces or numbers that are not finite, needs other
            files, or its size says that the unit is mistaken.
    """
    metres, rotation = METRES[checked_unit(unit)], rotation_from_axes(axes)
    centred = checked_origin(origin) == "centre"
    kind = Path(name).suffix.lower().removeprefix(".")
    if kind == "gltf":
        raise BadFile(name, "keeps its shape in other files, which are not opened: export it as one glb file")
    if kind not in FORMATS:
        raise BadFile(name, f"is none of the formats that are read; save it as one of {', '.join(FORMATS)}")
    data = source if isinstance(source, bytes) else _read(source, name)
    if len(data) > MOST_BYTES:
        raise BadFile(name, f"has {len(data)} bytes; at most {MOST_BYTES} are read: simplify it")
    points_file, faces = _loaded(data, kind, name)
    if len(faces) == 0:
        raise BadFile(name, "has no faces: it holds points or lines only, or nothing; export a surface of triangles")
    if faces.min() < 0 or faces.max() >= len(points_file):
        raise BadFile(name, f"is damaged: a face has a corner that is not there ({len(points_file)} are)")
    used = points_file[np.unique(faces)]
    if not np.isfinite(used).all():
        raise BadFile(name, f"has a corner that is not finite: {used[~np.isfinite(used).all(axis=1)][0].tolist()}")
    low, high = used.min(axis=0), used.max(axis=0)
    fault = unit_fault((high - low) * metres, checked_unit(unit))
    if fault is not None:
        raise BadFile(name, fault)
    points = (points_file - (low + high) / 2 if centred else points_file) @ rotation.T * metres
    if not (np.abs(points[np.unique(faces)]) <= FARTHEST).all():
        raise BadFile(name, f"lies over {FARTHEST:g} m from its own origin: use the origin `centre` instead of `file`")
    # As they are kept: what is one corner then is one here.
    with np.errstate(over="ignore"):  # of corners that no face has
        points = points.astype(np.float32).astype(np.float64)
    mesh = repaired(points, faces)
    if len(mesh.faces) == 0:
        raise BadFile(name, "has no faces with an area: all of them are points or lines")
    if len(mesh.faces) > MOST_FACES:
        backs = ", with a back to each as it is not closed" if mesh.open_edges else ""
        raise BadFile(name, f"has {len(mesh.faces)} faces{backs}; at most {MOST_FACES} can be used: simplify it")
    return MeshFile(mesh.vertices, mesh.faces, _notes(mesh.dropped, mesh.turned, mesh.open_edges))


def _read(path: Path, name: str) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(MOST_BYTES + 1)
    except OSError as error:
        raise BadFile(name, f"cannot be read: {error.strerror}") from error


def _loaded(data: bytes, kind: str, name: str) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """Corners and faces as the file has them, in its own unit and axes."""
    # trimesh takes half a second to load, which commands that read no mesh need not wait for.
    import trimesh

    try:
        with warnings.catch_warnings():
            # Of numpy, for text that is no numbers: what is missing then is found out below.
            warnings.simplefilter("ignore")
            _check(data, kind)
            # A stream has no place, so nothing beside it can be found; materials could only be there.
            loaded = trimesh.load_scene(
                BytesIO(data), file_type=kind, resolver=None, skip_materials=True, process=False
            )
            mesh = loaded.to_mesh()
            points, faces = np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces, dtype=np.int64)
    except BadInput as error:
        raise BadFile(name, str(error)) from error
    except _FAULTS as error:
        said = " ".join(str(error).split())[:120]
        raise BadFile(
            name,
            f"is no {kind} file that can be read, or a damaged one ({said or type(error).__name__}); export it anew",
        ) from error
    return points.reshape(-1, 3), faces.reshape(-1, 3)


def _check(data: bytes, kind: str) -> None:
    """What a file says of itself, looked at before it is read: whether it is whole, and not too large."""
    if kind == "glb":
        check_glb(data, most_faces=MOST_FACES)
    elif kind == "ply":
        _check_ply(data)
    elif kind == "obj":
        _refuse_many(len(re.findall(rb"^\s*f\s", data, flags=re.MULTILINE)))
    elif len(data) >= 84 and len(data) == 84 + 50 * struct.unpack_from("<I", data, 80)[0]:
        _refuse_many((len(data) - 84) // 50)
    elif data.lstrip()[:5].lower() != b"solid":
        said = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else 0
        raise BadInput(f"is no stl file, or is cut short: {len(data)} bytes cannot hold {said} faces")
    else:
        if b"endsolid" not in data[-1000:].lower():
            raise BadInput("is cut short: its last line is not endsolid")
        _refuse_many(data.lower().count(b"endfacet"))


def _check_ply(data: bytes) -> None:
    head, ended, body = data.partition(b"end_header")
    if not head.startswith(b"ply") or not ended:
        raise BadInput("is no ply file: it has no header that ends")
    counts = {kind.decode(): int(count) for kind, count in re.findall(rb"^element\s+(\S+)\s+(\d+)", head, re.MULTILINE)}
    _refuse_many(counts.get("face", 0))
    _refuse_many(counts.get("vertex", 0) // 3)
    if b"format ascii" in head:
        lines = sum(1 for line in body.splitlines() if line.strip())
        if lines < sum(counts.values()):
            raise BadInput(f"is cut short: it has {lines} lines of numbers of {sum(counts.values())}")


def _refuse_many(faces: int) -> None:
    if faces > MOST_FACES:
        raise BadInput(f"has {faces} faces; at most {MOST_FACES} can be used: simplify it")


def _notes(dropped: int, turned: int, open_edges: int) -> tuple[str, ...]:
    said = (
        (dropped, f"{dropped} faces without an area, or that were there twice, were left out"),
        (turned, f"{turned} faces were turned round, so that all of them face outward"),
        (open_edges, f"the surface has {open_edges} open edges: it is seen from both sides"),
    )
    return tuple(text for count, text in said if count)
