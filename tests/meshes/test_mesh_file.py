"""Mesh files of every format come in with the place and size that they mean; what is none is refused by name."""

import json
import socket
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from ars_web.errors import BadFile, BadInput
from ars_web.geometry.mesh import Mesh
from ars_web.meshes import mesh_file
from ars_web.meshes.mesh_file import MOST_FACES, MeshFile, read_mesh_file
from ars_web.sessions import object_mesh
from ars_web.sessions.object_mesh import MESH_ORIGINS, MESH_UNITS

CORNERS = np.array([[0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 10.0]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def written(kind: str, *, corners: np.ndarray = CORNERS, faces: np.ndarray = FACES, **options: object) -> bytes:
    """A mesh as trimesh writes it."""
    mesh = trimesh.Trimesh(corners, faces, process=False)
    data = mesh.export(file_type=kind, **options)
    return data.encode() if isinstance(data, str) else data


FILES: dict[str, Callable[[], bytes]] = {
    "a.obj": lambda: written("obj"),
    "a.ply": lambda: written("ply"),
    "ascii.ply": lambda: written("ply", encoding="ascii"),
    "a.glb": lambda: written("glb"),
    "A.STL": lambda: written("stl"),
    "ascii.stl": lambda: written("stl_ascii"),
}


def read(data: bytes, name: str, **more: str) -> MeshFile:
    return read_mesh_file(data, name=name, **{"unit": "mm", "axes": "x,y,z", "origin": "file", **more})


def triangles(vertices: np.ndarray, faces: np.ndarray) -> list[list[list[float]]]:
    return sorted(np.roll(t, -int(np.lexsort(t.T[::-1])[0]), axis=0).round(6).tolist() for t in vertices[faces])


@pytest.mark.parametrize("name", FILES)
def test_each_format_gives_the_same_mesh(name: str, tmp_path: Path):
    data = FILES[name]()
    vertices, faces, notes = read(data, name)
    assert triangles(vertices, faces) == triangles(CORNERS / 1000, FACES)
    assert (len(vertices), notes) == (4, ())
    (tmp_path / name).write_bytes(data)
    again = read_mesh_file(tmp_path / name, name=name, unit="mm", axes="x,y,z", origin="file")
    assert np.array_equal(again.vertices, vertices)


@pytest.mark.parametrize(("unit", "metres"), [("mm", 0.04), ("cm", 0.4), ("in", 1.016), ("m", 40.0)])
def test_the_unit_says_how_large_it_is(unit: str, metres: float):
    if unit == "m":
        with pytest.raises(
            BadFile, match=r"^a.ply: the object would be 40 m long in unit m .*: is it in mm or cm or in\?"
        ):
            read(FILES["a.ply"](), "a.ply", unit=unit)
        return
    assert np.ptp(read(FILES["a.ply"](), "a.ply", unit=unit).vertices[:, 0]) == pytest.approx(metres)


def test_a_unit_that_makes_it_tiny_is_refused_too():
    small = written("ply", corners=CORNERS / 100)
    with pytest.raises(BadFile, match=r"a.ply: the object would be 0.4 mm long in unit mm .* is it in m or in\?"):
        read(small, "a.ply")
    assert np.ptp(read(small, "a.ply", unit="m").vertices[:, 0]) == pytest.approx(0.4)
    huge = written("ply", corners=CORNERS * 1e6)
    with pytest.raises(BadFile, match=r"4e[+]04 m long in unit mm .* scale it to the object's true size"):
        read(huge, "a.ply")


def test_the_axes_say_which_way_it_lies():
    # Y up, as glb files are: the box's z is the file's y.
    vertices, faces, _ = read(FILES["a.glb"](), "a.glb", axes=" x, -z ,y")
    assert_allclose(vertices.min(axis=0), [0.0, -0.01, 0.0])
    assert_allclose(vertices.max(axis=0), [0.04, 0.0, 0.02], rtol=1e-6)
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    assert (np.cross(a, b) * c).sum() > 0  # it is not mirrored


def test_the_origin_is_the_middle_of_its_bounds_or_the_files_own():
    vertices, _, _ = read(FILES["a.obj"](), "a.obj", origin="centre", axes="y,z,x")
    assert_allclose(vertices.min(axis=0), [-0.01, -0.005, -0.02], rtol=1e-6)
    assert_allclose(vertices.max(axis=0), [0.01, 0.005, 0.02], rtol=1e-6)
    far = written("ply", corners=CORNERS / 1000 + [4000.0, 0.0, 0.0])
    with pytest.raises(BadFile, match=r"a.ply: lies over 100 m from its own origin: use the origin `centre`"):
        read(far, "a.ply", unit="m")
    assert_allclose(read(far, "a.ply", unit="m", origin="centre").vertices[:, 0].max(), 0.02, atol=1e-3)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"unit": "ft"}, "unit must be one of mm, cm, m, in, not 'ft'"),
        ({"unit": ""}, "unit must be one of"),
        ({"axes": "x,y"}, "which axis of the file runs along the box's x, y and z.*not 'x,y'"),
        ({"axes": "x,x,z"}, "each once"),
        ({"axes": "+x,y,z"}, "each once"),
        ({"axes": "x,z,y"}, "'x,z,y' would mirror the object.* -x,z,y, for one, are not"),
        ({"axes": "-x,y,z"}, "mirror the object.* x,y,z, for one, are not"),
        ({"origin": "top"}, "origin must be one of centre, file, not 'top'"),
    ],
)
def test_unit_axes_and_origin_are_never_guessed(wrong: dict[str, str], message: str):
    with pytest.raises(BadInput, match=message):
        read(FILES["a.obj"](), "a.obj", **wrong)


def test_an_open_surface_and_faces_that_are_turned_are_told_of():
    _, faces, notes = read(written("ply", faces=FACES[:3]), "a.ply")
    assert notes == ("the surface has 3 open edges: it is seen from both sides",)
    assert len(faces) == 6
    wound = np.concatenate([FACES[:1, ::-1], FACES[1:], [[1, 1, 2]]])
    vertices, faces, notes = read(written("ply", faces=wound), "a.ply")
    assert notes == (
        "1 faces without an area, or that were there twice, were left out",
        "1 faces were turned round, so that all of them face outward",
    )
    assert triangles(vertices, faces) == triangles(CORNERS / 1000, FACES)


def test_parts_of_a_scene_are_where_its_nodes_put_them():
    scene = trimesh.Scene()
    for x in (0.0, 100.0):
        T = np.eye(4)
        T[0, 3] = x
        scene.add_geometry(trimesh.Trimesh(CORNERS, FACES, process=False), transform=T, geom_name="one")
    vertices, faces, _ = read(scene.export(file_type="glb"), "a.glb")
    assert (len(vertices), len(faces)) == (8, 8)
    assert np.ptp(vertices[:, 0]) == pytest.approx(0.14)


NAN = np.where(CORNERS == 40.0, np.nan, CORNERS)


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.step", b"ISO-10303-21;", "none of the formats that are read; save it as one of obj, ply, glb, stl"),
        ("mesh", b"", "none of the formats"),
        ("a.gltf", b"{}", "in other files, which are not opened: export it as one glb"),
        ("a.obj", b"", "has no faces"),
        ("a.obj", b"hello there\n", "has no faces"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "has no faces: it holds points or lines only"),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "damaged"),
        ("a.obj", b"v 0 0 0\nv 40 0 0\nv 0 1 0\nf 1 2 2\n", "no faces with an area"),
        ("a.ply", b"hello there", "is no ply file: it has no header"),
        ("a.ply", written("ply")[:-20], "damaged one .*; export it anew"),
        ("a.ply", written("ply", encoding="ascii")[:-20], r"is cut short: it has \d lines of numbers of 8"),
        ("a.ply", written("ply", corners=NAN), r"a corner that is not finite: \[nan, 0.0, 0.0\]"),
        ("a.obj", b"v 0 0 0\nv inf 0 0\nv 0 1 0\nf 1 2 3\n", "a corner that is not finite"),
        ("a.stl", b"hello there", "is no stl file"),
        ("a.stl", b"", "is no stl file"),
        ("a.stl", written("stl")[:-1], "is cut short: 283 bytes cannot hold 4 faces"),
        ("a.stl", written("stl_ascii")[:-30], "is cut short: its last line is not endsolid"),
        ("a.stl", b"\0" * 84, "has no faces"),
        ("a.glb", b"hello there, this is text", "no binary glTF 2.0"),
        ("a.glb", b"", "damaged"),
        ("a.glb", written("glb")[:-1], "is cut short: it has .* bytes of"),
        ("a.glb", written("glb", corners=NAN), "a corner that is not finite"),
    ],
)
def test_what_is_no_mesh_is_refused_by_the_files_name(name: str, data: bytes, message: str):
    with pytest.raises(BadFile, match=message) as refused:
        read(data, name)
    assert str(refused.value).startswith(f"{name}: ")


def test_too_many_faces_are_refused_before_they_are_read():
    many = np.tile(FACES, (MOST_FACES // 4 + 1, 1))
    for name in ("a.stl", "a.ply", "a.glb"):
        with pytest.raises(BadFile, match=f"has {len(many)} faces; at most {MOST_FACES} can be used: simplify it"):
            read(written(name[2:], faces=many), name)
    with pytest.raises(BadFile, match="at most 200000 can be used"):
        read(b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + b"f 1 2 3\n" * (MOST_FACES + 1), "a.obj")


def test_an_open_surface_must_have_room_for_its_backs(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(mesh_file, "MOST_FACES", 5)
    with pytest.raises(BadFile, match="has 6 faces, with a back to each as it is not closed; at most 5"):
        read(written("ply", faces=FACES[:3]), "a.ply")


def test_what_a_session_keeps_is_what_is_read():
    assert (object_mesh.MOST_FACES, object_mesh.FARTHEST) == (MOST_FACES, mesh_file.FARTHEST)
    assert tuple(mesh_file.METRES) == MESH_UNITS
    assert MESH_ORIGINS == ("centre", "file")
    with pytest.raises(BadFile, match=r"there.stl: cannot be read: No such file"):
        read_mesh_file(Path("nowhere/there.stl"), name="there.stl", unit="mm", axes="x,y,z")


def glb_with(change: Callable[[dict[str, object]], object], *, data: bytes | None = None) -> bytes:
    """A glb whose JSON was changed."""
    whole = written("glb") if data is None else data
    size = struct.unpack_from("<I", whole, 12)[0]
    header = json.loads(whole[20 : 20 + size])
    change(header)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    rest = whole[20 + size :]
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON") + text + rest


def many_nodes(header: dict[str, object]) -> None:
    header["nodes"] = [{"mesh": 0}] * 9_000
    header["meshes"][0]["primitives"] *= 9


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda h: h["buffers"][0].update(uri="shape.bin"), "in another file, 'shape.bin'.* one glb"),
        (lambda h: h["buffers"][0].update(uri="http://127.0.0.1:9/shape.bin"), "in another file"),
        (lambda h: h["buffers"][0].update(uri="file:///etc/passwd"), "in another file"),
        (lambda h: h["accessors"][0].update(count=10**12), "more than 8000000 rows"),
        (lambda h: h["accessors"][0].update(count=-1), "holds '-1' where a whole number should be"),
        (lambda h: h["accessors"][0].update(count=1.5), "holds '1.5'"),
        (lambda h: h["accessors"][0].pop("bufferView"), "without compression"),
        (lambda h: h.update(extensionsRequired=["KHR_draco_mesh_compression"]), "compressed .KHR_draco"),
        (lambda h: h["accessors"].extend([h["accessors"][0]] * 10_000), "10002 accessors; at most 10000"),
        (many_nodes, "324000 faces; at most"),
        (lambda h: h["nodes"].append({"children": [0]}), "no tree"),
        (lambda h: h.update(nodes=[{"children": [0], "mesh": 0}]), "no tree"),
        (lambda h: h.update(meshes=[]), "damaged"),
        (lambda h: h.update(accessors=7), "damaged"),
        (lambda h: h["bufferViews"][0].update(byteLength=10**12), "damaged"),
        (lambda h: h["meshes"][0]["primitives"][0].update(mode=1), "has no faces"),
    ],
)
def test_a_glb_that_would_open_files_or_grow_is_refused(
    change: Callable[[dict[str, object]], object], message: str, no_network: None
):
    with pytest.raises(BadFile, match=message):
        read(glb_with(change), "a.glb")


@pytest.fixture
def no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("it went to the network")

    monkeypatch.setattr(socket, "socket", refuse)
    monkeypatch.setattr(socket, "create_connection", refuse)


def test_materials_of_an_obj_are_not_looked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, no_network: None):
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd picture.png\n")
    text = b"mtllib a.mtl\nusemtl m\n" + written("obj")
    (tmp_path / "a.obj").write_bytes(text)
    monkeypatch.chdir(tmp_path)
    opened: list[str] = []
    true_open = Path.open

    def watched(path: Path, *rest: object, **more: object) -> object:
        opened.append(path.name)
        return true_open(path, *rest, **more)

    def refuse(name: object, *_: object, **__: object) -> None:
        raise AssertionError(f"{name} was opened")

    monkeypatch.setattr(Path, "open", watched)
    monkeypatch.setattr("builtins.open", refuse)
    for source in (tmp_path / "a.obj", text):
        mesh = read_mesh_file(source, name="a.obj", unit="mm", axes="x,y,z")
        assert len(mesh.faces) == 4
    assert opened == ["a.obj"]
    data = b"ply\nformat ascii 1.0\ncomment TextureFile /etc/passwd\n" + written("ply", encoding="ascii")[21:]
    assert len(read(data, "a.ply").faces) == 4


@settings(max_examples=150, deadline=None)
@given(
    st.sampled_from(sorted(FILES)),
    st.lists(st.tuples(st.floats(0, 1), st.binary(min_size=1, max_size=4)), max_size=4),
    st.floats(0, 1),
    st.booleans(),
)
def test_damaged_files_are_refused_or_read(name: str, edits: list[tuple[float, bytes]], share: float, cut: bool):
    data = bytearray(FILES[name]())
    for place, said in edits:
        at = int(place * len(data))
        data[at : at + len(said)] = said
    damaged = bytes(data[: int(share * len(data))] if cut else data)
    try:
        vertices, faces, _ = read(damaged, name, origin="centre")
    except BadFile:
        return
    Mesh(vertices, faces)
