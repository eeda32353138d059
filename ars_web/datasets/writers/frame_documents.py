"""All that is known of a frame and its labels, as one JSON object a frame."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import orjson
from jaxtyping import Float

from ars_web.datasets.writers.writer import Shard
from ars_web.geometry import rigid_transform
from ars_web.geometry.box import stack
from ars_web.geometry.camera import Camera

PIXEL_DECIMALS, POSITION_DECIMALS, QUATERNION_DECIMALS, SHARE_DECIMALS = 2, 9, 9, 4


def frame_documents(shard: Shard) -> Iterator[bytes]:
    """A JSON object for each frame: where it is from, its camera and pose, and its labels by ascending box.

    Image coordinates with two decimals, metres and quaternions `wxyz` with nine, shares with four. A keypoint is
    `[x, y, state]` as COCO numbers states, x and y null where it cannot be shown.
    """
    shapes, table, session = shard.shapes, shard.table, shard.session
    cameras = {i: _camera(i, camera) for i, camera in shapes.cameras.items()}
    camera_ids: list[int] = shapes.camera_ids.tolist()
    rings, points = shard.marks["silhouette"].rings, shard.marks["keypoints"]
    counts = [len(shard.classes[place].keypoints) for place in shard.class_of_box.tolist()]
    Ts_world_box, sizes = stack(list(shapes.boxes))
    size_lists, poses = _rounded(sizes, POSITION_DECIMALS), _poses(shapes.Ts_world_camera)
    Ts_camera_world = rigid_transform.invert(shapes.Ts_world_camera)
    boxes = shard.keep.shape[1]
    for i, stem in enumerate(shard.stems):
        columns: list[int] = np.flatnonzero(shard.keep[i]).tolist()
        in_camera = _poses(Ts_camera_world[i] @ Ts_world_box[columns])
        bbox, amodal = (_rounded(t[i, columns], PIXEL_DECIMALS) for t in (table.bbox, table.bbox_amodal))
        truncated, visible = (_rounded(t[i, columns], SHARE_DECIMALS) for t in (table.truncated, table.visible))
        places = _rounded(points.points[i, columns], PIXEL_DECIMALS)
        states = points.states[i, columns].tolist()
        labels = [
            {
                "class_id": (class_id := int(shard.class_of_box[column])),
                "class": shard.classes[class_id].name,
                "box_id": session.box_ids[column],
                "box_name": session.box_names[column],
                "T_camera_box": in_camera[row],
                "size": size_lists[column],
                "bbox": bbox[row],
                "bbox_amodal": amodal[row],
                "truncated": truncated[row],
                "visible": visible[row],
                "outline": [_rounded(ring.ravel(), PIXEL_DECIMALS) for ring in rings.of(i * boxes + column)],
                "keypoints": [
                    [x, y, state] for (x, y), state in zip(places[row][: counts[column]], states[row], strict=False)
                ],
            }
            for row, column in enumerate(columns)
        ]
        width, height = shard.sizes[i].tolist()
        yield orjson.dumps(
            {
                "stem": stem,
                "split": shard.splits[i],
                "session": session.id,
                "frame": int(shard.frame_indices[i]),
                "frame_name": shard.frame_names[i],
                "width": width,
                "height": height,
                "camera": cameras[camera_ids[i]],
                "T_world_camera": poses[i],
                "labels": labels,
            }
        )


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


def _rounded(values: Float[np.ndarray, "*m"], decimals: int) -> Any:
    # A zero has no sign, whichever way it was rounded. orjson writes NaN as null.
    return (np.round(values, decimals) + 0.0).tolist()


def _poses(Ts: Float[np.ndarray, "m 4 4"]) -> list[dict[str, list[float]]]:
    positions = _rounded(Ts[:, :3, 3], POSITION_DECIMALS)
    wxyz = _rounded(rigid_transform.wxyz_from_rotation(Ts[:, :3, :3]), QUATERNION_DECIMALS)
    return [{"position": p, "wxyz": q} for p, q in zip(positions, wxyz, strict=True)]
