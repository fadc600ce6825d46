"""Plot style shared by all figures: size, fonts, colours suited to print and colour blindness; axes
of a caller.
"""

import functools
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .annotation import abridged
from .display import heading_scale
from .errors import ParameterError

BLACK = "#000000"
ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
RED = "#D55E00"
PURPLE = "#CC79A7"
"""Colour palette of Okabe and Ito (2008)."""

LINES = (BLUE, RED, GREEN, PURPLE, ORANGE, SKY, BLACK)
"""Line colours in the order of the curves."""
DASHES = ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)), (0, (8, 2)))
"""Line styles in the order of the curves, which remain distinguishable in greyscale print."""
MARKERS = ("o", "s", "^", "D", "v", "x", "+")
"""Markers in the order of the curves."""
MAX_VECTOR_MARKERS = 2000
"""Number of markers in a figure above which they are an image in SVG files (chosen): as vectors
they take most of the time of a report, and a browser draws them slowly."""

_STYLE: Any = {
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.labelsize": 9,
    "legend.fontsize": 8,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.4,
    "lines.markersize": 4,
    "legend.frameon": False,
    "figure.dpi": 110,
    "savefig.dpi": 200,
    "svg.hashsalt": "airmuscle",
    "svg.fonttype": "path",
    "figure.autolayout": False,
    "figure.constrained_layout.use": False,
}


_UNDATED = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
"""Metadata by format, without the time of writing."""


def new_figure(
    rows: int = 1, columns: int = 1, *, width: float = 6.3, height: float = 3.6, **subplots: Any
) -> Any:
    """Return a Matplotlib figure and its axes in the shared style with constrained layout.

    `width` and `height` are in inches. The figure has no window and no global state; write it with
    `save`. As the last line of a cell of a notebook it shows its picture.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with mpl.rc_context(_STYLE):
        figure: Any = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots(rows, columns, **subplots)
    figure._repr_png_ = functools.partial(
        _picture, figure
    )  # asked for by IPython, which knows figures of pyplot only
    return figure, axes


def _picture(figure: Any) -> bytes:
    return rendered(figure, ("png",), _STYLE["figure.dpi"])["png"]


def save(figure: Any, path: Any) -> None:
    """Write a figure in the format of the path's suffix, in a folder that is made where it is
    missing; equal content gives identical bytes.
    """
    suffix = str(path).rpartition(".")[2]
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    with open(path, "wb") as file:
        file.write(rendered(figure, (suffix,))[suffix])


def rendered(
    figure: Any, formats: tuple[str, ...] = ("svg", "png"), dots_per_inch: float | None = None
) -> dict[str, bytes]:
    """A figure in several formats, by format, with one layout; equal content gives identical bytes.

    `dots_per_inch` is the resolution of an image, that of a report if None.
    """
    import matplotlib as mpl

    relabel_in_display_units(figure.axes)
    _apply_text_style(figure)
    lines = [
        line
        for axes in figure.axes
        for line in axes.lines
        if line.get_linestyle() in ("None", "none", "", " ")
    ]
    if sum(len(line.get_xdata(orig=False)) for line in lines) > MAX_VECTOR_MARKERS:
        for line in lines:
            line.set_rasterized(True)
    files = {}
    layout = figure.get_layout_engine()
    with mpl.rc_context(_STYLE):
        if (
            layout is not None and dots_per_inch is None
        ):  # with an engine, `savefig` would draw the figure once more
            figure.draw_without_rendering()
            figure.set_layout_engine(None)
        try:
            for name in formats:
                buffer = io.BytesIO()
                options = {"dpi": dots_per_inch} if dots_per_inch else {}
                figure.savefig(
                    buffer,
                    format=name,
                    metadata=_UNDATED.get(name),
                    **options,
                )
                files[name] = buffer.getvalue()
        finally:
            if layout is not None and dots_per_inch is None:
                figure.set_layout_engine(layout)
    return files


def _apply_text_style(figure: Any) -> None:
    """Set the font sizes of titles and legends, which Matplotlib takes from the global style on
    creation.
    """
    legends = [
        *figure.legends,
        *(a.get_legend() for a in figure.axes if a.get_legend() is not None),
    ]
    for legend in legends:
        legend.set_frame_on(False)
        for text in (*legend.get_texts(), legend.get_title()):
            text.set_fontsize(_STYLE["legend.fontsize"])
    for axes in figure.axes:
        axes.title.set_fontsize(_STYLE["axes.titlesize"])


def legend_outside(axes: Any, **options: Any) -> Any:
    """Add a legend to the right of the axes, where it covers no data; inside those of a caller
    without a layout, of whose figure it would be cut off."""
    style = {
        "fontsize": 8,
        "title_fontsize": 8,
        "frameon": False,
        **options,
    }  # the shared style ends with `new_figure`
    if axes.get_figure(root=True).get_layout_engine() is None:
        return axes.legend(loc="best", **style)
    return axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, **style)


def legend_below(figure: Any, axes: Any, columns: int = 2) -> Any:
    """Add one legend below all axes of a figure, with the curves of one of them."""
    handles, labels = axes.get_legend_handles_labels()
    return figure.legend(
        handles, labels, loc="outside lower center", ncols=columns, frameon=False, fontsize=8
    )


def given_axes(ax: Any, count: int, what: str) -> list[Any]:
    """The Matplotlib axes that a caller gives as `ax`: one Axes, or a sequence or an array of at
    least `count`.

    `what` is named in messages. Raises ParameterError for anything else.
    """
    candidates = ax.ravel() if isinstance(ax, np.ndarray) else ax
    axes = (
        list(candidates)
        if isinstance(candidates, np.ndarray | Sequence) and not isinstance(candidates, str | bytes)
        else [candidates]
    )
    if not all(hasattr(item, "plot") and hasattr(item, "set_xlabel") for item in axes):
        raise ParameterError(
            f"{what}: ax is {abridged(ax)}; it must be a Matplotlib Axes or a sequence of Axes."
        )
    if len(axes) < count:
        raise ParameterError(
            f"{what}: {count} panels need {count} Axes, but {len(axes)}"
            f" {'is' if len(axes) == 1 else 'are'} given; allowed range: at least {count}. Name"
            f" fewer columns, or make them with plt.subplots({count}, 1)."
        )
    return axes


def relabel_in_display_units(many: Iterable[Any]) -> None:
    """Relabel Matplotlib axes whose label ends with a unit, `pressure [kPa]`, in the chosen display
    unit.

    The data stay as they are; ticks are placed at round numbers of the chosen unit. Nothing changes
    without a choice.
    """
    for axes in many:
        for axis in (axes.xaxis, axes.yaxis):
            factor, label = heading_scale(axis.get_label_text())
            if label != axis.get_label_text() and axis.get_scale() == "linear":
                axis.set_label_text(label)
                _rescale_ticks(axis, factor)


def _rescale_ticks(axis: Any, factor: float) -> None:
    """Place and print the ticks of an axis at round numbers of `factor` times its data."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    class ScaledLocator(MaxNLocator):
        def __call__(self) -> Any:
            low, high = axis.get_view_interval()
            return np.asarray(self.tick_values(factor * low, factor * high)) / factor

    axis.set_major_locator(ScaledLocator(nbins=7, steps=[1, 2, 2.5, 5, 10]))
    axis.set_major_formatter(
        FuncFormatter(lambda value, _: f"{round(factor * value, 9) + 0.0:g}".replace("-", "−"))
    )
