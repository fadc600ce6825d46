"""Agreement of a run with a friction that was fitted to several runs, and the figure of the amplitudes."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ....core.arrays import Array
from ....core.plotting import LINES, given_axes, legend_below, new_figure, relabel_in_display_units
from ....physics.muscle.friction import Friction
from ..model_evidence import effective_sample_size, f_test_p_value
from .result import SIGNIFICANCE_LEVEL, HysteresisFit
from .search import free_parameters
from .series import LoopSeries

MAX_DEVIATION = 0.2
"""Maximum rms difference of the joint friction from that of a run, relative to the larger one of the two (chosen)."""


@dataclasses.dataclass(frozen=True)
class RunAgreement:
    """The friction of one run, from its data alone and from the joint fit.

    `amplitude` [N] is half the range of the friction force in the run, of the joint law with the factor that fits this
    run best, with its standard error; `joint_amplitude` [N] that of the joint fit. `deviation` is the rms difference of
    the two friction forces, the law fitted to this run alone and the joint one, relative to the larger of their rms
    values, after the static curve has taken up its part. `p_value` is that of the F test of a friction of its own.
    """

    origin: str
    description: str
    pressure: float
    amplitude: float
    amplitude_stderr: float
    joint_amplitude: float
    deviation: float
    p_value: float

    @property
    def disagrees(self) -> bool:
        """Whether the run contradicts the joint friction, significantly and by more than the allowed deviation."""
        return self.deviation > MAX_DEVIATION and self.p_value < SIGNIFICANCE_LEVEL

    def __str__(self) -> str:
        return (
            f"{self.origin} ({self.description}): {self.amplitude:.3g} N (standard error "
            f"{self.amplitude_stderr:.2g} N) from this run, {self.joint_amplitude:.3g} N from all runs, deviation "
            f"{100 * self.deviation:.0f} %"
        )


def force_amplitude(run: LoopSeries, friction: Friction) -> float:
    """Half the range of the friction force [N] at the fitted rows."""
    return 0.5 * float(np.ptp(run.friction_force(friction)[run.fitted_rows]))


def agreement_of_run(joint: Friction, own: HysteresisFit, description: str, pressure: float) -> RunAgreement:
    """Compare the friction fitted to one run alone with the joint friction."""
    run, rows = own.series, own.series.fitted_rows
    curve = run.design_matrix[rows]
    joint_force = _without_static_part(run.friction_force(joint)[rows], curve)
    own_force = _without_static_part(run.friction_force(own.friction)[rows], curve)
    target = _without_static_part(run.target[rows], curve)
    power = float(joint_force @ joint_force) or 1e-300
    factor = -float(joint_force @ target) / power
    rest = target + factor * joint_force
    variance = float(np.mean(rest**2)) * rest.size / max(effective_sample_size(rest), 1.0)
    joint_residuals, residuals = run.fitted_residuals(joint), run.fitted_residuals(own.friction)
    free = free_parameters(own.friction)
    largest = max(_rms(own_force), _rms(joint_force), 1e-300)
    amplitude = force_amplitude(run, joint)
    return RunAgreement(
        origin=run.origin,
        description=description,
        pressure=pressure,
        amplitude=factor * amplitude,
        amplitude_stderr=float(np.sqrt(variance / power)) * amplitude,
        joint_amplitude=amplitude,
        deviation=_rms(own_force - joint_force) / largest,
        p_value=f_test_p_value(
            float(np.mean(joint_residuals**2)),
            float(np.mean(residuals**2)),
            effective_sample_size(residuals),
            curve.shape[1] + free,
            free,
        ),
    )


def _without_static_part(force: Array, curve: Array) -> Array:
    """The force minus its projection on the columns of the static curve, which takes up this part."""
    return np.asarray(force - curve @ np.linalg.lstsq(curve, force, rcond=None)[0])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


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
