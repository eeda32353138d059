"""What CVAT is told of a dataset before its labels: tasks, labels and their attributes, as XML and as JSON.

CVAT imports labels into a project or task that has them already: `labels.json` is what its label constructor takes
under `Raw`.
"""

import colorsys
import json
from collections.abc import Sequence

from ars_web.datasets.writers.texts import xml_text

GOLDEN_RATIO = 0.618034
"""Hues that are this far apart stay apart, however many there are."""

_ATTRIBUTES: tuple[tuple[str, bool, str, str, tuple[str, ...]], ...] = (
    ("box_id", False, "text", "", ()),
    ("visible", True, "number", "1", ("0", "1", "0.0001")),
    ("truncated", True, "number", "0", ("0", "1", "0.0001")),
)
"""Of every label: name, whether it changes from frame to frame, how it is entered, default, and values (of a number
the least, the largest and the step)."""


def color_of(place: int) -> str:
    """`#rrggbb` of the class at this place."""
    shares = colorsys.hsv_to_rgb(place * GOLDEN_RATIO % 1.0, 0.75, 0.95)
    return "#" + "".join(f"{round(share * 255):02x}" for share in shares)


def labels_xml(class_names: Sequence[str], shape: str) -> str:
    """`<labels>` of a project or a task; `shape` is CVAT's name for what a label is."""
    attributes = "".join(
        f"            <attribute>\n              <name>{name}</name>\n              <mutable>{mutable}</mutable>\n"
        f"              <input_type>{kind}</input_type>\n              <default_value>{default}</default_value>\n"
        f"              <values>{chr(10).join(values)}</values>\n            </attribute>\n"
        for name, mutable, kind, default, values in _ATTRIBUTES
    )
    labels = "".join(
        f"        <label>\n          <name>{xml_text(name)}</name>\n          <color>{color_of(place)}</color>\n"
        f"          <type>{shape}</type>\n          <attributes>\n{attributes}          </attributes>\n"
        "        </label>\n"
        for place, name in enumerate(class_names)
    )
    return f"      <labels>\n{labels}      </labels>\n"


def labels_json(class_names: Sequence[str], shape: str) -> str:
    """The labels as CVAT's label constructor takes them."""
    attributes = [
        {"name": name, "mutable": mutable, "input_type": kind, "default_value": default, "values": list(values)}
        for name, mutable, kind, default, values in _ATTRIBUTES
    ]
    labels = [
        {"name": name, "color": color_of(place), "type": shape, "attributes": attributes}
        for place, name in enumerate(class_names)
    ]
    return json.dumps(labels, indent=2) + "\n"
