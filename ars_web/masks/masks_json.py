"""Outlines as the JSON of the API and of mask files, and boxes that are asked for by them."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Self, TypedDict

import cv2
import numpy as np
from jaxtyping import Bool
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, model_validator

from ars_web.errors import BadFile, BadInput
from ars_web.geometry.box import FARTHEST
from ars_web.geometry.camera import Camera
from ars_web.geometry.mask_regions import polygons_from_mask
from ars_web.geometry.polygon import Polygon
from ars_web.geometry.visual_hull import VisualHull
from ars_web.masks.mask_png import LONGEST_BASE64, mask_from_base64
from ars_web.masks.views import Photographed, camera_of
from ars_web.sessions.boxes_json import Id, Name, box_json
from ars_web.sessions.model import WIDEST, HullOptions, Orientation, Position, VirtualBox
from ars_web.sessions.outlines import FARTHEST as FARTHEST_PIXEL
from ars_web.sessions.outlines import MOST_CORNERS, MOST_RINGS
from ars_web.sessions.strict_json import first_fault, place_text, strict_json

MOST_VIEWS = 100

Coordinate = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-FARTHEST_PIXEL, le=FARTHEST_PIXEL)]
Corner = tuple[Coordinate, Coordinate]
Ring = Annotated[list[Corner], Field(min_length=3, max_length=MOST_CORNERS)]
Widening = Annotated[float, Field(strict=True, ge=0.0, le=WIDEST, allow_inf_nan=False)]
Height = Annotated[float, Field(strict=True, ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False)]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class PolygonJson(_Strict):
    """A ring with its holes; image coordinates of the original image, rings not closed."""

    outer: Ring
    holes: list[Ring] = Field(default_factory=list[Ring], max_length=MOST_RINGS)

    @property
    def polygon(self) -> Polygon:
        """As geometry takes it."""
        return Polygon(np.array(self.outer), tuple(np.array(hole) for hole in self.holes))


Polygons = Annotated[list[PolygonJson], Field(min_length=1, max_length=MOST_RINGS)]


class MaybeOutlineJson(_Strict):
    """Where an object is in one image, as polygons or as a mask, if it is said."""

    polygons: Polygons | None = Field(
        None, description="what an odd number of their rings enclose is inside; at most 20000 corners in all"
    )
    mask_png: Annotated[str, Field(max_length=LONGEST_BASE64)] | None = Field(
        None, description="base64 of an 8-bit greyscale PNG of the image's size, non-zero inside"
    )

    @model_validator(mode="after")
    def _is_given_once(self) -> Self:
        if self.polygons is not None and self.mask_png is not None:
            raise ValueError("give either polygons or mask_png, not both")
        return self

    def outline(self, camera: Camera) -> tuple[Polygon, ...]:
        """The polygons; those of a mask follow its pixels' borders to half a pixel. None are given: none.

        Raises:
            BadInput: the mask is not one of the camera's images, is empty, or has too many corners.
        """
        if self.mask_png is None:
            return tuple(one.polygon for one in self.polygons or [])
        mask = mask_from_base64(self.mask_png, width=camera.width, height=camera.height)
        if not mask.any():
            raise BadInput("the mask is empty: every pixel is 0")
        # Counted first: following the borders of a million specks takes a while.
        pieces, holes = _count(mask, connectivity=4), _count(~np.pad(mask, 1), connectivity=8) - 1
        if pieces + holes > MOST_RINGS:
            raise BadInput(
                f"the mask has {pieces} pieces and {holes} holes; at most {MOST_RINGS} are taken: clear its specks"
            )
        return polygons_from_mask(mask)


def _count(mask: Bool[np.ndarray, "h w"], *, connectivity: int) -> int:
    return cv2.connectedComponents(mask.astype(np.uint8), connectivity=connectivity)[0] - 1


class OutlineJson(MaybeOutlineJson):
    """Where an object is in one image, as polygons or as a mask."""

    @model_validator(mode="after")
    def _is_given(self) -> Self:
        if self.polygons is None and self.mask_png is None:
            raise ValueError("give polygons or mask_png")
        return self


class ViewJson(OutlineJson):
    """The object's outline in one frame."""

    frame: Id


class HullDraftJson(_Strict):
    """How a box is made of outlines."""

    orientation: Orientation = Field(
        "world",
        description="the box's axes: the world's; upright: turned about the world's z to the smallest area; free: to"
        " the smallest volume",
    )
    position: Position = Field("box", description="the box's centre: its own, or the hull's centre of mass")
    widen_px: Widening = Field(0.0, description="how far outlines may be off, pixels: each is widened by it")
    ground: Height | None = Field(None, description="z of the plane that the object stands on, metres; null: none")

    @property
    def options(self) -> HullOptions:
        """As sessions keep them."""
        return HullOptions(self.orientation, self.position, self.widen_px, self.ground)


class BoxRequest(TypedDict):
    """What `ObjectBoxes.from_masks` takes beside the outlines."""

    class_id: int
    options: HullOptions
    name: str | None
    box_id: int | None


class BoxFromMasksJson(HullDraftJson):
    """A box to be made of its object's outlines in two frames or more."""

    class_id: Id
    views: Annotated[list[ViewJson], Field(min_length=2, max_length=MOST_VIEWS)]
    name: Name | None = Field(None, description="default: the class's name, with a number where it is taken")
    box_id: Id | None = Field(
        None, description="of an object that has masks and no box yet; these outlines take the place of all its masks"
    )

    @property
    def asked(self) -> BoxRequest:
        """All but the outlines, as `ObjectBoxes.from_masks` takes it."""
        return {"class_id": self.class_id, "options": self.options, "name": self.name, "box_id": self.box_id}


def outlines_of(taken: Photographed, views: Sequence[ViewJson]) -> list[tuple[int, tuple[Polygon, ...]]]:
    """Outlines by frame; masks are read as images of their frames' cameras.

    Raises:
        BadInput: a frame is not there, or a mask cannot be used; the message names the frame.
    """
    outlines: list[tuple[int, tuple[Polygon, ...]]] = []
    for view in views:
        camera = camera_of(taken, view.frame)
        try:
            outlines.append((view.frame, view.outline(camera)))
        except BadInput as error:
            raise BadInput(f"frame {view.frame}: {error}") from error
    return outlines


_MASK_FILE = TypeAdapter(list[BoxFromMasksJson])


def read_masks_file(path: Path | str, data: bytes) -> list[BoxFromMasksJson]:
    """The boxes that a JSON file asks for: one object as `POST …/boxes/from-masks` takes it, or a list of them.

    Args:
        path: what to call the file that `data` was read from.

    Raises:
        BadFile: it is no such file; the message says which object and which of its values.
    """
    given = strict_json(data, path)
    try:
        return _MASK_FILE.validate_python(given if isinstance(given, list) else [given])
    except ValidationError as error:
        place, message = first_fault(error)
        where = place_text(place[1:]).lstrip(".")
        if isinstance(given, list):
            raise BadFile(
                path, f"object {place[0]}{':' if not where else f', {where}:'} {message}; counted from 0"
            ) from error
        raise BadFile(path, f"{where}: {message}" if where else message) from error


def hull_json(hull: VisualHull) -> dict[str, Any]:
    """A hull as the API answers it; metres, in the world."""
    return {
        "volume": hull.volume,
        "centre_of_mass": hull.centre_of_mass.tolist(),
        "vertices": hull.vertices.tolist(),
        "faces": hull.faces.tolist(),
    }


def made_box_json(box: VirtualBox, hull: VisualHull) -> dict[str, Any]:
    """A box that was made of outlines, as the API answers it."""
    assert box.hull_options is not None
    return {**box_json(box), "hull": {**hull_json(hull), "position": box.hull_options.position}}
