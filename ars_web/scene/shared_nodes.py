"""What all views share and one of them may not want to see."""

from collections.abc import Iterable

import viser


class SharedNodes:
    """Hides nodes of the shared scene from one view, and shows them again.

    A client's node stands before the shared one of the same name, and takes that one's children with it.
    """

    def __init__(self, client: viser.ClientHandle, names: Iterable[str]) -> None:
        self._client = client
        self._names = tuple(names)
        self._shadows: list[viser.FrameHandle] = []

    def show(self, visible: bool) -> None:
        """Whether this view shows them."""
        if visible:
            for shadow in self._shadows:
                shadow.remove()
            self._shadows = []
        elif not self._shadows:
            scene = self._client.scene
            self._shadows = [scene.add_frame(name, show_axes=False, visible=False) for name in self._names]
