"""The JSON of masks and hulls in the API; what outlines look like in requests is in `masks/masks_json.py`, which the
command line reads, too."""

from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel, Field

from ars_web.api.models import BoxAnswer, Name, Strict
from ars_web.geometry.polygon import Polygon
from ars_web.masks.masks_json import Height, MaybeOutlineJson, OutlineJson, Widening
from ars_web.sessions.boxes_json import Flag, Id
from ars_web.sessions.model import HullOptions, Orientation, Origin, Position

Triple = tuple[float, float, float]


class PolygonAnswer(BaseModel):
    """A ring with its holes; image coordinates of the original image, rings not closed."""

    outer: list[tuple[float, float]]
    holes: list[list[tuple[float, float]]]


class PolygonsAnswer(BaseModel):
    """An outline; empty where nothing is left of it."""

    polygons: list[PolygonAnswer]


class MaskAnswer(PolygonsAnswer):
    """The outline of one object in one frame; its ETag is its revision."""

    id: int = Field(description="never used again")
    box_id: int = Field(description="the object's box, or the id kept for it while there is none yet")
    class_id: int
    frame: int
    origin: Origin = Field(description="by hand, by the smart tool, or by the program on its own")
    accepted: bool = Field(description="whether it counts for the hull; else it waits for a yes or a no")
    points: int = Field(description="corners, over all rings")
    revision: int = Field(description="the session's revision that last changed it")


class MaskDraftJson(OutlineJson):
    """A mask to add."""

    box_id: Id | None = Field(None, description="the object's; null: of a new object, whose id the answer tells")
    class_id: Id = Field(description="the object's")
    frame: Id
    origin: Origin = "drawn"
    accepted: Flag = True


class MaskChangeJson(MaybeOutlineJson):
    """What of a mask is to change; what is not given stays."""

    origin: Origin | None = None
    accepted: Flag | None = None


class HullAnswer(BaseModel):
    """A visual hull: what the outlines leave of space."""

    volume: float = Field(description="cubic metres")
    centre_of_mass: Triple = Field(description="in the world, metres")
    vertices: list[Triple] = Field(description="in the world, metres")
    faces: list[tuple[int, int, int]] = Field(description="rows of vertices, counter-clockwise seen from outside")


class MadeHullAnswer(HullAnswer):
    """The hull that a box was made of."""

    position: Position = Field(description="the box's centre: its own, or the hull's centre of mass")


class MadeBoxAnswer(BoxAnswer):
    """The box that outlines gave."""

    hull: MadeHullAnswer


class HullChangeJson(Strict):
    """How to make a box of its object's masks; what is not given stays, of a new box at its default."""

    orientation: Orientation | None = None
    position: Position | None = None
    widen_px: Widening | None = None
    ground: Height | None = Field(None, description="null: no support plane")
    class_id: Id | None = Field(None, description="default: as it is; of a new box the masks'")
    name: Name | None = Field(None, description="default: as it is; of a new box after its class")

    def options(self, before: HullOptions) -> HullOptions:
        """`before` with what is given in place."""
        return HullOptions(
            orientation=self.orientation or before.orientation,
            position=self.position or before.position,
            widen=before.widen if self.widen_px is None else self.widen_px,
            ground=self.ground if "ground" in self.model_fields_set else before.ground,
            # Who says how the box is to lie wants it made anew.
            fitted=before.fitted and self.orientation is None and self.position is None,
        )


def rounded_polygons_json(polygons: Sequence[Polygon], *, decimals: int = 3) -> list[dict[str, Any]]:
    """Polygons that are not stored as PolygonAnswer has them, to so many decimals of a pixel."""
    return [
        {"outer": one.outer.round(decimals).tolist(), "holes": [hole.round(decimals).tolist() for hole in one.holes]}
        for one in polygons
    ]
