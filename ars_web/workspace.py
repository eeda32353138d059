"""What one person sees and does in the workspace: the words that the live line and the scene speak to each other.

The page owns its view: it says what it wants to see (`ViewState`), and the scene shows that. What happens in the scene,
a click or a drag, comes back as a `ViewEvent`; the page decides what follows from it. Neither side imports the other.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, Protocol

from ars_web.geometry.box import Box
from ars_web.sessions.model import VirtualBox

Tool = Literal["select", "move", "rotate", "resize"]


@dataclass(frozen=True)
class CoverageSight:
    """A sphere round a box: how many views there are of it, or of all of its class, from each direction.

    Attributes:
        box_id: what the sphere stands round.
        whole_class: whether views of all objects of the box's class count, in their own boxes' frames.
        azimuth_bins, polar_bins: as many cells of equal area are drawn.
        min_visible: views in which less of an object is seen do not count.
        chosen_bin: a bin of equal angles that is outlined: azimuth bin * polar bins + polar bin.
        chosen_cell: or a cell of equal area.
    """

    box_id: int
    whole_class: bool = False
    azimuth_bins: int = 18
    polar_bins: int = 9
    min_visible: float = 0.0
    chosen_bin: int | None = None
    chosen_cell: int | None = None


@dataclass(frozen=True)
class ProposedCamera:
    """Where a camera could stand next, in the world: position in metres, and how it is turned."""

    position: tuple[float, float, float]
    wxyz: tuple[float, float, float, float]


@dataclass(frozen=True)
class ViewState:
    """What a page wants its scene to show.

    Attributes:
        mode: `scene`: free camera; `frame`: the camera locked to the frame, its photo behind the boxes.
        frame: the current frame; in `scene` its frustum holds its photo.
        selected: the box that is edited; None: none.
        tool: what can be dragged on the selected box.
        axes: along whose axes the gizmo moves and turns.
        snap_length: metres, of positions and sizes; 0: none.
        snap_angle: radians; 0: none.
        upright: boxes turn about the world's z axis only.
        hidden: boxes that this page does not show.
        dark: the page's theme.
        coverage: the sphere that is shown; None: none.
        tour: cameras proposed next, in their order.
    """

    mode: Literal["scene", "frame"] = "scene"
    frame: int = 0
    selected: int | None = None
    tool: Tool = "select"
    axes: Literal["box", "world"] = "box"
    snap_length: float = 0.0
    snap_angle: float = 0.0
    upright: bool = False
    hidden: frozenset[int] = frozenset()
    dark: bool = True
    coverage: CoverageSight | None = None
    tour: tuple[ProposedCamera, ...] = ()


@dataclass(frozen=True, eq=False)
class BoxPreview:
    """A box as it would be, while it is being dragged or typed; nothing of it is stored."""

    box_id: int
    box: Box


@dataclass(frozen=True)
class Look:
    """Turn the free camera to something: all of the recording, the selected box, or the current frame's camera."""

    at: Literal["all", "selected", "frame"]


@dataclass(frozen=True)
class NewBox:
    """Add a box of a class where the view looks at; the class's usual size."""

    class_id: int


ViewAction = Look | NewBox


@dataclass(frozen=True)
class Picked:
    """Something was clicked in the scene: a box, a frame's camera, or (both None) nothing."""

    box_id: int | None = None
    frame: int | None = None


@dataclass(frozen=True)
class DirectionPicked:
    """The coverage's sphere was clicked: in which bin of equal angles (azimuth bin * polar bins + polar bin), and in
    which cell of equal area, after folding by the object's symmetry."""

    bin: int
    cell: int


@dataclass(frozen=True)
class Entered:
    """The scene has been told all of a frame: its photo and the camera's place. `milliseconds` since it was asked."""

    frame: int
    milliseconds: float


@dataclass(frozen=True, eq=False)
class Dragged:
    """A box is being dragged, in this view or another; at `end` it has been stored, at `cancel` it is as before.

    Attributes:
        text: what changes, for beside the pointer: `X +12.0 mm`, `Z 4.5°`, `Size X 85.0 mm`.
        own: whether it is this view that drags.
    """

    phase: Literal["start", "move", "end", "cancel"]
    preview: BoxPreview
    text: str
    own: bool


@dataclass(frozen=True, eq=False)
class Conflicted:
    """A drag could not be stored, since the box was changed meanwhile.

    Attributes:
        yours: as it was dragged.
        current: as it is now; None: deleted.
    """

    detail: str
    yours: BoxPreview
    current: VirtualBox | None


@dataclass(frozen=True)
class Refused:
    """What was asked for could not be done; `detail` says why and what to do, in words for a person."""

    detail: str


ViewEvent = Picked | DirectionPicked | Entered | Dragged | Conflicted | Refused


class SceneViews(Protocol):
    """The scene, as the live line uses it. All methods are thread-safe, quick, and never block on a browser.

    A view is one page, by a random name that it chose (`view`). The page's scene is an iframe that connects by that
    name, before or after the live line does, and again after each interruption.
    """

    def attach(self, sid: str, view: str, *, author: str, send: Callable[[ViewEvent], None]) -> None:
        """A page is there. `send` may be called by any thread."""
        ...

    def detach(self, sid: str, view: str) -> None:
        """The page is gone, or its line was interrupted; a drag in progress is cancelled."""
        ...

    def show(self, sid: str, view: str, state: ViewState) -> None:
        """Show this, whatever was shown before."""
        ...

    def act(self, sid: str, view: str, action: ViewAction) -> None:
        """Do this once."""
        ...

    def preview(self, sid: str, view: str, preview: BoxPreview | None) -> None:
        """Show a box as it is being typed, to all views of the session; None: no more."""
        ...


@dataclass(frozen=True)
class ScenePage:
    """The page that a scene's iframe shows, the same for all scenes.

    Attributes:
        body: HTML, compressed by gzip.
        etag: changes when the page does.
        content_security_policy: what the page needs, and no more.
    """

    body: bytes
    etag: str
    content_security_policy: str


@dataclass(frozen=True)
class SceneAddress:
    """Where one view of a session's scene is served, for the proxy alone.

    Attributes:
        url: a websocket on loopback.
        headers: what proves that the proxy asks, and says for whom.
    """

    url: str
    headers: dict[str, str] = field(repr=False)


class ScenePages(Protocol):
    """The scene, as the proxy in front of it uses it. Both may take a while, and belong on a worker thread."""

    def page(self) -> ScenePage:
        """The scene's page."""
        ...

    def address(self, sid: str, *, view: str, author: str) -> SceneAddress:
        """Where the session's scene is served; it is opened if it is not open.

        Args:
            view: the page's name for its view; empty: a browser that only looks.
            author: of the edits made in the scene.

        Raises:
            NotFound: there is no such session.
            BadInput: the view is somebody else's page.
        """
        ...

    def close(self) -> None:
        """Close all scenes; may be called twice."""
        ...
