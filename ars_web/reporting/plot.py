"""Plots in one look, by matplotlib: figures without its global state, as PNG that is the same for the same data.

matplotlib takes long to import, so it is imported where a figure is made.
"""

from io import BytesIO
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS: tuple[str, ...] = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Okabe and Ito's, those that are dark enough for lines on white first."""

DOTS_PER_INCH = 144


def new_figure(width: float, height: float) -> "Figure":
    """An empty figure of that many inches, for the caller's axes; laid out so that nothing is cut."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=DOTS_PER_INCH, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def plain_axes(axes: "Axes") -> None:
    """Axes as all plots here have them: a thin frame at the left and below, a faint grid."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color("#8b98a9")
    axes.tick_params(colors="#56636f", labelsize=8)
    axes.grid(visible=True, color="#e4e9ee", linewidth=0.8)
    axes.set_axisbelow(True)


def png(figure: "Figure") -> bytes:
    """A figure as PNG, without the time of its making."""
    stream = BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return stream.getvalue()
