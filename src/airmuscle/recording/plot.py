"""Columns of a recording over its time, one axis each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.plotting import LINES, new_figure
from .columns import quantity_of
from .recording import Recording

_DISPLAY_UNITS = {
    "pressure": (1e-3, "kPa"), "contraction": (100.0, "%"), "length": (1e3, "mm"), "position": (1e3, "mm"),
    "volume": (1e6, "cm³"), "air_mass": (1e3, "g"), "mass_flow": (1e3, "g/s"),
}  # fmt: skip
"""Units that people read more easily than SI."""


def plot_recording(recording: Recording, names: Sequence[str] = ()) -> Any:
    """A Matplotlib figure of the named columns, or of all, over time, or over the row where there is no time."""
    chosen = [name for name in (names or recording) if name != "time"]
    timed = "time" in recording
    across = recording["time"] if timed else np.arange(1, len(recording) + 1)
    style = {"linestyle": "-"} if timed else {"linestyle": "none", "marker": "o", "markersize": 2.5}
    figure, axes = new_figure(
        max(len(chosen), 1), 1, height=0.7 + 1.15 * max(len(chosen), 1), sharex=True, squeeze=False
    )
    for i, (name, axis) in enumerate(zip(chosen, axes[:, 0], strict=False)):
        factor, unit = display_scale(name)
        axis.plot(across, recording[name] * factor, color=LINES[i % len(LINES)], **style)
        axis.set_ylabel(f"{name}\n[{unit}]" if unit else name)
    axes[-1, 0].set_xlabel("time [s]" if timed else "row")
    figure.align_ylabels()
    figure.suptitle(recording.origin, fontsize=9)
    return figure


def display_scale(name: str) -> tuple[float, str]:
    """The factor and the unit in which a column is shown."""
    quantity = quantity_of(name)
    if quantity is None:
        return 1.0, ""
    return _DISPLAY_UNITS.get(name.rpartition(".")[2], (1.0, "-" if quantity.unit == "1" else quantity.unit))
