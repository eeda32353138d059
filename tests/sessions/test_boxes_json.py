"""Boxes as JSON: read strictly, written so that reading them gives the same box."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ars_web.errors import BadFile
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import Box
from ars_web.geometry.keypoints import Keypoint
from ars_web.geometry.symmetry import Symmetry
from ars_web.sessions.boxes_json import BoxJson, BoxPatchJson, box_json, class_json, read_boxes_file
from ars_web.sessions.editing import SessionEditor
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import HullOptions, ObjectClass, VirtualBox
from ars_web.sessions.object_mesh import SourcedMesh
from ars_web.sessions.store import SessionStore

GOOD = {"class_id": 0, "T_world_box": {"position": [0, 0.5, 1], "wxyz": [2, 0, 0, 0]}, "size": [1, 2, 3.5]}


def test_boxes_and_classes_are_written_as_the_contract_says(a_mesh: Callable[..., SourcedMesh]):
    T = rigid_transform.from_position_wxyz(np.array([1.0, 2.0, 3.0]), np.array([-0.5, 0.5, 0.5, 0.5]))
    written = box_json(VirtualBox(7, 1, "left", Box(T, np.array([0.1, 0.2, 0.3])), 12))
    assert list(written) == [
        "id",
        "class_id",
        "name",
        "T_world_box",
        "size",
        "has_hull",
        "hull_options",
        "has_mesh",
        "locked",
        "revision",
    ]
    assert written["locked"] is False
    assert written["T_world_box"]["position"] == [1.0, 2.0, 3.0]
    assert written["T_world_box"]["wxyz"] == pytest.approx([0.5, -0.5, -0.5, -0.5])
    assert (written["size"], written["has_hull"], written["revision"]) == ([0.1, 0.2, 0.3], False, 12)
    plain = ObjectClass(0, "cube", "#56b4e9", 3)
    written = {
        "id": 0,
        "name": "cube",
        "color": "#56b4e9",
        "default_size": None,
        "symmetry": {"kind": "none", "rotations": [], "axis": None, "flip": False},
        "keypoints": [],
        "mesh": None,
        "revision": 3,
    }
    assert class_json(plain, {}) == written
    sourced = a_mesh()
    shaped = replace(
        plain,
        mesh=sourced.mesh.digest,
        symmetry=Symmetry("continuous", axis=(0.0, 0.0, 1.0), flip=True),
        keypoints=(Keypoint("tip", (0.0, 0.0, 0.5)),),
    )
    round_its_z = {"kind": "continuous", "rotations": [], "axis": [0.0, 0.0, 1.0], "flip": True}
    tip = [{"name": "tip", "place": [0.0, 0.0, 0.5]}]
    expected = {**written, "symmetry": round_its_z, "keypoints": tip, "mesh": {"digest": shaped.mesh}}
    assert class_json(shaped, {}) == expected
    assert class_json(shaped, {sourced.mesh.digest: sourced})["mesh"] == {
        "digest": shaped.mesh,
        "vertices": 4,
        "faces": 4,
        "extent": [0.25, 0.5, 1.0],
        "source": {"name": "corner.stl", "unit": "mm", "axes": "x,-z,y", "origin": "centre"},
    }


numbers = st.floats(-1e6, 1e6)


@given(
    st.tuples(numbers, numbers, numbers),
    st.tuples(numbers, numbers, numbers, numbers).filter(lambda q: np.linalg.norm(q) > 1e-6),
)
def test_what_is_written_is_a_unit_quaternion_and_reads_as_the_same_place(
    position: tuple[float, ...], wxyz: tuple[float, ...]
):
    given_box = BoxJson.model_validate({**GOOD, "T_world_box": {"position": position, "wxyz": wxyz}})
    box = given_box.draft.box
    written = json.loads(json.dumps(box_json(VirtualBox(1, 0, "b", box, 1))))
    assert np.linalg.norm(written["T_world_box"]["wxyz"]) == pytest.approx(1, abs=1e-12)
    assert written["T_world_box"]["wxyz"][0] >= 0
    again = BoxJson.model_validate({key: written[key] for key in ("class_id", "T_world_box", "size")}).draft.box
    assert np.abs(again.T_world_box - box.T_world_box).max() < 1e-9


def test_a_files_boxes_are_what_the_api_answers(
    store: SessionStore,
    editor: SessionEditor,
    sid: str,
    a_box: Callable[..., Box],
    a_hull: Callable[..., HullMesh],
    tmp_path: Path,
):
    editor.add_box(sid, class_id=0, box=a_box(), name="left", author="me")
    editor.add_box(sid, class_id=0, box=a_box(1.0), author="me")
    editor.put_object(
        sid, box_id=None, class_id=0, box=a_box(2.0), hull=a_hull(), hull_options=HullOptions("free", widen=1.5),
        author="me",
    )  # fmt: skip
    listed = [box_json(box) for box in store.state(sid).boxes.values()]
    assert (listed[2]["has_hull"], listed[2]["hull_options"]) == (
        True, {"orientation": "free", "position": "box", "widen_px": 1.5, "ground": None, "fitted": False},
    )  # fmt: skip
    (tmp_path / "boxes.json").write_text(json.dumps(listed))
    drafts = read_boxes_file(tmp_path / "boxes.json")
    added = editor.add_boxes(sid, drafts, author="cli")
    assert [box.hull for box in added] == [None, None, None]
    for before, after in zip(listed, map(box_json, added), strict=True):
        assert after["T_world_box"]["position"] == before["T_world_box"]["position"]
        assert after["T_world_box"]["wxyz"] == pytest.approx(before["T_world_box"]["wxyz"], abs=1e-12)
        assert {k: after[k] for k in ("class_id", "name", "size")} == {
            k: before[k] for k in ("class_id", "name", "size")
        }


def test_a_byte_order_mark_and_missing_names_are_fine(tmp_path: Path):
    (tmp_path / "boxes.json").write_bytes(b"\xef\xbb\xbf" + json.dumps([GOOD]).encode())
    (draft,) = read_boxes_file(tmp_path / "boxes.json")
    assert (draft.class_id, draft.name, draft.box.size.tolist()) == (0, None, [1.0, 2.0, 3.5])
    assert np.array_equal(draft.box.T_world_box[:3, :3], np.eye(3))


def changed(**values: object) -> str:
    return json.dumps([GOOD, {**GOOD, **values}])


def placed(**values: object) -> str:
    return changed(T_world_box={"position": [0, 0, 0], "wxyz": [1, 0, 0, 0], **values})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "boxes.json:1: is not JSON"),
        ("[\n{]", "boxes.json:2: is not JSON"),
        ("{}", "must hold a list of boxes"),
        ("[[]]", "box 0: "),
        ("[" * 100_000, "is nested too deeply"),
        (changed(size=[1, 1]), r"box 1\.size\[2\]: Field required"),
        (changed(size=[1, 0, 1]), r"box 1\.size\[1\]: .* greater than 0, not 0"),
        (changed(size=[1, -1, 1]), r"box 1\.size\[1\]: .* greater than 0"),
        (changed(size=[1, 1e9, 1]), r"box 1\.size\[1\]: .* less than or equal to 10000"),
        (changed(size=[1, float("nan"), 1]), r"box 1\.size\[1\]: .* finite number, not nan"),
        (changed(size=[1, float("inf"), 1]), r"box 1\.size\[1\]: .* finite number, not inf"),
        (changed(size=[1, True, 1]), r"box 1\.size\[1\]: .* valid number, not True"),
        (changed(size=[1, "1", 1]), r"box 1\.size\[1\]: .* valid number"),
        (changed(size=None), r"box 1\.size: "),
        (changed(class_id=1.5), r"box 1\.class_id: .* valid integer"),
        (changed(class_id=-1), r"box 1\.class_id: .* greater than or equal to 0"),
        (changed(colour="red"), r"box 1\.colour: Extra inputs are not permitted"),
        (changed(name=""), r"box 1\.name: "),
        (changed(name="n" * 101), r"box 1\.name: "),
        (placed(wxyz=[0, 0, 0, 0]), r"box 1\.T_world_box\.wxyz: a quaternion must not be zero"),
        (placed(wxyz=[1e308, 1e308, 0, 0]), r"box 1\.T_world_box\.wxyz: .* too long"),
        (placed(wxyz=[1, 0, 0]), r"box 1\.T_world_box\.wxyz\[3\]: Field required"),
        (placed(position=[0, float("-inf"), 0]), r"box 1\.T_world_box\.position\[1\]: .* finite"),
        (changed(T_world_box=[0, 0, 0]), r"box 1\.T_world_box: "),
        (json.dumps([{"class_id": 0}]), r"and 1 more fault"),
        ('[{"class_id": 0, "class_id": 1}]', "'class_id' is given twice"),
    ],
)  # fmt: skip
def test_a_fault_in_a_file_is_found_and_named(tmp_path: Path, text: str, message: str):
    (tmp_path / "boxes.json").write_text(text)
    with pytest.raises(BadFile, match=message):
        read_boxes_file(tmp_path / "boxes.json")


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path):
    with pytest.raises(BadFile, match=r"boxes\.json: cannot be read: No such file"):
        read_boxes_file(tmp_path / "boxes.json")
    (tmp_path / "boxes.json").write_bytes(b"[\xff]")
    with pytest.raises(BadFile, match="not text in UTF-8"):
        read_boxes_file(tmp_path / "boxes.json")


def test_a_patch_says_only_what_changes():
    assert BoxPatchJson.model_validate({"size": [1, 2, 3]}).model_dump(exclude_unset=True) == {"size": (1.0, 2.0, 3.0)}
