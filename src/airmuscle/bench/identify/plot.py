"""Figure of a fit: modelled against measured values, and residuals."""

import textwrap
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import BLACK, BLUE, RED, Array, given_axes, new_figure
from ...recording.columns import display_scale

MANY_POINTS = 1000
"""Number of points from which markers are small."""


def plot_fit(
    quantity: str, measured: Array, modelled: Array, censored: npt.NDArray[np.bool_], title: str, *, ax: Any = None
) -> Any:
    """Parity plot on the left, residuals (model - measured) on the right, with censored rows marked.

    quantity            name of the fitted quantity
    measured, modelled  its values [SI], shape (N,) each
    censored            mask of the censored rows, shape (N,)

    ax                  Axes of the parity plot, or a sequence of two, also for the residuals; None makes a figure

    Returns `ax`, or the Matplotlib figure. Raises ParameterError for another `ax`.
    """
    factor, unit = display_scale(quantity)
    values = (measured * factor, modelled * factor)
    if ax is not None:
        axes = given_axes(ax, 1, "plot of a fit")
        _draw_parity(axes[0], quantity, unit, *values, censored)
        axes[0].legend(loc="upper left", frameon=False, fontsize=8)
        if len(axes) > 1:
            _draw_residuals(axes[1], quantity, unit, *values, censored)
        return ax
    figure, (left, right) = new_figure(1, 2, width=7.0, height=3.4)
    _draw_parity(left, quantity, unit, *values, censored)
    _draw_residuals(right, quantity, unit, *values, censored)
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    figure.suptitle(textwrap.fill(title, 90, max_lines=2, placeholder=" …"), fontsize=9)
    return figure


def _groups(
    measured: Array, censored: npt.NDArray[np.bool_]
) -> Iterator[tuple[npt.NDArray[np.bool_], str, dict[str, Any]]]:
    """Rows, label and marker of the uncensored and of the censored points, where there are any."""
    size = 3.5 if measured.size < MANY_POINTS else 1.8
    for rows, colour, marker, label in ((~censored, BLUE, "o", "measured"), (censored, RED, "x", "censored (bound)")):
        if np.any(rows):
            yield rows, label, {"color": colour, "marker": marker, "linestyle": "none", "markersize": size}


def _draw_parity(
    axes: Any, quantity: str, unit: str, measured: Array, modelled: Array, censored: npt.NDArray[np.bool_]
) -> None:
    ends = [min(measured.min(), modelled.min()), max(measured.max(), modelled.max())]
    axes.plot(ends, ends, color=BLACK, linewidth=0.8, label="model = measured", zorder=3)
    for rows, label, style in _groups(measured, censored):
        axes.plot(measured[rows], modelled[rows], label=label, **style)
    axes.set(xlabel=f"measured {quantity} [{unit}]", ylabel=f"modelled {quantity} [{unit}]")


def _draw_residuals(
    axes: Any, quantity: str, unit: str, measured: Array, modelled: Array, censored: npt.NDArray[np.bool_]
) -> None:
    for rows, _, style in _groups(measured, censored):
        axes.plot(measured[rows], (modelled - measured)[rows], **style)
    axes.axhline(0.0, color=BLACK, linewidth=0.8)
    axes.set(xlabel=f"measured {quantity} [{unit}]", ylabel=f"residual (model - measured) [{unit}]")
