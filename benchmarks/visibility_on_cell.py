"""How far `visible` among boxes follows the true visible fraction, on the rendered cell.

    python benchmarks/visibility_on_cell.py PATH/TO/cell

Boxes hide more than the objects in them, and are seen where those are not, so the two cannot agree wholly. The table
shows for each object how well they do.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from ars_web.geometry.box import Box
from ars_web.geometry.camera import Camera
from ars_web.geometry.labels import labels_of_boxes
from ars_web.geometry.occlusion import visible_fractions

FEWEST_PIXELS = 200
"""Of an object in a frame. The true fraction of less is mostly noise."""


def main() -> None:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("cell", type=Path)
    truth = json.loads((arguments.parse_args().cell / "truth" / "truth.json").read_bytes())
    K, (k1, k2, p1, p2) = truth["K"], truth["dist"]
    camera = Camera(*truth["size"], K[0][0], K[1][1], K[0][2], K[1][2], "brown", (k1, k2, p1, p2, 0.0))
    boxes = [Box(np.array(thing["T_world_box"]), np.array(thing["size"])) for thing in truth["objects"]]
    frames = truth["frames"]
    Ts = np.array([frame["T_world_camera"] for frame in frames])
    visible = visible_fractions(camera, Ts, boxes, labels_of_boxes(camera, Ts, boxes).bbox)
    true = np.array([[thing["visible_fraction"] for thing in frame["objects"]] for frame in frames])
    pixels = np.array([[thing["px_in_image"] for thing in frame["objects"]] for frame in frames])
    seen = pixels > FEWEST_PIXELS
    print(f"{'object':<12} {'frames':>6} {'true':>6} {'boxes':>6} {'off by':>7} {'correlation':>12}")
    for number, thing in enumerate(truth["objects"]):
        print(line(f"{number} {thing['label']}", visible[:, number], true[:, number], seen[:, number]))
    print(line("all", visible, true, seen))
    print(
        f"\nobjects of more than {FEWEST_PIXELS} pixels in a frame; means of both fractions and of how far they differ"
    )


def line(name: str, visible: np.ndarray, true: np.ndarray, seen: np.ndarray) -> str:
    a, b = visible[seen], true[seen]
    varies = len(a) > 1 and np.ptp(a) > 0 and np.ptp(b) > 0
    correlation = f"{np.corrcoef(a, b)[0, 1]:12.2f}" if varies else f"{'constant':>12}"
    return f"{name:<12} {len(a):6d} {b.mean():6.2f} {a.mean():6.2f} {np.abs(a - b).mean():7.3f} {correlation}"


if __name__ == "__main__":
    main()
