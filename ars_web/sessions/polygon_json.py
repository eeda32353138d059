"""Planar polygons in space as the JSON of the API and of files."""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field, ValidationError

from ars_web.errors import BadFile
from ars_web.sessions.boxes_json import Coordinate, Strict
from ars_web.sessions.strict_json import first_fault, place_text, strict_json

MOST_CORNERS = 10_000
"""Of a polygon."""

Corner = tuple[Coordinate, Coordinate, Coordinate]


class PolygonJson(Strict):
    """A planar polygon that an object is."""

    polygon: Annotated[list[Corner], Field(min_length=3, max_length=MOST_CORNERS)] = Field(
        description="its corners in order, metres; they lie in a plane, and the outline does not cross itself"
    )
    frame_of: Literal["box", "world"] = Field(description="whose coordinates they are in")

    @property
    def corners(self) -> Float[np.ndarray, "k 3"]:
        """(k, 3) metres, in the frame that it says."""
        return np.array(self.polygon, dtype=np.float64)


def read_polygon_file(path: Path | str, data: bytes) -> PolygonJson:
    """The polygon in a JSON file, which is what `PUT …/boxes/{box_id}/polygon` takes; `path` is what it is called.

    Raises:
        BadFile: it is no such object; the message says which of its values.
    """
    try:
        return PolygonJson.model_validate(strict_json(data, path))
    except ValidationError as error:
        place, message = first_fault(error)
        where = place_text(place).lstrip(".")
        raise BadFile(path, f"{where}: {message}" if where else message) from error
