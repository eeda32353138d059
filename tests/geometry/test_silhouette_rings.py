"""The silhouette of a box from each of the 27 regions round it, against the hull of its corners."""

import numpy as np
from scipy.spatial import ConvexHull

from ars_web.geometry.box import CORNER_SIGNS
from ars_web.geometry.silhouette_rings import silhouette_rings


def test_every_region_shows_the_hull_of_the_corners():
    rings = silhouette_rings()
    for region in range(27):
        place = np.array([region // 9, region // 3 % 3, region % 3]) - 1
        count, ring = rings[region, 0], rings[region, 1:][rings[region, 1:] >= 0]
        assert len(ring) == count
        if not place.any():
            assert count == 0
            continue
        # A camera in that region looks at the unit box: outside by 3 where the digit says so, else at 0.3, 0.2, 0.1.
        camera = np.where(place == 0, [0.3, 0.2, 0.1], 3.0 * place)
        z = -camera / np.linalg.norm(camera)
        x = np.cross([0.3, 0.5, 0.8], z)
        x /= np.linalg.norm(x)
        corners = (CORNER_SIGNS - camera) @ np.array([x, np.cross(z, x), z]).T
        image = corners[:, :2] / corners[:, 2:]
        hull = ConvexHull(image).vertices
        # Qhull runs counter-clockwise with y up, which y down turns round.
        start = list(hull[::-1]).index(ring[0])
        assert list(np.roll(hull[::-1], -start)) == list(ring), place
