"""Figure of a fit: modelled against measured values, and residuals."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np
import numpy.typing as npt

from ..core.arrays import Array
from ..core.plotting import BLACK, BLUE, RED, new_figure

_DISPLAY_UNITS = {"force": (1.0, "N"), "contraction": (100.0, "%"), "pressure": (1e-3, "kPa")}

MANY_POINTS = 1000
"""Number of points from which markers are small."""


def plot_fit(quantity: str, measured: Array, modelled: Array, censored: npt.NDArray[np.bool_], title: str) -> Any:
    """Parity plot on the left, residuals (model - measured) on the right, with censored rows marked.

    quantity            name of the fitted quantity
    measured, modelled  its values [SI], shape (N,) each
    censored            mask of the censored rows, shape (N,)

    Returns a Matplotlib figure.
    """
    factor, unit = _DISPLAY_UNITS[quantity]
    residuals = (modelled - measured) * factor
    measured, modelled = measured * factor, modelled * factor
    figure, (left, right) = new_figure(1, 2, width=7.0, height=3.4)
    ends = [min(measured.min(), modelled.min()), max(measured.max(), modelled.max())]
    left.plot(ends, ends, color=BLACK, linewidth=0.8, label="model = measured", zorder=3)
    for rows, colour, marker, label in (
        (~censored, BLUE, "o", "measured"),
        (censored, RED, "x", "censored (bound)"),
    ):
        if np.any(rows):
            size = 3.5 if measured.size < MANY_POINTS else 1.8
            style = {"color": colour, "marker": marker, "linestyle": "none", "markersize": size}
            left.plot(measured[rows], modelled[rows], label=label, **style)
            right.plot(measured[rows], residuals[rows], **style)
    right.axhline(0.0, color=BLACK, linewidth=0.8)
    left.set(xlabel=f"measured {quantity} [{unit}]", ylabel=f"modelled {quantity} [{unit}]")
    right.set(xlabel=f"measured {quantity} [{unit}]", ylabel=f"residual (model - measured) [{unit}]")
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    figure.suptitle(textwrap.fill(title, 90, max_lines=2, placeholder=" …"), fontsize=9)
    return figure
