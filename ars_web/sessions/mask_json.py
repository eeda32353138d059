"""Masks as the JSON of the API."""

from typing import Any

from ars_web.sessions.model import Mask
from ars_web.sessions.outlines import corners_of, polygons_json


def mask_json(mask: Mask) -> dict[str, Any]:
    """The mask as the API answers it; `points` is how many corners its polygons have."""
    return {
        **mask_json_without_outline(mask),
        "polygons": polygons_json(mask.polygons),
        "points": corners_of(mask.polygons),
    }


def mask_json_without_outline(mask: Mask) -> dict[str, Any]:
    """The mask without `polygons` and `points`."""
    return {
        "id": mask.id,
        "box_id": mask.box_id,
        "class_id": mask.class_id,
        "frame": mask.frame,
        "origin": mask.origin,
        "accepted": mask.accepted,
        "revision": mask.revision,
    }
