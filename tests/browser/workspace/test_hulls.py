"""The hull of a box that is made of masks, in the scene of whoever looks."""

from typing import Any

import numpy as np

from ars_web.demo import building, rendering, scene
from ars_web.demo.truth import DemoTruth
from ars_web.geometry.mask_regions import polygons_from_mask

BALL = 4
FRAMES = (0, 3)

SEEN = """(name) => {
    let node = window.__viserMutable.nodeRefFromName[name];
    if (!node) return null;
    for (; node; node = node.parent) if (!node.visible) return false;
    return true;
}"""


def views(truth: DemoTruth) -> list[dict[str, Any]]:
    """The beach ball's outlines."""
    parts = building.place(scene.things(), desk=scene.desk())
    rays = rendering.ray_table(truth.camera)
    masks = [rendering.look(parts, rays, truth.Ts_world_camera[frame]).alone[BALL] for frame in FRAMES]
    outlines = [polygons_from_mask(mask, tolerance=1.0)[0].outer.tolist() for mask in masks]
    return [
        {"frame": frame, "polygons": [{"outer": ring, "holes": []}]}
        for frame, ring in zip(FRAMES, outlines, strict=True)
    ]


def test_a_box_made_by_another_program_comes_with_its_hull_which_hides_with_it(
    demo_recording: DemoTruth, boxed_session, open_workspace
) -> None:
    sessions, sid = boxed_session
    with open_workspace(sessions) as (_, _, page_of):
        workspace = page_of(sid).open()
        answer = workspace.client.post(
            f"/api/sessions/{sid}/boxes/from-masks", json={"class_id": 0, "views": views(demo_recording)}
        )
        assert answer.status_code == 201, answer.text
        made = answer.json()
        name = f"/boxes/{made['id']}/at/hull"
        workspace.until(lambda: workspace.scene.evaluate(SEEN, name) is True)
        # It fills its box: its highest vertex is seen where the box's upper face is.
        top = workspace.on_screen(f"/boxes/{made['id']}/at/edges", 0.0, 0.0, 0.5)
        assert np.allclose(workspace.on_screen(name, 0.0, 0.0, 0.5), top, atol=0.5)
        workspace.page.get_by_role("row", name=made["name"]).get_by_role("button", name="Hide").click()
        workspace.until(lambda: workspace.scene.evaluate(SEEN, name) is False)
