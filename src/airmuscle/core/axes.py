"""Axes of a figure: those that a caller gives, panels of a new figure, and axes relabelled in display units."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from .annotation import abridged
from .display import heading_scale
from .errors import ParameterError


def given_axes(ax: Any, count: int, what: str) -> list[Any]:
    """The Matplotlib axes that a caller gives as `ax`: one Axes, or a sequence or an array of at least `count`.

    `what` is named in messages. Raises ParameterError for anything else.
    """
    axes = [ax] if hasattr(ax, "plot") and hasattr(ax, "set_xlabel") else _flat(ax)
    if axes is None or not all(hasattr(item, "plot") and hasattr(item, "set_xlabel") for item in axes):
        raise ParameterError(f"{what}: ax is {abridged(ax)}; it must be a Matplotlib Axes or a sequence of Axes.")
    if len(axes) < count:
        raise ParameterError(
            f"{what}: {count} panels need {count} Axes, but {len(axes)} {'is' if len(axes) == 1 else 'are'} given; "
            f"allowed range: at least {count}. Name fewer columns, or make them with plt.subplots({count}, 1)."
        )
    return axes


def _flat(ax: Any) -> list[Any] | None:
    """The items of a sequence or an array of any shape; None for anything else."""
    if isinstance(ax, np.ndarray):
        return list(ax.ravel())
    return list(ax) if isinstance(ax, Sequence) and not isinstance(ax, str | bytes) else None


def relabel_in_display_units(many: Iterable[Any]) -> None:
    """Relabel Matplotlib axes whose label ends with a unit, `pressure [kPa]`, in the chosen display unit.

    The data stay as they are; ticks are placed at round numbers of the chosen unit. Nothing changes without a choice.
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
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{round(factor * value, 9) + 0.0:g}".replace("-", "−")))
