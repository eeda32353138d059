"""All that is known of a frame and its labels, as one JSON object a frame."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import orjson
from jaxtyping import Float

from ars_web.datasets.writers.writer import Shard
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import stack
from ars_web.geometry.camera import Camera
from ars_web.geometry.rings import Rings

PIXEL_DECIMALS, POSITION_DECIMALS, QUATERNION_DECIMALS, SHARE_DECIMALS = 2, 9, 9, 4


_AT_ONCE = 32
"""Frames whose labels are made ready together."""


def frame_documents(shard: Shard) -> Iterator[bytes]:
    """A JSON object for each frame: where it is from, its camera and pose, and its labels by ascending box.

    Image coordinates with two decimals, metres and quaternions `wxyz` with nine, shares with four. A keypoint is
    `[x, y, state]` as COCO numbers states, x and y null where it cannot be shown.
    """
    cameras = {i: _camera(i, camera) for i, camera in shard.shapes.cameras.items()}
    camera_ids: list[int] = shard.shapes.camera_ids.tolist()
    poses = _poses(shard.shapes.Ts_world_camera)
    for first in range(0, len(shard.stems), _AT_ONCE):
        labels = _labels(shard, first, min(first + _AT_ONCE, len(shard.stems)))
        for i, of_frame in enumerate(labels, start=first):
            width, height = shard.sizes[i].tolist()
            document = {
                "stem": shard.stems[i],
                "split": shard.splits[i],
                "session": shard.session.id,
                "frame": int(shard.frame_indices[i]),
                "frame_name": shard.frame_names[i],
                "width": width,
                "height": height,
                "camera": cameras[camera_ids[i]],
                "T_world_camera": poses[i],
                "labels": of_frame,
            }
            yield orjson.dumps(document, option=orjson.OPT_SERIALIZE_NUMPY)


def _labels(shard: Shard, first: int, last: int) -> list[list[dict[str, object]]]:
    """The labels of the frames from `first` up to, not including, `last`; arrays are left to the JSON writer."""
    table, session, rings, points = (
        shard.table,
        shard.session,
        shard.marks["silhouette"].rings,
        shard.marks["keypoints"],
    )
    rows, columns = np.nonzero(shard.keep[first:last])
    rows += first
    Ts_world_box, sizes = stack(list(shard.shapes.boxes))
    T_camera_box = _poses(rigid_transform.invert(shard.shapes.Ts_world_camera[rows]) @ Ts_world_box[columns])
    sizes = _rounded(sizes, POSITION_DECIMALS)
    bbox, amodal = (_rounded(t[rows, columns], PIXEL_DECIMALS) for t in (table.bbox, table.bbox_amodal))
    truncated, visible = (_rounded(t[rows, columns], SHARE_DECIMALS) for t in (table.truncated, table.visible))
    places = _rounded(points.points[rows, columns], PIXEL_DECIMALS)
    keypoints = np.concatenate([places, points.states[rows, columns][..., None]], axis=2)
    outlines = _outlines(rings, first * shard.keep.shape[1], last * shard.keep.shape[1])
    of_frame: list[list[dict[str, object]]] = [[] for _ in range(first, last)]
    for row, (i, column) in enumerate(zip(rows.tolist(), columns.tolist(), strict=True)):
        class_id = int(shard.class_of_box[column])
        a_class = shard.classes[class_id]
        of_frame[i - first].append(
            {
                "class_id": class_id,
                "class": a_class.name,
                "box_id": session.box_ids[column],
                "box_name": session.box_names[column],
                "T_camera_box": T_camera_box[row],
                "size": sizes[column],
                "bbox": bbox[row],
                "bbox_amodal": amodal[row],
                "truncated": truncated[row],
                "visible": visible[row],
                "outline": outlines[(i - first) * shard.keep.shape[1] + column],
                "keypoints": keypoints[row, : len(a_class.keypoints)],
            }
        )
    return of_frame


def _outlines(rings: Rings, first: int, last: int) -> list[list[Float[np.ndarray, "k"]]]:
    """The rings, `x y x y ...`, of the labels from `first` up to, not including, `last`."""
    starts: list[int] = rings.label_starts[first : last + 1].tolist()
    edges: list[int] = rings.ring_starts[starts[0] : starts[-1] + 1].tolist()
    points = _rounded(rings.points[edges[0] : edges[-1]].ravel(), PIXEL_DECIMALS)
    each = [points[2 * (start - edges[0]) : 2 * (end - edges[0])] for start, end in pairwise(edges)]
    return [each[start - starts[0] : end - starts[0]] for start, end in pairwise(starts)]


def _camera(camera_id: int, camera: Camera) -> dict[str, object]:
    return {
        "id": camera_id,
        "model": camera.model,
        "fx": camera.fx,
        "fy": camera.fy,
        "cx": camera.cx,
        "cy": camera.cy,
        "distortion": list(camera.distortion),
    }


def _rounded(values: Float[np.ndarray, "*m"], decimals: int) -> Float[np.ndarray, "*m"]:
    # A zero has no sign, whichever way it was rounded. The JSON writer makes null of NaN.
    return np.round(values, decimals) + 0.0


def _poses(Ts: Float[np.ndarray, "m 4 4"]) -> list[dict[str, Float[np.ndarray, "k"]]]:
    positions = _rounded(Ts[:, :3, 3], POSITION_DECIMALS)
    wxyz = _rounded(rigid_transform.wxyz_from_rotation(Ts[:, :3, :3]), QUATERNION_DECIMALS)
    return [{"position": p, "wxyz": q} for p, q in zip(positions, wxyz, strict=True)]
