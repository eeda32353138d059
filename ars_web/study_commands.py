"""The commands of `ars-web` that look at a session: its coverage, where to look next, a report.

They stand beside the commands of `cli.py`, in no group.
"""

from pathlib import Path
from typing import Annotated

import typer

from ars_web import arguments as take
from ars_web.terminal import print_json, print_table, write_json

app = typer.Typer(rich_markup_mode=None)


@app.command()
def coverage(
    session: take.Session,
    box: take.OneBox = None,
    class_name: take.OneClass = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Write a picture (.png) or all numbers (.json).")
    ] = None,
    azimuth_bins: Annotated[
        int, typer.Option("--azimuth-bins", metavar="N", min=1, max=360, help="Bins round the box's z axis.")
    ] = 36,
    polar_bins: Annotated[
        int, typer.Option("--polar-bins", metavar="N", min=1, max=360, help="Bins from +z down to -z.")
    ] = 18,
    shape: take.Shape = None,
    min_visible: take.MinVisible = None,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """From where the objects are seen: views by direction, and how many directions have none.

    A frame counts where an export with the same options would label the object; views that a class's symmetry makes
    look alike count as one.
    """
    from ars_web.datasets.coverage import called, chosen_boxes, coverage_of, session_views
    from ars_web.geometry.sphere_bins import SphereBins
    from ars_web.sessions.store import SessionStore
    from ars_web.studies.coverage_json import coverage_json
    from ars_web.studies.coverage_picture import coverage_png

    if out is not None and out.suffix.lower() not in (".png", ".json"):
        raise typer.BadParameter(f"{out} ends neither in .png nor in .json", param_hint="--out")
    if box is not None and class_name is not None:
        raise typer.BadParameter("give --box or --class, not both: a box is of one class", param_hint="--class")
    with SessionStore(sessions) as store:
        snapshot = store.snapshot(store.find(session))
    bins = SphereBins(azimuth_bins, polar_bins)
    options = take.export_options({"shape": shape, "min_visible": min_visible})
    class_id = None if class_name is None else take.class_named(snapshot.state, class_name).id
    chosen = chosen_boxes(snapshot, box_id=box, class_id=class_id)
    views = session_views(snapshot, options)
    found = coverage_of(views, bins, chosen)
    if out is not None and out.suffix.lower() == ".png":
        title = f"{snapshot.state.name}: {called(snapshot, box_id=box, class_id=class_id)}"
        out.write_bytes(coverage_png(found, title=title))
    elif out is not None:
        write_json(out, coverage_json(found).model_dump(mode="json"))
    if as_json:
        print_json(coverage_json(found).model_dump(mode="json"))
        return
    parts = [([place], {"box_id": views.box_ids[place]}) for place in chosen]
    if box is None:
        parts += [
            ([place for place in chosen if views.class_ids[place] == one], {"class_id": one})
            for one in sorted({views.class_ids[place] for place in chosen})
        ]
    rows: list[tuple[object, ...]] = []
    for places, meant in parts:
        of_part = coverage_of(views, bins, places)
        kind = "box" if "box_id" in meant else "class"
        name = called(snapshot, **meant)
        rows.append(
            (kind, name, of_part.frames, of_part.views, _percent(of_part.empty_fraction), _percent(of_part.empty_area))
        )
    print_table(("", "of", "frames", "views", "empty bins", "of all directions unseen"), rows)
    if out is not None:
        print(out)


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"
