"""Which frame of a session to outline an object in next."""

from ars_web.errors import BadInput
from ars_web.geometry.next_view import SuggestedView, suggest_views
from ars_web.geometry.view_guess import FrameRows, Guess, guess_of_box, guess_of_hull, guesses_of_view
from ars_web.geometry.visual_hull import visual_hull
from ars_web.masks.views import hull_of, photographs, views_of
from ars_web.sessions.model import SessionState
from ars_web.sessions.store import SessionStore


def next_frame(store: SessionStore, sid: str, state: SessionState, box_id: int) -> SuggestedView | None:
    """The frame in which an object's outline would do most for its labels, after its accepted masks, by its hull, its
    box, or what is drawn of it so far; None where no frame shows it.

    Raises:
        ViewsDisagree: there is no box, and the masks are of no one object.
    """
    taken = photographs(store, sid)
    rows = FrameRows(taken.cameras, taken.frames.camera_ids, taken.frames.Ts_world_camera)
    drawn = [mask.frame for mask in state.masks_of(box_id) if mask.accepted]
    others = [box.box for box in state.boxes.values() if box.id != box_id]
    guesses = _guesses(store, sid, state, box_id, rows)
    found = suggest_views(guesses, drawn, rows, others=others) if guesses else []
    return found[0] if found else None


def _guesses(store: SessionStore, sid: str, state: SessionState, box_id: int, rows: FrameRows) -> list[Guess]:
    box = state.boxes.get(box_id)
    if box is not None:
        return guess_of_box(box.box) if box.hull is None else guess_of_hull(hull_of(store, sid, box))
    masks = [(mask.frame, mask.polygons) for mask in state.masks_of(box_id) if mask.accepted]
    views = views_of(photographs(store, sid), masks)
    if len(views) > 1:
        return guess_of_hull(visual_hull(views))
    try:
        return guesses_of_view(views[0], rows) if views else []
    except BadInput:
        return []  # no other frame shows what is drawn
