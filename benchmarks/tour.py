"""Where to look next for ten objects in a session of 36,000 frames: how long it takes, and how short the tour is.

    python benchmarks/tour.py [--frames 36000] [--objects 10] [--count 20 100 1000] [--hulls]

The camera circles the table but for a sector of a quarter turn. "views" is how frames see the objects, which the server
keeps; "plan" is finding the views and their order. Tours are in metres and RADIAN a radian, beside the nearest
neighbour's, Christofides' by networkx where it is installed, and the shortest tree through all poses by SciPy, which no
path is shorter than. With --hulls each object has a hull of 162 corners, round in its box.
"""

import argparse
import importlib
import importlib.util
import math
import time

import numpy as np
import scene
import trimesh
from scipy.sparse.csgraph import minimum_spanning_tree
from visibility import boxes_apart

from ars_web.datasets.coverage import session_views
from ars_web.geometry.view_tour import nearest_neighbour_path, path_length, pose_distances, short_path
from ars_web.sessions.hull_mesh import HullMesh
from ars_web.sessions.model import FrameTable, ObjectClass, SessionSnapshot, SessionState, VirtualBox
from ars_web.studies.tour import TourRequest, plan_tour


def session(frames: int, objects: int, *, with_hulls: bool) -> SessionSnapshot:
    """A session whose frames leave a quarter of a turn out."""
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
    hull = HullMesh(ball.vertices, ball.faces) if with_hulls else None
    Ts = scene.poses(frames * 4 // 3)
    azimuth = np.arctan2(Ts[:, 1, 3], Ts[:, 0, 3])
    Ts = Ts[np.abs(azimuth) > math.pi / 4][:frames]
    boxes = {
        i: VirtualBox(i, 0, f"box {i}", box, 0, hull=hull and hull.digest)
        for i, box in enumerate(boxes_apart(objects), start=1)
    }
    state = SessionState(0, "table", {0: ObjectClass(0, "box", "#ff0000", 0)}, boxes, 1, objects + 1)
    names = tuple(map(str, range(len(Ts))))
    table = FrameTable(names, names, np.zeros(len(Ts), dtype=np.int64), Ts)
    return SessionSnapshot("table", state, {0: scene.camera()}, table, {hull.digest: hull} if hull else {})


def christofides(distances: np.ndarray) -> float | None:
    """The length of the path that networkx finds from place 0; None where it is not installed."""
    if importlib.util.find_spec("networkx") is None:
        return None
    networkx = importlib.import_module("networkx")
    # A place as far from all others as each other closes the path to a cycle at no cost of its own.
    n, far = len(distances), float(distances.max()) * 2
    closed = np.full((n + 1, n + 1), far)
    closed[:n, :n] = distances
    np.fill_diagonal(closed, 0.0)
    closed[0, n] = closed[n, 0] = far / 2
    cycle = networkx.approximation.christofides(networkx.from_numpy_array(closed))[:-1]
    turn = cycle.index(n)
    path = cycle[turn + 1 :] + cycle[:turn]
    # Whichever way round begins at the start, or else the start is gone to first.
    path = path if path[0] == 0 else path[::-1]
    if path[0] != 0:
        path = [0, *(place for place in path if place != 0)]
    return path_length(distances, np.array(path))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=36_000)
    parser.add_argument("--objects", type=int, default=10)
    parser.add_argument("--count", type=int, nargs="+", default=[20, 100, 1000])
    parser.add_argument("--hulls", action="store_true")
    given = parser.parse_args()
    snapshot = session(given.frames, given.objects, with_hulls=given.hulls)
    rows = list(range(given.objects))
    small = session(200, given.objects, with_hulls=given.hulls)
    plan_tour(small, session_views(small, TourRequest(min_visible=0.5).options), rows, TourRequest())  # compiled
    print(f"{len(snapshot.frames)} frames, {given.objects} objects, 36 x 18 bins; seconds, busy in brackets")
    print(
        "views at most  visible     views          plan          filled  of empty  ours     nearest  christofides  tree"
    )
    for count in given.count:
        for min_visible in (None, 0.5):
            request = TourRequest(count=count, min_visible=min_visible)
            times = [(time.perf_counter(), time.process_time())]
            views = session_views(snapshot, request.options)
            times.append((time.perf_counter(), time.process_time()))
            tour = plan_tour(snapshot, views, rows, request)
            times.append((time.perf_counter(), time.process_time()))
            wall, busy = (np.diff([one[k] for one in times]) for k in (0, 1))
            distances = pose_distances(np.array([tour.start, *(stop.T_world_camera for stop in tour.stops)]))
            ours, nearest = (path_length(distances, path(distances)) for path in (short_path, nearest_neighbour_path))
            peer = christofides(distances)
            shown = "absent" if peer is None else f"{peer:.2f}"
            tree = float(minimum_spanning_tree(distances).sum())
            least = "any" if min_visible is None else f"{min_visible:g}"
            print(
                f"{count:<13}  {least:<7}  {wall[0]:5.2f} ({busy[0]:5.2f})  {wall[1]:5.2f} ({busy[1]:5.2f})"
                f"  {tour.filled:6}  {tour.empty:8}  {ours:7.2f}  {nearest:7.2f}  {shown:>12}  {tree:7.2f}",
                flush=True,
            )
    print("left: " + ", ".join(f"{reason} {cells}" for reason, cells in tour.left_by_reason.items()))


if __name__ == "__main__":
    main()
