"""A report as one HTML file that needs nothing beside it: what a template makes of values.

What comes from data is escaped; there is no script in a report, and nothing in it points elsewhere.
"""

import base64
from functools import cache
from pathlib import Path

from jinja2 import ChoiceLoader, Environment, FileSystemLoader, PackageLoader, StrictUndefined

from ars_web import __version__
from ars_web.reporting.whole_file import write_whole


def report_page(template: str, /, *, templates: Path | None = None, **values: object) -> str:
    """What the template of that name under `templates/` makes of values; it extends `base.html`.

    With `templates` it is looked for in that folder first. A value that the template wants and that is not there raises
    jinja2's UndefinedError: a template's mistake.
    """
    return _environment(templates).get_template(template).render(version=__version__, **values)


def write_page(page: str, file: Path) -> None:
    """Write a page whole or not at all; its folder is made where it is missing.

    Raises:
        BadInput: it cannot be written.
    """
    write_whole(file, page.encode(errors="backslashreplace"))


def data_uri(content: bytes, *, media_type: str) -> str:
    """Bytes as an address that holds them, for an `img`."""
    return f"data:{media_type};base64,{base64.b64encode(content).decode()}"


@cache
def _environment(templates: Path | None) -> Environment:
    own = PackageLoader("ars_web.reporting")
    return Environment(
        loader=own if templates is None else ChoiceLoader([FileSystemLoader(templates), own]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
