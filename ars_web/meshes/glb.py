"""What a glb file says of itself, looked at before it is read: nothing outside it is needed, and it is no bomb."""

import json
import struct
from typing import Any, cast

from ars_web.errors import BadInput

MOST_NODES = 10_000
"""Of the scene, and as many meshes, accessors and views."""

MOST_NUMBERS = 8_000_000
"""Rows of all accessors together. Corners are listed several times: as places, normals and colours."""


def check_glb(data: bytes, *, most_faces: int) -> None:
    """Refuse a glb that names other files, is compressed, cut short or too large, or whose nodes are no tree.

    Raises:
        BadInput: it says which.
        KeyError, TypeError, ValueError, IndexError, AttributeError: what it says of itself is not what glTF has.
    """
    header = _header(data)
    for what in ("buffers", "images"):
        for item in header.get(what, []):
            uri = item.get("uri")
            # Images are not looked at, wherever they are.
            if what == "buffers" and uri is not None:
                raise BadInput(
                    f"its shape lies in another file, {str(uri)[:60]!r}: export it as one glb that holds all"
                )
    needed = set(header.get("extensionsRequired", []))
    packed = needed & {"KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"}
    if packed:
        raise BadInput(f"is compressed ({', '.join(sorted(packed))}): export it without compression")
    for what in ("nodes", "meshes", "accessors", "bufferViews"):
        if len(header.get(what, [])) > MOST_NODES:
            raise BadInput(f"has {len(header[what])} {what}; at most {MOST_NODES} are read: join its parts")
    accessors = header.get("accessors", [])
    for accessor in accessors:
        _whole(accessor["count"])
        if "bufferView" not in accessor or "sparse" in accessor:
            raise BadInput("has sparse or compressed accessors: export it without compression")
    if sum(accessor["count"] for accessor in accessors) > MOST_NUMBERS:
        raise BadInput(f"holds more than {MOST_NUMBERS} rows of numbers: simplify it")
    _check_tree(header)
    faces = [sum(_faces(part, accessors) for part in mesh["primitives"]) for mesh in header.get("meshes", [])]
    shown = sum(faces[_whole(node["mesh"])] for node in header.get("nodes", []) if "mesh" in node)
    if max(shown, *faces, 0) > most_faces:
        raise BadInput(f"has {max(shown, *faces)} faces; at most {most_faces} can be used: simplify it")


def _header(data: bytes) -> dict[str, Any]:
    magic, version, length = struct.unpack_from("<4sII", data)
    if magic != b"glTF" or version != 2:
        raise BadInput("is no binary glTF 2.0 file")
    if length != len(data):
        raise BadInput(f"is cut short: it has {len(data)} bytes of {length}")
    size, kind = struct.unpack_from("<I4s", data, 12)
    if kind != b"JSON" or 20 + size > len(data):
        raise BadInput("is no binary glTF 2.0 file: its first part is not JSON")
    header = json.loads(data[20 : 20 + size].decode())
    if not isinstance(header, dict):
        raise BadInput("is no binary glTF 2.0 file: its JSON is no object")
    return cast(dict[str, Any], header)


def _check_tree(header: dict[str, Any]) -> None:
    """Every node has one parent, or is a scene's: then they can be walked and end."""
    nodes = header.get("nodes", [])
    above: dict[int, int] = {}
    for i, node in enumerate(nodes):
        for child in node.get("children", []):
            if _whole(child) in above or child >= len(nodes):
                raise BadInput(f"its nodes are no tree: node {child} has two parents or is not there")
            above[child] = i
    for scene in header.get("scenes", []):
        for root in scene.get("nodes", []):
            if _whole(root) in above or root >= len(nodes):
                raise BadInput(f"its nodes are no tree: node {root} of a scene has a parent or is not there")


def _faces(part: dict[str, Any], accessors: list[dict[str, Any]]) -> int:
    rows = part["indices"] if "indices" in part else part["attributes"]["POSITION"]
    count = accessors[_whole(rows)]["count"]
    # 4: triangles, three rows a face; a strip has one more with each row.
    return count // 3 if part.get("mode", 4) == 4 else count


def _whole(number: Any) -> int:
    if isinstance(number, bool) or not isinstance(number, int) or number < 0:
        raise BadInput(f"holds {str(number)[:40]!r} where a whole number should be")
    return number
