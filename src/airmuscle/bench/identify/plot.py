"""Figure of a fit: modelled against measured values, and residuals."""

import textwrap
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
    x, y = measured * factor, modelled * factor
    figure, axes = new_figure(1, 2, width=7.0, height=3.4) if ax is None else (None, given_axes(ax, 1, "plot of a fit"))
    ends = [min(x.min(), y.min()), max(x.max(), y.max())]
    axes[0].plot(ends, ends, color=BLACK, linewidth=0.8, label="model = measured", zorder=3)
    for rows, colour, marker, label in ((~censored, BLUE, "o", "measured"), (censored, RED, "x", "censored (bound)")):
        if np.any(rows):
            size = 3.5 if x.size < MANY_POINTS else 1.8
            style = {"color": colour, "marker": marker, "linestyle": "none", "markersize": size}
            for axis, drawn in zip(axes[:2], (y, y - x), strict=False):
                axis.plot(x[rows], drawn[rows], label=label, **style)
    axes[0].set(xlabel=f"measured {quantity} [{unit}]", ylabel=f"modelled {quantity} [{unit}]")
    for axis in axes[1:2]:
        axis.axhline(0.0, color=BLACK, linewidth=0.8)
        axis.set(xlabel=f"measured {quantity} [{unit}]", ylabel=f"residual (model - measured) [{unit}]")
    if figure is None:
        axes[0].legend(loc="upper left", frameon=False, fontsize=8)
        return ax
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    figure.suptitle(textwrap.fill(title, 90, max_lines=2, placeholder=" …"), fontsize=9)
    return figure
