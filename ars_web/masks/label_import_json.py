"""What came of a file of labels, as the JSON of the API and of the command line."""

from typing import Any

from ars_web.masks.label_import import ImportedLabels
from ars_web.sessions.boxes_json import transform_json


def imported_json(made: ImportedLabels) -> dict[str, Any]:
    """The counts, each object, and what is left out by reason."""
    return {
        "format": made.format,
        "revision": made.revision,
        "boxes": made.boxes,
        "masks": made.masks,
        "classes": list(made.new_classes),
        "objects": [
            {
                "class_name": one.class_name,
                "box_id": one.box_id,
                "name": one.name,
                "T_world_box": None if one.box is None else transform_json(one.box.T_world_box),
                "size": None if one.box is None else one.box.size.tolist(),
                "made_of": one.made_of,
                "masks": one.masks,
                "note": one.note,
            }
            for one in made.objects
        ],
        "left_out": [
            {"reason": one.reason, "count": one.count, "examples": list(one.examples)} for one in made.left_out
        ],
        "notes": list(made.notes),
    }
