"""Shapes of objects over HTTP: symmetry and keypoints of classes, meshes and polygons."""

import struct
from typing import Any

import httpx
import numpy as np
import pytest

from ars_web.sessions.edits import differences, replay

CORNERS = np.array([[0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 10.0]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def an_stl(scale: float = 1.0, faces: np.ndarray = FACES) -> bytes:
    rows = [struct.pack("<12fH", 0, 0, 0, *(scale * CORNERS[face]).ravel(), 0) for face in faces]
    return b"\0" * 80 + struct.pack("<I", len(rows)) + b"".join(rows)


def put(
    client: httpx.Client, path: str, data: bytes, *, name: str = "brick.stl", revision: int = 0, **fields: str
) -> httpx.Response:
    return client.put(
        path,
        files={"file": (name, data)},
        data={"unit": "mm", "axes": "x,y,z", **fields},
        headers={"If-Match": f'"{revision}"'},
    )


def test_a_class_has_a_symmetry_and_keypoints(client: httpx.Client, sid: str) -> None:
    path = f"/api/sessions/{sid}/classes/0"
    quarter = {"kind": "discrete", "rotations": [{"axis": [0, 0, 2], "order": 4}]}
    changed = client.patch(path, json={"symmetry": quarter}, headers={"If-Match": '"0"'})
    assert (changed.status_code, changed.headers["etag"]) == (200, '"1"')
    assert changed.json()["symmetry"] == {
        "kind": "discrete",
        "rotations": [{"axis": [0.0, 0.0, 1.0], "order": 4}],
        "axis": None,
        "flip": False,
    }
    tip = [{"name": "tip", "place": [0.0, 0.0, 0.5]}, {"name": "handle", "place": [-0.5, 0.1, 0]}]
    changed = client.patch(path, json={"keypoints": tip}, headers={"If-Match": '"1"'}).json()
    assert (changed["keypoints"], changed["symmetry"]["kind"]) == (tip, "discrete")
    assert client.get(path).json() == changed
    # What was answered can be sent, and changes nothing.
    sent = {key: changed[key] for key in ("symmetry", "keypoints")}
    assert client.patch(path, json=sent, headers={"If-Match": '"2"'}).json()["revision"] == 2
    axis = {"kind": "continuous", "axis": [0, 0, 1], "flip": True}
    assert client.patch(path, json={"symmetry": axis}, headers={"If-Match": '"2"'}).json()["symmetry"]["flip"] is True
    bare = client.patch(path, json={"symmetry": None, "keypoints": None}, headers={"If-Match": '"3"'}).json()
    assert (bare["symmetry"]["kind"], bare["keypoints"], bare["revision"]) == ("none", [], 4)
    assert client.post(f"/api/sessions/{sid}/undo").status_code == 200
    assert client.get(path).json()["keypoints"] == tip
    last = client.get(f"/api/sessions/{sid}/history").json()["items"][0]
    assert last["changes"][0]["after"]["keypoints"] == tip


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ({"symmetry": {"kind": "discrete"}}, "at least one rotation"),
        ({"symmetry": {"kind": "round"}}, "symmetry.kind"),
        ({"symmetry": {"kind": "continuous", "axis": [0, 0, 0]}}, "must have a direction"),
        ({"symmetry": {"kind": "continuous", "axis": [0, 0, "1"]}}, "axis.2"),
        ({"symmetry": {"kind": "discrete", "rotations": [{"axis": [0, 0, 1], "order": 1}]}}, "order"),
        (
            {"symmetry": {"kind": "discrete", "rotations": [{"axis": [0, 0, 1], "order": n} for n in (7, 71)]}},
            "more than 72",
        ),
        ({"symmetry": "none"}, "symmetry"),
        ({"keypoints": [{"name": "a", "place": [0, 0, 0]}] * 2}, "two keypoints called 'a'"),
        ({"keypoints": [{"name": "a", "place": [0, 0, 3]}]}, "place.2"),
        ({"keypoints": [{"name": "a,b", "place": [0, 0, 0]}]}, "without a comma"),
        ({"keypoints": [{"name": f"k{i}", "place": [0, 0, 0]} for i in range(65)]}, "keypoints"),
        ({"mesh": None}, "unknown field"),
    ],
)
def test_shapes_that_cannot_be_are_refused(client: httpx.Client, sid: str, body: object, words: str) -> None:
    answer = client.patch(f"/api/sessions/{sid}/classes/0", json=body, headers={"If-Match": '"0"'})
    assert answer.status_code == 422
    assert words in answer.json()["detail"]
    assert client.get(f"/api/sessions/{sid}").json()["revision"] == 0


def test_a_class_is_given_a_mesh_and_loses_it(server, client: httpx.Client, sid: str) -> None:
    path = f"/api/sessions/{sid}/classes/0"
    given = put(client, f"{path}/mesh", an_stl(), axes="x,-z, y", name="folder\\brick.stl")
    assert (given.status_code, given.headers["etag"]) == (200, '"1"')
    answer = given.json()
    assert answer.pop("notes") == []
    mesh = answer["mesh"]
    assert (mesh["vertices"], mesh["faces"], mesh["extent"]) == (4, 4, pytest.approx([0.04, 0.01, 0.02]))
    assert mesh["source"] == {"name": "brick.stl", "unit": "mm", "axes": "x,-z,y", "origin": "centre"}
    assert answer["default_size"] == pytest.approx([0.04, 0.01, 0.02])
    assert client.get(path).json() == answer == client.get(f"/api/sessions/{sid}/classes").json()[0]
    whole = client.get(f"/api/sessions/{sid}/meshes/{mesh['digest']}").json()
    assert np.ptp(whole["vertices"], axis=0) == pytest.approx([0.04, 0.01, 0.02])
    assert (len(whole["faces"]), whole["source"]) == (4, mesh["source"])

    # The same again changes nothing, and another one leaves the size.
    again = put(client, f"{path}/mesh", an_stl(), axes="x,-z,y", revision=1, name="copy.stl")
    assert (again.json()["revision"], again.json()["mesh"]["digest"]) == (1, mesh["digest"])
    larger = put(client, f"{path}/mesh", an_stl(2.0, FACES[:3]), revision=1).json()
    assert larger["default_size"] == answer["default_size"]
    assert larger["notes"] == ["the surface has 3 open edges: it is seen from both sides"]
    fitted = put(client, f"{path}/mesh", an_stl(3.0), revision=2, fit_size="true").json()
    assert fitted["default_size"] == pytest.approx([0.12, 0.06, 0.03])
    kept = put(client, f"{path}/mesh", an_stl(4.0), revision=3, fit_size="false").json()
    assert kept["default_size"] == fitted["default_size"]

    assert client.delete(f"{path}/mesh").status_code == 428
    assert client.delete(f"{path}/mesh", headers={"If-Match": '"3"'}).status_code == 412
    bare = client.delete(f"{path}/mesh", headers={"If-Match": '"4"'})
    assert (bare.status_code, bare.headers["etag"], bare.json()["mesh"]) == (200, '"5"', None)
    client.post(f"/api/sessions/{sid}/undo")
    assert client.get(path).json()["mesh"] == kept["mesh"]
    stale = put(client, f"{path}/mesh", an_stl(5.0), revision=4)
    assert (stale.status_code, stale.json()["current"]["mesh"]) == (412, {"digest": kept["mesh"]["digest"]})
    store = server.services.store
    assert len(store.snapshot(sid).meshes) == 1
    edits = store.edits(sid)
    assert [edit.summary for edit in edits[:3]] == ["Give a mesh to class cube"] * 3
    assert edits[4].summary == "Take the mesh from class cube"
    assert edits[5].changes[0].after.mesh == kept["mesh"]["digest"]


def test_a_boxs_own_mesh_counts_before_its_classs(client: httpx.Client, sid: str, box_json: dict[str, Any]) -> None:
    client.post(f"/api/sessions/{sid}/boxes", json=box_json)
    path = f"/api/sessions/{sid}/boxes/1"
    assert client.get(path).json()["has_mesh"] is False
    assert client.get(f"{path}/mesh").status_code == 404
    of_class = put(client, f"/api/sessions/{sid}/classes/0/mesh", an_stl()).json()["mesh"]
    assert client.get(f"{path}/mesh").json() == of_class
    given = put(client, f"{path}/mesh", an_stl(2.0), revision=1, origin="file")
    assert (given.status_code, given.headers["etag"]) == (200, '"3"')
    assert (given.json()["has_mesh"], given.json()["notes"], given.json()["size"]) == (True, [], box_json["size"])
    own = given.json()["mesh"]
    assert (own["source"]["origin"], own["extent"]) == ("file", pytest.approx([0.08, 0.04, 0.02]))
    assert client.get(f"{path}/mesh").json() == own
    copy = client.post(f"{path}/duplicate").json()
    assert copy["has_mesh"] is True
    client.patch(path, json={"locked": True}, headers={"If-Match": '"3"'})
    refused = put(client, f"{path}/mesh", an_stl(3.0), revision=5)
    assert (refused.status_code, refused.json()["type"]) == (409, "urn:ars-web:problem:locked")
    assert "unlock it before its mesh can be changed" in refused.json()["detail"]
    assert client.delete(f"{path}/mesh", headers={"If-Match": '"5"'}).status_code == 409
    client.patch(path, json={"locked": False}, headers={"If-Match": '"5"'})
    bare = client.delete(f"{path}/mesh", headers={"If-Match": '"6"'})
    assert (bare.status_code, bare.json()["has_mesh"]) == (200, False)
    assert client.get(f"{path}/mesh").json() == of_class


def test_a_box_may_be_a_planar_polygon(server, client: httpx.Client, sid: str, box_json: dict[str, Any]) -> None:
    turned = {"position": [0.1, 0.2, 0.3], "wxyz": [0.8, 0.0, 0.6, 0.0]}
    client.post(f"/api/sessions/{sid}/boxes", json={**box_json, "T_world_box": turned})
    path = f"/api/sessions/{sid}/boxes/1"
    ring = [[-0.05, -0.05, 0.01], [0.05, -0.05, 0.01], [0.05, 0.05, 0.01]]
    flat = client.put(f"{path}/polygon", json={"polygon": ring, "frame_of": "box"}, headers={"If-Match": '"1"'})
    assert (flat.status_code, flat.headers["etag"], flat.json()["has_mesh"]) == (200, '"2"', True)
    mesh = flat.json()["mesh"]
    assert (mesh["vertices"], mesh["faces"], mesh["source"]["name"]) == (3, 2, "polygon")
    box = server.services.store.state(sid).boxes[1].box
    R, centre = box.T_world_box[:3, :3], box.T_world_box[:3, 3]
    world = (np.array(ring) @ R.T + centre).tolist()
    same = client.put(f"{path}/polygon", json={"polygon": world, "frame_of": "world"}, headers={"If-Match": '"2"'})
    kept = client.get(f"/api/sessions/{sid}/meshes/{same.json()['mesh']['digest']}").json()
    assert np.array(kept["vertices"]) == pytest.approx(np.array(ring), abs=1e-6)
    for body, words in (
        ({"polygon": ring}, "frame_of"),
        ({"polygon": ring[:2], "frame_of": "box"}, "polygon"),
        ({"polygon": [[0, 0, 0], [1, 0, 0], [1, 1, 1], [0, 1, 0]], "frame_of": "box"}, "must lie in one plane"),
        ({"polygon": [[0, 0, "0"], [1, 0, 0], [1, 1, 1]], "frame_of": "box"}, "polygon.0.2"),
    ):
        revision = client.get(path).headers["etag"]
        refused = client.put(f"{path}/polygon", json=body, headers={"If-Match": revision})
        assert refused.status_code == 422
        assert words in refused.json()["detail"]
    assert client.put(f"{path}/polygon", json={"polygon": ring, "frame_of": "box"}).status_code == 428
    gone = client.put(f"/api/sessions/{sid}/boxes/9/polygon", json={"polygon": ring, "frame_of": "box"},
                      headers={"If-Match": '"3"'})  # fmt: skip
    assert gone.status_code == 404


@pytest.mark.parametrize(
    ("data", "fields", "status", "words"),
    [
        (an_stl(), {"unit": "ft"}, 422, "unit: "),
        (an_stl(), {"axes": "x,z,y"}, 422, "mirror the object"),
        (an_stl(), {"axes": "x" * 21}, 422, "axes: "),
        (an_stl(), {"color": "red"}, 422, "'color' is unknown"),
        (an_stl(), {"fit_size": "yes"}, 422, "fit_size: "),
        (an_stl(), {"unit": "m"}, 422, "brick.stl: the object would be 40 m long in unit m"),
        (an_stl()[:-1], {}, 422, "brick.stl: is no stl file, or is cut short"),
        (an_stl(faces=FACES[:1]), {"fit_size": "true"}, 422, "the mesh is flat"),
        (b"", {}, 422, "brick.stl: is no stl file"),
        (b"\0" * (11 * 2**20), {}, 413, "simplify the mesh"),
    ],
)
def test_a_mesh_that_cannot_be_is_refused(
    server, client: httpx.Client, sid: str, data: bytes, fields: dict[str, str], status: int, words: str
) -> None:
    refused = put(client, f"/api/sessions/{sid}/classes/0/mesh", data, **fields)
    assert refused.status_code == status
    assert words in refused.json()["detail"]
    assert client.get(f"/api/sessions/{sid}").json()["revision"] == 0
    building = server.services.store.folder / ".building"
    assert [path.name for path in building.iterdir() if path.is_dir()] == []


def test_what_a_form_must_have(client: httpx.Client, sid: str) -> None:
    path = f"/api/sessions/{sid}/classes/0/mesh"
    bare = client.put(path, files={"file": ("a.stl", an_stl())}, headers={"If-Match": '"0"'})
    assert bare.status_code == 422
    assert bare.json()["detail"] == "unit: Field required; axes: Field required"
    assert client.put(path, files={"file": ("a.stl", an_stl())}).status_code == 428
    assert client.put(path, json={}, headers={"If-Match": '"0"'}).status_code == 422
    assert put(client, f"/api/sessions/{sid}/classes/7/mesh", an_stl()).status_code == 404
    assert put(client, "/api/sessions/nowhere/classes/0/mesh", an_stl()).status_code == 404
    assert client.get(f"/api/sessions/{sid}/meshes/{'0a' * 32}").status_code == 404


def test_the_log_leads_to_what_there_is(server, client: httpx.Client, sid: str) -> None:
    store = server.services.store
    origin = store.state(sid)
    put(client, f"/api/sessions/{sid}/classes/0/mesh", an_stl())
    client.patch(
        f"/api/sessions/{sid}/classes/0",
        json={
            "keypoints": [{"name": "tip", "place": [0.1, 0, 0.5]}],
            "symmetry": {"kind": "continuous", "axis": [1, 1, 0]},
        },
        headers={"If-Match": '"1"'},
    )
    assert differences(replay(origin, store.edits(sid)), store.state(sid)) == []
