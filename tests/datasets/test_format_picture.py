"""Pictures of one labelled frame, as each format holds it."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest

from ars_web.datasets.format_picture import format_picture, telling_frame
from ars_web.datasets.options import ExportOptions
from ars_web.datasets.registry import WRITERS
from ars_web.errors import BadInput, NotFound
from ars_web.recordings.images import read_image
from ars_web.sessions.model import SessionSnapshot

Make = Callable[..., SessionSnapshot]


def options(**changes: object) -> ExportOptions:
    return ExportOptions.model_validate(changes)


@pytest.mark.parametrize("kind", WRITERS)
def test_the_labels_are_drawn_on_the_photo(make_snapshot: Make, kind: str) -> None:
    snapshot = make_snapshot(12)
    picture = cv2.imdecode(np.frombuffer(format_picture(snapshot, format=kind, options=options()), np.uint8), 1)
    photo = read_image(snapshot.frames.images[telling_frame(snapshot, options())])
    scale = picture.shape[1] // photo.shape[1]
    enlarged = cv2.resize(photo, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
    differs = (np.abs(picture.astype(int) - enlarged).max(axis=2) > 40).mean()
    assert 0.005 < differs < 0.6


def test_labels_that_are_dropped_are_not_drawn(make_snapshot: Make) -> None:
    snapshot = make_snapshot(12)
    whole = format_picture(snapshot, format="yolo", options=options(), index=3)
    assert format_picture(snapshot, format="yolo", options=options(), index=3) == whole
    assert format_picture(snapshot, format="yolo", options=options(min_area_px=1e6), index=3) != whole


def test_the_frame_has_as_many_labels_as_any(make_snapshot: Make) -> None:
    snapshot = make_snapshot(12)
    # The last two frames look away.
    assert telling_frame(snapshot, options()) < 10


def test_what_is_not_there_is_refused(make_snapshot: Make) -> None:
    snapshot = make_snapshot(3)
    with pytest.raises(NotFound, match="no frame 3"):
        format_picture(snapshot, format="yolo", options=options(), index=3)
    with pytest.raises(BadInput, match="export format 'xyz' is unknown"):
        format_picture(snapshot, format="xyz", options=options())
