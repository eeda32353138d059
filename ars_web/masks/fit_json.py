"""What a box is to be fitted to, and how well it fits, as the JSON of the API and of the command line."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from ars_web.errors import BadFile
from ars_web.geometry.box_parameters import Orientation
from ars_web.geometry.box_sighting import Sighting, sighting_of_region
from ars_web.geometry.mask_regions import region
from ars_web.masks.box_fitting import FittedBox
from ars_web.masks.masks_json import MOST_VIEWS, Coordinate, MaybeOutlineJson, ViewJson, outlines_of
from ars_web.masks.views import Photographed, camera_of, views_of
from ars_web.sessions.boxes_json import Flag, Id, box_json
from ars_web.sessions.strict_json import first_fault, place_text, strict_json


class SeenJson(MaybeOutlineJson):
    """Where the object is in one frame: the box round it, or its outline."""

    frame: Id
    bbox: tuple[Coordinate, Coordinate, Coordinate, Coordinate] | None = Field(
        None,
        description="x0 y0 x1 y1, image coordinates: of the part in the image, whose sides at its border the object"
        " may go beyond; or, where it reaches out of the image, of the whole object",
    )

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        if (self.bbox is None) == (self.polygons is None and self.mask_png is None):
            raise ValueError("give bbox, polygons or mask_png, one of them")
        return self


class FitJson(BaseModel):
    """What to fit a box to, and how."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    views: Annotated[list[SeenJson], Field(min_length=1, max_length=MOST_VIEWS)] | None = Field(
        None, description="default: the object's accepted masks"
    )
    orientation: Orientation | None = Field(
        None,
        description="upright: position, turn about the world's z and size; free: turned anyhow; default: upright where"
        " the box stands upright",
    )
    dry_run: Flag = Field(False, description="whether to answer what the box would be, and leave it as it is")


def sightings_of(taken: Photographed, views: Sequence[SeenJson]) -> list[Sighting]:
    """The views with their frames' cameras and poses.

    Raises:
        BadInput: a frame is not there or comes twice, or a box or an outline cannot be used; the message names the
            frame.
    """
    drawn = [ViewJson(frame=v.frame, polygons=v.polygons, mask_png=v.mask_png) for v in views if v.bbox is None]
    outlined = {
        view.frame: sighting_of_region(view.frame, view.camera, view.T_world_camera, region(view.polygons))
        for view in views_of(taken, outlines_of(taken, drawn))
    }
    return [
        outlined[view.frame]
        if view.bbox is None
        else Sighting(
            view.frame,
            camera_of(taken, view.frame),
            taken.frames.Ts_world_camera[view.frame],
            np.array(view.bbox),
        )
        for view in views
    ]


def read_fit_file(path: Path | str, data: bytes) -> FitJson:
    """What a JSON file asks a box to be fitted to, as `POST …/refine` takes it.

    Args:
        path: what to call the file that `data` was read from.

    Raises:
        BadFile: it is no such file; the message says which of its values.
    """
    try:
        return FitJson.model_validate(strict_json(data, path))
    except ValidationError as error:
        place, message = first_fault(error)
        where = place_text(place).lstrip(".")
        raise BadFile(path, f"{where}: {message}" if where else message) from error


def fitted_json(fitted: FittedBox) -> dict[str, Any]:
    """A fitted box as the API answers it."""
    fit = fitted.fit
    return {
        "box": box_json(fitted.box),
        "residuals": [
            {"frame": frame, "px": px, "rms_px": rms, "outlier": outlier}
            for frame, px, rms, outlier in zip(
                fitted.frames,
                fit.residuals_px.tolist(),
                np.sqrt(np.mean(fit.residuals_px**2, axis=1)).tolist(),
                fit.outliers.tolist(),
                strict=True,
            )
        ],
        "rms_px": fit.rms_px,
        "moved_mm": 1e3 * fitted.moved,
        "corner_error_mm": 1e3 * fit.corner_error,
        "warnings": list(fitted.warnings),
    }
