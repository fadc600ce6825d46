"""Plot of the columns of a recording over time, one axis each."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..core.arrays import Array
from ..core.plotting import LINES, new_figure
from .display_units import display_scale


def plot_columns(columns: Mapping[str, Array], time: Array | None, title: str) -> Any:
    """A Matplotlib figure of columns (N,) over `time` (N,) [s], or over the row number if there is no time."""
    count = max(len(columns), 1)
    figure, axes = new_figure(count, 1, height=0.7 + 1.15 * count, sharex=True, squeeze=False)
    style = {"linestyle": "-"} if time is not None else {"linestyle": "none", "marker": "o", "markersize": 2.5}
    for i, (name, values) in enumerate(columns.items()):
        axis = axes[i, 0]
        factor, unit = display_scale(name)
        abscissa = time if time is not None else np.arange(1, len(values) + 1)
        axis.plot(abscissa, values * factor, color=LINES[i % len(LINES)], **style)
        axis.set_ylabel(f"{name}\n[{unit}]" if unit else name)
    axes[-1, 0].set_xlabel("time [s]" if time is not None else "row")
    figure.align_ylabels()
    figure.suptitle(title, fontsize=9)
    return figure
