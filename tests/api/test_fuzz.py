"""Whatever JSON comes, the answer is an answer: no 500, and nothing stored that cannot be read again."""

import json
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

numbers = st.one_of(
    st.integers(),
    st.integers(min_value=-3, max_value=3),
    st.floats(allow_nan=True, allow_infinity=True),
    st.sampled_from([0, 1, -1, 1e308, -1e308, 5e-324, 2**63, -(2**63), 2**64, 1e300]),
)
texts = st.one_of(st.text(max_size=20), st.sampled_from(["", "cube", "#ff0000", "\0", "../..", "<b>", "x" * 300]))
anything = st.recursive(
    st.one_of(st.none(), st.booleans(), numbers, texts),
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(texts, inner, max_size=4)),
    max_leaves=8,
)


def shaped(**fields: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    """Objects that nearly fit: each field right, or anything, or missing, or one too many."""
    nearly = {name: st.one_of(right, right, right, anything) for name, right in fields.items()}
    return st.one_of(
        st.fixed_dictionaries({}, optional={**nearly, "more": anything}), st.fixed_dictionaries(nearly), anything
    )


vectors = st.lists(numbers, min_size=3, max_size=3)
transforms = shaped(position=vectors, wxyz=st.lists(numbers, min_size=4, max_size=4))
corners = st.lists(st.lists(st.floats(-50, 250), min_size=2, max_size=2), min_size=3, max_size=6)
outlines = st.lists(
    shaped(outer=st.one_of(corners, corners, anything), holes=st.lists(corners, max_size=1)), max_size=2
)
views = st.lists(shaped(frame=st.integers(0, 6), polygons=outlines, mask_png=texts), max_size=3)
hulls = {
    "orientation": st.sampled_from(["world", "upright", "free"]),
    "widen_px": numbers,
    "ground": st.one_of(st.none(), numbers),
}
BODIES: dict[str, st.SearchStrategy[Any]] = {
    "POST /boxes": shaped(class_id=numbers, T_world_box=transforms, size=vectors, name=texts),
    "PATCH /boxes/1": shaped(class_id=numbers, T_world_box=transforms, size=vectors, name=texts),
    "POST /boxes/from-points": shaped(
        class_id=numbers,
        points=st.lists(vectors, min_size=4, max_size=4),
        frame_of=st.sampled_from(["world", "camera"]),
        frame=numbers,
    ),
    "POST /labels": shaped(boxes=st.lists(shaped(T_world_box=transforms, size=vectors)), frames=st.lists(numbers)),
    "POST /points": shaped(observations=st.lists(shaped(frame=numbers, x=numbers, y=numbers), max_size=4)),
    "POST /boxes/from-masks": shaped(class_id=numbers, views=views, box_id=numbers, name=texts, **hulls),
    "PUT /boxes/1/hull": shaped(position=texts, class_id=numbers, **hulls),
    "POST /boxes/1/refine": shaped(views=views, dry_run=st.booleans()),
    "POST /boxes/1/outline-rest": shaped(frames_most=numbers),
    "POST /masks": shaped(
        box_id=st.one_of(st.none(), numbers), class_id=st.just(0), frame=st.integers(0, 6), polygons=outlines
    ),
    "PUT /masks/1": shaped(polygons=outlines, accepted=st.booleans(), origin=texts),
    "POST /hull-preview": shaped(views=views, show_in=st.lists(st.integers(0, 6), max_size=3), **hulls),
    "POST /polygons/combine": shaped(
        polygons=outlines,
        operation=st.sampled_from(["add", "subtract"]),
        stroke=st.one_of(st.none(), shaped(points=corners, width=numbers)),
        polygon=st.one_of(st.none(), shaped(outer=corners)),
        frame=st.integers(0, 6),
    ),
    "POST /frames/0/segment": shaped(
        rectangle=st.lists(st.floats(0, 160), min_size=4, max_size=4),
        inside=st.lists(corners, max_size=2),
        start=outlines,
    ),
    "POST /labels/import": shaped(root=st.just("data"), path=texts, format=texts, dry_run=st.booleans()),
    "POST /coverage/tour": shaped(
        box_ids=st.one_of(st.none(), st.lists(numbers, max_size=2)),
        count=st.one_of(st.just(2), numbers),
        distance=st.one_of(st.none(), st.lists(numbers, min_size=2, max_size=2)),
        height=st.one_of(st.none(), st.lists(numbers, min_size=2, max_size=2)),
        tilt=st.one_of(st.none(), st.lists(numbers, min_size=2, max_size=2)),
        azimuth_bins=st.one_of(st.just(4), numbers),
        polar_bins=st.one_of(st.just(2), numbers),
    ),
    "POST /classes": shaped(name=texts, color=texts),
    "PATCH /classes/0": shaped(name=texts, color=texts),
    "PATCH ": shaped(name=texts),
    "POST /undo": anything,
    "POST /redo": anything,
    "POST /exports": shaped(
        format=texts, options=shaped(images=texts, frames=shaped(step=numbers, list=st.lists(numbers)))
    ),
}
requests = st.sampled_from(sorted(BODIES)).flatmap(lambda name: st.tuples(st.just(name), BODIES[name]))


@settings(max_examples=250, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(request=requests, tag=st.sampled_from(["current", '"0"', '"x"', "nonsense", ""]))
def test_no_request_makes_the_server_fail(server, sid: str, request: tuple[str, Any], tag: str) -> None:
    name, body = request
    method, _, part = name.partition(" ")
    path = f"/api/sessions/{sid}{part}"
    headers = {"Content-Type": "application/json"}
    if method in ("PATCH", "PUT"):
        current = server.client.get(path.removesuffix("/hull")).headers.get("etag", '"0"')
        headers["If-Match"] = current if tag == "current" else tag
    content = json.dumps(body).encode(errors="surrogatepass")
    answer = server.client.request(method, path, content=content, headers=headers)
    assert answer.status_code < 500, answer.text
    assert answer.status_code < 400 or answer.json()["detail"]
    for read in ("", "/boxes", "/classes", "/masks"):
        assert server.client.get(f"/api/sessions/{sid}{read}").status_code == 200
    labels = server.client.get(f"/api/sessions/{sid}/frames/0/labels")
    assert labels.status_code == 200, labels.text


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(body=shaped(name=texts, root=st.just("data"), path=texts, format=texts, classes=st.lists(texts)))
def test_no_import_makes_the_server_fail(server, body: Any) -> None:
    content = json.dumps(body).encode(errors="surrogatepass")
    answer = server.client.post("/api/sessions", content=content, headers={"Content-Type": "application/json"})
    assert answer.status_code < 500, answer.text
