"""`/api/sessions/{sid}/points` and `frames/{index}/epipolar`: places of the world from clicks in images."""

import math
from typing import Annotated

import numpy as np
from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from ars_web.api.dependencies import IdempotencyKey, ServicesDep, StrictRoute
from ars_web.api.models import Number, Strict
from ars_web.api.problems import documented
from ars_web.errors import BadInput, NotFound
from ars_web.geometry.epipolar import epipolar_curve
from ars_web.geometry.triangulation import Observation, TriangulatedPoint, triangulate
from ars_web.sessions.boxes_json import Id
from ars_web.sessions.store import SessionStore

router = APIRouter(prefix="/api/sessions/{sid}", tags=["points"], route_class=StrictRoute)

SMALL_ANGLE = 5.0
"""Degrees between the rays below which a point's distance is called uncertain."""

LARGE_RESIDUAL = 3.0
"""Pixels beyond which a click is called doubtful."""

Coordinate = Annotated[float, Query(allow_inf_nan=False, description="image coordinate in the original image")]


class ObservationJson(Strict):
    """Where the point is seen in a frame; image coordinates of the original image."""

    frame: Id
    x: Number
    y: Number


class PointDraft(Strict):
    """A point as it is seen in two frames or more."""

    observations: Annotated[list[ObservationJson], Field(min_length=2, max_length=100)]


class PointAnswer(BaseModel):
    """Where the point is, and how well the observations agree."""

    point: tuple[float, float, float] = Field(description="in the world, metres")
    residuals_px: list[float] = Field(description="how far from each observation the point is seen, pixels")
    angle_degrees: float = Field(description="the largest between two of the rays; small: the distance is uncertain")
    warnings: list[str] = Field(description="what is uncertain, and what to do about it, for the user")


class EpipolarAnswer(BaseModel):
    """Where in the frame the point must be."""

    lines: list[list[tuple[float, float]]] = Field(
        description="polylines in the original image, away from the other frame's camera; none: the frame does not"
        " show where the point can be"
    )


@router.post("/points", operation_id="points-locate", responses=documented(404, 413))
def locate(sid: str, draft: PointDraft, services: ServicesDep, key: IdempotencyKey) -> PointAnswer:
    """The point of the world that is seen at these places. Nothing is stored or changed."""
    frames = [one.frame for one in draft.observations]
    repeated = next((frame for frame in frames if frames.count(frame) > 1), None)
    if repeated is not None:
        raise BadInput(f"frame {repeated} is given twice; a point is at one place in a frame")
    found = triangulate([_observation(services.store, sid, one.frame, one.x, one.y) for one in draft.observations])
    x, y, z = found.point_world.tolist()
    return PointAnswer(
        point=(x, y, z),
        residuals_px=found.residuals_px.tolist(),
        angle_degrees=math.degrees(found.angle),
        warnings=_warnings(frames, found),
    )


@router.get("/frames/{index}/epipolar", operation_id="frame-epipolar-get", responses=documented(404))
def epipolar(
    sid: str,
    index: int,
    services: ServicesDep,
    of: Annotated[int, Query(description="the frame in which the point is marked")],
    x: Coordinate,
    y: Coordinate,
) -> EpipolarAnswer:
    """The curve in this frame on which a point must be that is marked in another one, bent by the lens."""
    frames = services.store.frames(sid)
    if not 0 <= index < len(frames):
        raise NotFound(f"session {sid} has no frame {index}; its frames are 0 to {len(frames) - 1}")
    if of == index:
        raise BadInput(f"the point is marked in frame {of} itself; ask for its curve in another frame")
    observation = _observation(services.store, sid, of, x, y)
    camera = services.store.cameras(sid)[int(frames.camera_ids[index])]
    lines = epipolar_curve(observation, camera, frames.Ts_world_camera[index])
    return EpipolarAnswer(lines=[line.tolist() for line in lines])


def _observation(store: SessionStore, sid: str, frame: int, x: float, y: float) -> Observation:
    frames = store.frames(sid)
    if not 0 <= frame < len(frames):
        raise BadInput(f"session {sid} has no frame {frame}; its frames are 0 to {len(frames) - 1}")
    camera = store.cameras(sid)[int(frames.camera_ids[frame])]
    return Observation(frame, camera, frames.Ts_world_camera[frame], np.array([x, y]))


def _warnings(frames: list[int], found: TriangulatedPoint) -> list[str]:
    warnings: list[str] = []
    degrees = math.degrees(found.angle)
    if degrees < SMALL_ANGLE:
        warnings.append(
            f"The frames see the point from nearly the same side, {degrees:.1f} degrees apart, so its distance is"
            " uncertain. Mark it in a frame from further round, too."
        )
    worst = int(np.argmax(found.residuals_px))
    off = float(found.residuals_px[worst])
    if off > LARGE_RESIDUAL:
        if len(frames) == 2:
            warnings.append(
                f"The places in frames {frames[0]} and {frames[1]} do not belong together: they are {off:.1f} px off"
                " any one point. Mark the point again in both."
            )
        else:
            warnings.append(
                f"The place in frame {frames[worst]} is {off:.1f} px off the point that all frames give. Mark the point"
                " there again."
            )
    return warnings
