"""The commands of `ars-web labels`: labels of other programs, into a session."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ars_web import arguments as take
from ars_web.terminal import note, print_json, print_table

if TYPE_CHECKING:
    from ars_web.masks.label_import import ImportedObject

AUTHOR = "cli"
"""Who the edit log says made the changes of this program."""

app = typer.Typer(help="Labels of other programs, into a session.", rich_markup_mode=None)


@app.callback()
def labels() -> None:
    """Labels of other programs, into a session."""


@app.command("import")
def import_labels(
    session: take.Session,
    path: Annotated[
        Path,
        typer.Argument(
            metavar="PATH", help="A BOP scene's folder, a COCO file, a CVAT XML file, or a VOC or YOLO folder."
        ),
    ],
    kind: Annotated[
        str, typer.Option("--format", metavar="FORMAT", help="auto, bop, coco, cvat, voc or yolo.")
    ] = "auto",
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Say what would come in, and store nothing.")] = False,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """Add the labels of a file beside the recording, as one step that one undo takes back.

    Posed objects that rest become boxes; outlines become masks, and the box of their hull; rectangles in three frames
    or more become the box that fits them. What does not come in is told, counted by reason.
    """
    from ars_web.annotations.registry import READERS
    from ars_web.masks.label_import import LabelImport
    from ars_web.masks.label_import_json import imported_json
    from ars_web.sessions.editing import SessionEditor
    from ars_web.sessions.store import SessionStore

    if kind != "auto" and kind not in READERS:
        raise typer.BadParameter(f"{kind!r} is none of auto, {', '.join(READERS)}", param_hint="--format")
    with SessionStore(sessions) as store:
        importing = LabelImport(store, SessionEditor(store))
        made = importing.run(store.find(session), path, format=kind, dry_run=dry_run, author=AUTHOR)
    if as_json:
        print_json(imported_json(made))
        return
    if made.objects:
        print_table(("class", "box", "made of", "masks", "size, mm", ""), [_row(one) for one in made.objects])
    classes = f", new classes: {', '.join(made.new_classes)}" if made.new_classes else ""
    verb = "would come in" if dry_run else "came in"
    print(f"{made.boxes} boxes and {made.masks} masks {verb} ({made.format}){classes}")
    if made.left_out:
        print("left out:")
        print_table(
            ("count", "reason", "such as"), [(one.count, one.reason, "; ".join(one.examples)) for one in made.left_out]
        )
    for line in made.notes:
        note(f"ars-web: {line}")


def _row(one: "ImportedObject") -> tuple[object, ...]:
    size = "" if one.box is None else " x ".join(f"{1000 * side:.1f}" for side in one.box.size)
    named = one.name or ("" if one.box_id is None else f"object {one.box_id}")
    return one.class_name, named, one.made_of or "", one.masks, size, one.note
