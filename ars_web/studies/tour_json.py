"""A tour as the API answers it and files hold it, and as poses of a robot's wrist."""

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from ars_web.geometry import rigid_transform
from ars_web.geometry.rigid_transform import Transform
from ars_web.geometry.view_proposals import Reason
from ars_web.studies.tour import Tour, TourStop


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True)


class PoseJson(_Record):
    """A rigid transform."""

    position: tuple[float, float, float] = Field(description="metres")
    wxyz: tuple[float, float, float, float] = Field(description="unit quaternion, w first and >= 0")


class FillJson(_Record):
    """An empty cell that a view fills."""

    box_id: int
    cell: int = Field(description="of equal area, as the coverage counts them")
    azimuth: float = Field(description="of the view in the box's frame, folded by the symmetry, radians")
    polar: float = Field(description="likewise, from +z")


class TourViewJson(_Record):
    """A view to take."""

    T_world_camera: PoseJson = Field(description="OpenCV camera axes: x right, y down, z forward")
    T_world_wrist: PoseJson | None = Field(description="of the wrist that holds the camera; null: unknown how it does")
    box_id: int = Field(description="the object looked at; the image's x is horizontal")
    boxes: list[int] = Field(description="ids of all boxes that an export would label there")
    fills: list[FillJson] = Field(description="cells that no frame and no view chosen before it fills")
    distance: float = Field(description="metres to the centre of the object looked at")
    height: float = Field(description="z in the world, metres")
    tilt: float = Field(description="of the camera's axis below the horizontal, radians")


class TourLimitsJson(_Record):
    """What the views keep to."""

    distance: tuple[float, float] = Field(description="metres")
    height: tuple[float, float] = Field(description="metres")
    tilt: tuple[float, float] = Field(description="radians")
    min_visible: float
    clearance: float = Field(description="metres to the nearest box")
    from_recording: list[str] = Field(description="those that nobody gave: as the recording's frames are, widened")


class CellLeftJson(_Record):
    """An empty cell that no view of the tour fills."""

    box_id: int
    cell: int
    reason: Reason = Field(description="what hinders the pose that got furthest; later: ask for more views")


class TourJson(_Record):
    """Views that fill empty cells of objects' coverage, in the order of a short tour. What stands between them is not
    looked at: how to get from one to the next is the robot's to plan."""

    views: list[TourViewJson]
    start: PoseJson = Field(description="camera pose at which the tour begins")
    length: float = Field(description="metres from the start through all views")
    turn: float = Field(description="radians that the camera turns on the way")
    limits: TourLimitsJson
    cells: int = Field(description="of all chosen objects, those that their symmetry leaves")
    cells_empty: int = Field(description="of them, those that no frame lies in")
    cells_filled: int = Field(description="of the empty ones, those that the views fill")
    cells_left: list[CellLeftJson] = Field(description="the other empty ones")
    left_by_reason: dict[Reason, int]
    doubts: list[str] = Field(description="what may make the views other than they seem, in words; mostly none")


def tour_json(tour: Tour, *, T_wrist_camera: Transform | None) -> TourJson:
    """A tour for the API and for files; without the camera in the wrist it has no wrist poses."""
    limits = tour.limits
    return TourJson(
        views=[_view_json(stop, T_wrist_camera) for stop in tour.stops],
        start=_pose_json(tour.start),
        length=tour.length,
        turn=tour.turn,
        limits=TourLimitsJson(
            distance=limits.distance,
            height=limits.height,
            tilt=limits.tilt,
            min_visible=limits.min_visible,
            clearance=limits.clearance,
            from_recording=list(tour.from_recording),
        ),
        cells=tour.cells,
        cells_empty=tour.empty,
        cells_filled=tour.filled,
        cells_left=[CellLeftJson(box_id=one.box_id, cell=one.cell, reason=one.reason) for one in tour.left],
        left_by_reason=tour.left_by_reason,
        doubts=tour.doubts,
    )


def wrist_rows(tour: Tour, T_wrist_camera: Transform) -> str:
    """The wrist's poses in the order of the tour, as `robot_poses.txt` has them: `x y z qx qy qz qw` a line."""
    lines: list[str] = []
    for stop in tour.stops:
        T = _wrist(stop, T_wrist_camera)
        w, x, y, z = rigid_transform.wxyz_from_rotation(T[:3, :3]).tolist()
        lines.append(" ".join(f"{value:.15g}" for value in (*T[:3, 3].tolist(), x, y, z, w)) + "\n")
    return "".join(lines)


def _wrist(stop: TourStop, T_wrist_camera: Transform) -> Transform:
    T_world_wrist: Transform = stop.T_world_camera @ rigid_transform.invert(T_wrist_camera)
    return T_world_wrist


def _view_json(stop: TourStop, T_wrist_camera: Transform | None) -> TourViewJson:
    return TourViewJson(
        T_world_camera=_pose_json(stop.T_world_camera),
        T_world_wrist=None if T_wrist_camera is None else _pose_json(_wrist(stop, T_wrist_camera)),
        box_id=stop.box_id,
        boxes=list(stop.labelled),
        fills=[
            FillJson(box_id=fill.box_id, cell=fill.cell, azimuth=fill.azimuth, polar=fill.polar) for fill in stop.fills
        ],
        distance=stop.distance,
        height=stop.height,
        tilt=stop.tilt,
    )


def _pose_json(T: Transform) -> PoseJson:
    x, y, z = np.asarray(T[:3, 3]).tolist()
    w, qx, qy, qz = rigid_transform.wxyz_from_rotation(T[:3, :3]).tolist()
    return PoseJson(position=(x, y, z), wxyz=(w, qx, qy, qz))
