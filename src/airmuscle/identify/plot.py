"""The figure of a fit: model against measurement, and the errors over it."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np

from ..core.plotting import BLACK, BLUE, RED, new_figure
from .result import Fit

_DISPLAY_UNITS = {"force": (1.0, "N"), "contraction": (100.0, "%"), "pressure": (1e-3, "kPa")}


def plot_fit(fit: Fit) -> Any:
    """Parity on the left, errors on the right; rows cut off at the ends of the range of force stand out."""
    factor, unit = _DISPLAY_UNITS[fit.fitted_quantity.name]
    measured = fit.recording[fit.fitted_quantity.name] * factor
    modelled, errors = fit.modelled * factor, fit.residuals * factor
    figure, (parity, residual) = new_figure(1, 2, width=7.0, height=3.4)
    ends = [min(measured.min(), modelled.min()), max(measured.max(), modelled.max())]
    parity.plot(ends, ends, color=BLACK, linewidth=0.8, label="model = measured")
    for rows, colour, marker, label in (
        (fit.censoring == 0, BLUE, "o", "measured"),
        (fit.censoring != 0, RED, "x", "cut off, a bound only"),
    ):
        if np.any(rows):
            style = {"color": colour, "marker": marker, "linestyle": "none", "markersize": 3.5}
            parity.plot(measured[rows], modelled[rows], label=label, **style)
            residual.plot(measured[rows], errors[rows], **style)
    residual.axhline(0.0, color=BLACK, linewidth=0.8)
    name = fit.fitted_quantity.name
    parity.set(xlabel=f"measured {name} [{unit}]", ylabel=f"modelled {name} [{unit}]")
    residual.set(xlabel=f"measured {name} [{unit}]", ylabel=f"model less measured [{unit}]")
    figure.legend(*parity.get_legend_handles_labels(), loc="outside lower center", ncols=3, frameon=False, fontsize=8)
    title = f"{type(fit.model).__name__} fitted to {fit.recording.origin}"
    figure.suptitle(textwrap.fill(title, 90), fontsize=9)
    return figure
