"""The commands of `ars-web` that look at a session: its coverage, where to look next, a report.

They stand beside the commands of `cli.py`, in no group.
"""

from pathlib import Path
from typing import Annotated

import typer

from ars_web import arguments as take
from ars_web.option_groups import DatasetChoices, ViewChoices, grouped
from ars_web.terminal import print_json, print_table, write_json

app = typer.Typer(rich_markup_mode=None)


@app.command()
@grouped
def coverage(
    session: take.Session,
    of: ViewChoices,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Write a picture (.png) or all numbers (.json).")
    ] = None,
    min_visible: take.MinVisible = None,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """From where the objects are seen: views by direction, and how many directions have none.

    A frame counts where an export with the same options would label the object; views that a class's symmetry makes
    look alike count as one.
    """
    from ars_web.datasets.coverage import called, chosen_boxes, coverage_of, session_views
    from ars_web.reporting.whole_file import write_whole
    from ars_web.sessions.store import SessionStore
    from ars_web.studies.coverage_json import coverage_json
    from ars_web.studies.coverage_picture import coverage_png

    if out is not None and out.suffix.lower() not in (".png", ".json"):
        raise typer.BadParameter(f"{out} ends neither in .png nor in .json", param_hint="--out")
    with SessionStore(sessions) as store:
        snapshot = store.snapshot(store.find(session))
    options = take.export_options({"shape": of.shape, "min_visible": min_visible})
    objects = of.objects(snapshot)
    chosen = chosen_boxes(snapshot, **objects)
    views = session_views(snapshot, options)
    found = coverage_of(views, of.bins, chosen)
    if out is not None and out.suffix.lower() == ".png":
        title = f"{snapshot.state.name}: {called(snapshot, **objects)}"
        write_whole(out, coverage_png(found, title=title))
    elif out is not None:
        write_json(out, coverage_json(found).model_dump(mode="json"))
    if as_json:
        print_json(coverage_json(found).model_dump(mode="json"))
        return
    parts = [([place], {"box_id": views.box_ids[place]}) for place in chosen]
    if of.box is None:
        parts += [
            ([place for place in chosen if views.class_ids[place] == one], {"class_id": one})
            for one in sorted({views.class_ids[place] for place in chosen})
        ]
    rows: list[tuple[object, ...]] = []
    for places, meant in parts:
        of_part = coverage_of(views, of.bins, places)
        kind = "box" if "box_id" in meant else "class"
        name = called(snapshot, **meant)
        rows.append(
            (kind, name, of_part.frames, of_part.views, _percent(of_part.empty_fraction), _percent(of_part.empty_area))
        )
    print_table(("", "of", "frames", "views", "empty bins", "of all directions unseen"), rows)
    if out is not None:
        print(out)


@app.command()
@grouped
def tour(
    session: take.Session,
    of: ViewChoices,
    count: Annotated[int, typer.Option("--count", metavar="N", min=1, max=2000, help="Views at most.")] = 20,
    distance: Annotated[
        str | None,
        typer.Option("--distance", metavar="MIN:MAX", help="Metres to the object; default: as the frames have it."),
    ] = None,
    height: Annotated[
        str | None,
        typer.Option("--height", metavar="MIN:MAX", help="The camera's z, metres; default: as the frames have it."),
    ] = None,
    tilt: Annotated[
        str | None,
        typer.Option("--tilt", metavar="MIN:MAX", help="Degrees below the horizontal; default: as the frames have it."),
    ] = None,
    min_visible: Annotated[
        float | None,
        typer.Option(
            "--min-visible",
            metavar="SHARE",
            help="How much of an object is seen, in frames that count and in views; default: any, and half.",
        ),
    ] = None,
    start_frame: Annotated[
        int | None, typer.Option("--start-frame", metavar="N", min=0, help="Begin at this frame; default: the last.")
    ] = None,
    hand_eye: Annotated[
        Path | None,
        typer.Option(
            "--hand-eye",
            metavar="FILE",
            help="x y z qx qy qz qw of the camera in the wrist; default: the recording's own.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Write all (.json), or poses of the wrist as robot_poses (.txt)."),
    ] = None,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """Where to look next: camera poses that fill what no frame has seen of the objects, as a short tour.

    Each view shows its object whole, large enough and not behind others, and keeps to the limits and 5 cm from every
    box. What stands between two views is not looked at: getting there is the robot's to plan.
    """
    import math

    from ars_web.datasets.coverage import chosen_boxes, session_views
    from ars_web.errors import BadInput
    from ars_web.recordings.ars import camera_in_wrist
    from ars_web.reporting.whole_file import write_whole
    from ars_web.sessions.store import SessionStore
    from ars_web.studies.recorded_wrist import recorded_wrist
    from ars_web.studies.tour import TourRequest, plan_tour
    from ars_web.studies.tour_json import tour_json, wrist_rows

    if out is not None and out.suffix.lower() not in (".json", ".txt"):
        raise typer.BadParameter(f"{out} ends neither in .json nor in .txt", param_hint="--out")
    degrees = take.number_range(tilt, "--tilt")
    try:
        request = TourRequest(
            bins=of.bins,
            count=count,
            distance=take.number_range(distance, "--distance"),
            height=take.number_range(height, "--height"),
            tilt=None if degrees is None else (math.radians(degrees[0]), math.radians(degrees[1])),
            min_visible=min_visible,
            shape=of.shape,
            start_frame=start_frame,
        )
    except BadInput as error:
        raise typer.BadParameter(str(error)) from error
    with SessionStore(sessions) as store:
        summary = store.summary(store.find(session))
        snapshot = store.snapshot(summary.id)
    chosen = chosen_boxes(snapshot, **of.objects(snapshot))
    if hand_eye is None:
        wrist = recorded_wrist(summary.format, Path(summary.source))
        T_wrist_camera, unknown = wrist.T_wrist_camera, wrist.unknown
    else:
        T_wrist_camera, unknown = camera_in_wrist(hand_eye), None
    wants_wrist = out is not None and out.suffix.lower() == ".txt"
    if wants_wrist and T_wrist_camera is None:
        raise BadInput(f"{out} is to hold poses of the wrist, but {unknown}; give --hand-eye FILE, or write a .json")
    found = plan_tour(snapshot, session_views(snapshot, request.options), chosen, request)
    told = tour_json(found, T_wrist_camera=T_wrist_camera)
    if out is not None and T_wrist_camera is not None and wants_wrist:
        write_whole(out, wrist_rows(found, T_wrist_camera).encode())
    elif out is not None:
        write_json(out, told.model_dump(mode="json"))
    if as_json:
        print_json(told.model_dump(mode="json"))
        return
    rows = [
        (
            place,
            snapshot.state.boxes[stop.box_id].name,
            " ".join(f"{value:.3f}" for value in stop.T_world_camera[:3, 3]),
            f"{stop.distance:.3f}",
            f"{math.degrees(stop.tilt):.1f}",
            len(stop.labelled),
            len(stop.fills),
        )
        for place, stop in enumerate(found.stops, start=1)
    ]
    print_table(("view", "looks at", "camera at x y z", "distance", "tilt", "labels", "fills cells"), rows)
    for line in found.lines():
        print(line)
    if out is not None:
        print(out)


@app.command()
@grouped
def report(
    session: take.Session,
    *,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE.html", help="The page; default: the session's name and -report.html, here."
        ),
    ] = None,
    choices: DatasetChoices,
    sessions: take.Sessions = take.SESSIONS,
    as_json: take.Json = False,
) -> None:
    """What an export would hold, and what to mend before training: one page, with pictures, that needs nothing else.

    Options decide labels and splits as those of `export` do. With --json the facts are printed instead, and a page is
    written only where --out says so.
    """
    from ars_web.datasets.file_names import safe
    from ars_web.reporting.page import write_page
    from ars_web.sessions.store import SessionStore
    from ars_web.studies.report_page import session_page
    from ars_web.studies.session_report import session_report
    from ars_web.studies.session_study import study_session

    if out is not None and out.suffix.lower() not in (".html", ".htm"):
        raise typer.BadParameter(f"{out} does not end in .html", param_hint="--out")
    options = take.export_options(choices.given())
    with SessionStore(sessions) as store:
        sid = store.find(session)
        snapshot, recorded = store.snapshot(sid), store.summary(sid)
    study = study_session(snapshot, options)
    facts = session_report(study, recorded)
    if as_json:
        print_json(facts.model_dump(mode="json"))
    if out is None and not as_json:
        out = Path(f"{safe(snapshot.state.name)}-report.html")
    if out is not None:
        write_page(session_page(study, facts), out)
    if not as_json:
        for warning in facts.warnings:
            print(f"{'grave' if warning.grave else 'warning'}: {warning.says}")
        print(out)


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"
