"""How every figure of airmuscle looks: one size, one set of colours that survive print and colour blindness."""

from __future__ import annotations

from typing import Any

BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, RED, PURPLE = (
    "#000000", "#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#D55E00", "#CC79A7",
)  # fmt: skip
"""The palette of Okabe and Ito (2008)."""

LINES = (BLUE, RED, GREEN, PURPLE, ORANGE, SKY, BLACK)
"""The order in which curves take colours."""
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)), (0, (8, 2)))
"""The order in which they take dashes, so that a grey print still tells them apart."""
MARKERS = ("o", "s", "^", "D", "v", "x", "+")

_STYLE = {
    "font.size": 9, "axes.titlesize": 9, "axes.labelsize": 9, "legend.fontsize": 8, "xtick.labelsize": 8,
    "ytick.labelsize": 8, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
    "grid.alpha": 0.25, "grid.linewidth": 0.5, "lines.linewidth": 1.4, "lines.markersize": 4,
    "legend.frameon": False, "figure.dpi": 110, "savefig.dpi": 200, "svg.hashsalt": "airmuscle",
    "svg.fonttype": "path",
}  # fmt: skip


def new_figure(rows: int = 1, columns: int = 1, *, width: float = 6.3, height: float = 3.6, **subplots: Any) -> Any:
    """A Matplotlib figure and its axes in the house style, laid out so that nothing overlaps (inches).

    The figure belongs to no window and no global state; save it with `figure.savefig`.
    """
    import matplotlib as mpl  # noqa: PLC0415  (slow to import, needed only for figures)
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415
    from matplotlib.figure import Figure  # noqa: PLC0415

    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(rows, columns, **subplots)
    return figure, axes


def save(figure: Any, path: Any) -> None:
    """Write a figure byte-identically for the same content, to the format that the path's suffix names."""
    import matplotlib as mpl  # noqa: PLC0415

    with mpl.rc_context(_STYLE):
        metadata = {"Date": None} if str(path).endswith(".svg") else None
        figure.savefig(path, metadata=metadata)


def legend_outside(axes: Any, **options: Any) -> Any:
    """A legend beside the axes, where it covers no data."""
    return axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, **options)
