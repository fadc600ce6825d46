"""Figure of the amplitude of a friction over the pressure, of several runs and of their joint fit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ....core.plotting import LINES, given_axes, legend_below, new_figure, relabel_in_display_units
from ....physics.muscle.friction import Friction
from .agreement import RunAgreement


def plot_amplitudes(runs: Sequence[RunAgreement], friction: Friction, name: str, *, ax: Any = None) -> Any:
    """Half the range of the friction force over the gauge pressure: each run alone with two standard errors, and joint.

    Returns `ax`, an Axes, or a new Matplotlib figure if it is None. Raises ParameterError for another `ax`.
    """
    pressure = np.array([run.pressure for run in runs])
    own, error, joint = (
        np.array([getattr(run, field) for run in runs])
        for field in ("amplitude", "amplitude_stderr", "joint_amplitude")
    )
    factors = np.array([float(friction.pressure_factor(p)) for p in pressure])
    grid = np.linspace(0.0, 1.05 * pressure.max(), 100)
    at_one = float(np.mean(joint[factors > 0] / factors[factors > 0])) if (factors > 0).any() else 0.0
    figure = None
    if ax is None:
        figure, axes = new_figure(width=6.0, height=3.9)
    else:
        axes = given_axes(ax, 1, "plot of a friction")[0]
    axes.plot(
        grid / 1e3,
        [at_one * float(friction.pressure_factor(p)) for p in grid],
        color=LINES[1],
        label="joint fit",
    )
    axes.errorbar(
        pressure / 1e3, own, 2.0 * error, fmt="o", color=LINES[0], capsize=3, label="each run alone, 2 standard errors"
    )
    axes.set(xlabel="gauge pressure [kPa]", ylabel="friction, half its range [N]", title=name, ylim=(0.0, None))
    relabel_in_display_units([axes])
    if figure is None:
        axes.legend(loc="best", frameon=False, fontsize=8)
        return ax
    legend_below(figure, axes, 2)
    return figure
