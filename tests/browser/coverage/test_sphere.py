"""Coverage mode's sphere in the 3D scene: its cells, clicks on it, and the cameras proposed next."""

import numpy as np
from playwright.sync_api import expect

from ars_web.geometry.sphere_bins import SphereBins

COLORS = """(() => {
    const found = new Map();
    node.traverse((each) => {
        if (each.geometry === undefined || each.geometry.attributes.color === undefined) return;
        const { position, color } = each.geometry.attributes;
        for (let i = 0; i < position.count; i++) {
            const at = [position.getX(i), position.getY(i), position.getZ(i)];
            if (Math.hypot(...at) > 1.002) continue;
            const of = [color.getX(i), color.getY(i), color.getZ(i), color.getW(i)].join();
            found.set(of, [...(found.get(of) ?? []), at]);
        }
    });
    return [...found];
})()"""


def test_the_sphere_has_the_cells_of_the_api_is_clicked_and_shows_the_tour(open_coverage) -> None:
    bins = SphereBins(18, 9)
    with open_coverage(scene=True) as shown:
        found = shown.coverage("box_id=8")
        counts = np.array(found["equal_area"]["counts"])
        shown.until(lambda: len(shown.node("/coverage/sphere", COLORS)) > 1)
        shades = shown.node("/coverage/sphere", COLORS)
        # Holes are one shade; all others have as many as there are counts.
        cells = [set(bins.of(np.array(points))[1].tolist()) for _, points in shades]
        assert len(shades) == len(set(counts.tolist()))
        assert sum(map(len, cells)) == bins.cells
        holes = next(of for (_, _), of in zip(shades, cells, strict=True) if counts[min(of)] == 0)
        assert holes == set(np.flatnonzero(counts == 0).tolist())

        shown.page.get_by_role("button", name="Equal area").click()
        shown.look_closer()
        # From where the camera stands, one of the cells that are turned to it is clicked.
        eye = np.array(
            shown.node(
                "/coverage",
                "(() => { const at = window.__viserMutable.camera.position.clone();"
                " const inverse = node.matrixWorld.clone().invert(); return at.applyMatrix4(inverse).toArray(); })()",
            )
        )
        facing = max(range(bins.cells), key=lambda cell: float(bins.cell_directions[cell] @ eye))
        shown.page.mouse.click(*shown.on_screen("/coverage/sphere", shown_at(shown, bins.cell_directions[facing])))
        shown.until(lambda: shown.in_store("store.direction.value?.index") == facing)
        expect(shown.bin(facing)).to_have_attribute("aria-selected", "true")
        shown.until(lambda: shown.node("/coverage/chosen", "node.visible"))

        shown.page.get_by_label("Views at most").fill("3")
        shown.page.get_by_role("button", name="Plan views").click()
        expect(shown.page.locator(".tour-views li").first).to_be_visible()
        views = shown.page.locator(".tour-views li").count()
        assert shown.node("/tour/cameras", "node.visible") is True
        expect(shown.page.frame_locator(".stage iframe").locator(".ars-number")).to_have_count(views)


def shown_at(shown, direction: np.ndarray) -> np.ndarray:
    """A direction on the sphere, in its node's coordinates: the node itself has no scale, what it holds has."""
    scale = shown.node(
        "/coverage/sphere",
        "(() => { let found = 1; node.traverse((each) => { if (each.scale.x !== 1) found = each.scale.x; });"
        " return found; })()",
    )
    return direction * scale
