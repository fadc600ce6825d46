"""Figure of a dynamic fit: measured and modelled quantities of one record over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ....core.plotting import BLACK, RED, given_axes, legend_outside, new_figure
from ....recording import Recording
from ....recording.display_units import display_scale


def plot_record(measured: Recording, modelled: Recording, names: Sequence[str], ax: Any = None) -> Any:
    """Plot the observed quantities of a record, measured and modelled, one panel each.

    `ax` is an Axes, or a sequence of one for each quantity, and is returned; without it a figure is returned.
    Raises ParameterError if `ax` contains too few Axes.
    """
    figure = None
    if ax is None:
        figure, axes = new_figure(len(names), 1, height=0.6 + 1.7 * len(names), sharex=True, squeeze=False)
        panels = list(axes[:, 0])
        figure.suptitle(measured.origin, fontsize=9)
    else:
        panels = given_axes(ax, len(names), "plot of a dynamic fit")
    for name, axis in zip(names, panels, strict=False):
        factor, unit = display_scale(name)
        dots = {"linestyle": "none", "marker": ".", "markersize": 2.5, "color": BLACK}
        axis.plot(modelled["time"], factor * measured[name], label="measured", **dots)
        axis.plot(modelled["time"], factor * modelled[name], color=RED, linewidth=1.0, label="model")
        axis.set_ylabel(f"{name}\n[{unit}]" if unit else name)
        legend_outside(axis)
    panels[len(names) - 1].set_xlabel("time [s]")
    return figure if ax is None else ax
