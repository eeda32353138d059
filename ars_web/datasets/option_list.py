"""The export options as a list that people can be asked by: derived from `options.py`, where their meaning is."""

from dataclasses import dataclass
from typing import Any, Literal, cast

from ars_web.datasets.options import ExportOptions

OptionType = Literal["integer", "number", "choice", "integers", "texts", "range"]

_TYPES: dict[tuple[str, str], OptionType] = {
    ("integer", ""): "integer",
    ("number", ""): "number",
    ("string", ""): "choice",
    ("array", "integer"): "integers",
    ("array", "string"): "texts",
    ("array", ""): "range",
}


@dataclass(frozen=True)
class OptionChoice:
    """One value that an option can have."""

    value: str
    meaning: str


@dataclass(frozen=True)
class ExportOption:
    """An option of exports.

    Attributes:
        name: as in the options' JSON, with dots: `split.train` is `{"split": {"train": ...}}`.
        title: its name for people.
        meaning: one line for people.
        type: of its value; `integers` and `texts` are lists, a `range` is two numbers, from and to.
        optional: whether it may be null, which then is its default, and is none of the choices.
        choices: of a `choice`; empty for others.
        default: its value where nobody says, or the choice that means the same.
        minimum, maximum: of numbers; None: no bound.
    """

    name: str
    title: str
    meaning: str
    type: OptionType
    optional: bool
    choices: tuple[OptionChoice, ...]
    default: Any
    minimum: float | None
    maximum: float | None


def export_options() -> tuple[ExportOption, ...]:
    """All options in the order in which they are declared, without those that leave no choice."""
    found = _options(ExportOptions.model_json_schema(), ExportOptions().model_dump(mode="json"))  # pyright: ignore[reportCallIssue]
    return tuple(option for option in found if option.type != "choice" or len(option.choices) > 1)


def _options(schema: dict[str, Any], defaults: dict[str, Any]) -> list[ExportOption]:
    found: list[ExportOption] = []
    for name, field in cast(dict[str, dict[str, Any]], schema["properties"]).items():
        if "$ref" in field:
            inner = schema["$defs"][field["$ref"].rpartition("/")[2]]
            found += [_option(f"{name}.{key}", of, defaults[name][key]) for key, of in inner["properties"].items()]
        else:
            found.append(_option(name, field, defaults[name]))
    return found


def _option(name: str, field: dict[str, Any], default: Any) -> ExportOption:
    kinds = [kind for kind in field.get("anyOf", [field]) if kind.get("type") != "null"]
    (kind,) = kinds
    meanings: dict[str, str] = field.get("x-meanings", {})
    return ExportOption(
        name=name,
        title=field["title"],
        meaning=field["description"],
        type=_TYPES[kind["type"], kind.get("items", {}).get("type", "")],
        optional="anyOf" in field and "x-null-means" not in field,
        choices=tuple(OptionChoice(value, meanings[value]) for value in kind.get("enum", ())),
        default=field.get("x-null-means") if default is None else default,
        minimum=kind.get("minimum"),
        maximum=kind.get("maximum"),
    )
