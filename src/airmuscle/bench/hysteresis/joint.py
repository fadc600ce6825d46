"""Joint fit of one friction law to the loops of several runs, with a force scale that depends on
the pressure: its agreement with each run, and selection of the friction that is written."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...core import LINES, given_axes, legend_below, new_figure, relabel_in_display_units
from ...engine.distribution import DistributedCalls
from ...engine.processes import Workers, process_pool
from ...physics.muscle.friction import Friction, IdentifiedFriction, PressureScaledFriction
from ...report.chapter import Chapter, Plot
from ...report.parameter_tables import parameter_table
from ..estimation import effective_sample_size, format_p_value
from ..inspection import RELATIVE_BAND
from .loop_data import MILLIMETRES, DataLimits, combine_limits, limit_reservations
from .loop_result import LoopFit
from .result import SIGNIFICANCE_LEVEL, FrictionFit, HysteresisFit, Misfit, evidence, preferred_fit
from .search import LoopSeries, search_parameters

MAX_DEVIATION = 0.2
"""Maximum rms difference of the joint friction from that of a run, relative to the larger one of
the two (chosen).
"""


@dataclasses.dataclass(frozen=True)
class RunAgreement:
    """The friction of one run, from its data alone and from the joint fit.

    `amplitude` [N] is half the range of the friction force in the run, of the joint law with the
    factor that fits this run best, with its standard error; `joint_amplitude` [N] that of the joint
    fit. `deviation` is the rms difference of the two friction forces, the law fitted to this run
    alone and the joint one, relative to the larger of their rms values, after the static curve has
    taken up its part. `p_value` is that of the F test of a friction of its own.
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
        """Whether the run contradicts the joint friction, significantly and by more than the
        allowed deviation.
        """
        return self.deviation > MAX_DEVIATION and self.p_value < SIGNIFICANCE_LEVEL

    def __str__(self) -> str:
        return (
            f"{self.origin} ({self.description}): {self.amplitude:.3g} N (standard error"
            f" {self.amplitude_stderr:.2g} N) from this run, {self.joint_amplitude:.3g} N from all"
            f" runs, deviation {100 * self.deviation:.0f} %"
        )


def force_amplitude(run: LoopSeries, friction: Friction) -> float:
    """Half the range of the friction force [N] at the fitted rows."""
    return 0.5 * float(np.ptp(run.friction_force(friction)[run.fitted_rows]))


def agreement_of_run(
    joint: Friction, own: HysteresisFit, description: str, pressure: float
) -> RunAgreement:
    """Compare the friction fitted to one run alone with the joint friction."""
    run = own.series
    rows = own.series.fitted_rows
    curve = run.design_matrix[rows]
    forces = [
        force[rows]
        for force in (run.friction_force(joint), run.friction_force(own.friction), run.target)
    ]
    parts = [
        curve @ np.linalg.lstsq(curve, force, rcond=None)[0] for force in forces
    ]  # that the static curve takes up
    joint_force, own_force, target = (
        force - part for force, part in zip(forces, parts, strict=True)
    )
    power = float(joint_force @ joint_force) or 1e-300
    factor = -float(joint_force @ target) / power
    rest = target + factor * joint_force
    variance = float(np.mean(rest**2)) * rest.size / max(effective_sample_size(rest), 1.0)
    joint_misfit = Misfit.of(joint, (run,))
    misfit = Misfit.of(own.friction, (run,))
    largest = max(float(np.linalg.norm(force)) for force in (own_force, joint_force)) or 1e-300
    amplitude = force_amplitude(run, joint)
    deviation = float(np.linalg.norm(own_force - joint_force)) / largest
    stderr = float(np.sqrt(variance / power)) * amplitude
    p_value = misfit.p_value(joint_misfit._replace(parameters=curve.shape[1]))
    return RunAgreement(
        run.origin, description, pressure, factor * amplitude, stderr, amplitude, deviation, p_value
    )


@dataclasses.dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class JointFit(FrictionFit):
    """A friction law fitted to several runs together, each with its own static curve; forces in N.
    `friction` is a `PressureScaledFriction` if the runs justify a dependence on pressure;
    `scale_p_value` is that of its F test, NaN where the runs have one pressure."""

    series: tuple[LoopSeries, ...]
    agreement: tuple[RunAgreement, ...]
    scale_p_value: float

    @property
    def law(self) -> Friction:
        """The friction law without its force scale."""
        return (
            self.friction.inner
            if isinstance(self.friction, PressureScaledFriction)
            else self.friction
        )

    @property
    def limits(self) -> DataLimits:
        return combine_limits(tuple(run.limits for run in self.series))

    @property
    def reservations(self) -> tuple[str, ...]:
        different = "; in ".join(str(run) for run in self.agreement if run.disagrees)
        conditions = (
            (
                different,
                (
                    "The friction does not hold for all runs; half the range of its force is, in"
                    f" {different}."
                ),
            ),
            (
                self.repeat_rmse >= self.repeat_rmse_without_friction,
                "It does not lower the error on the second runs.",
            ),
        )
        reasons = [reason for holds, reason in conditions if holds]
        return (
            *reasons,
            *limit_reservations(self.friction, self.limits, self.weak_combinations, MILLIMETRES),
        )

    @property
    def scale_text(self) -> str:
        """The dependence of the friction on the pressure, as a sentence."""
        if isinstance(self.friction, PressureScaledFriction):
            ratio = self.friction.ambient_ratio
            reference = self.friction.reference_pressure / 1e3
            factor = (
                f"{ratio:.3g} {'-' if ratio > 1 else '+'} {abs(1.0 - ratio):.3g} "
                if ratio >= 5e-4
                else ""
            )
            text = (
                f"The friction depends on the gauge pressure p (F test,"
                f" {format_p_value(self.scale_p_value)}): the value at {reference:.4g} kPa is"
                f" multiplied by {factor}p/({reference:.4g} kPa)."
            )
            levels = {
                round(run.pressure / self.friction.reference_pressure, 1) for run in self.agreement
            }
            return (
                text
                if len(levels) > 2
                else f"{text} Two pressures determine this dependence but cannot test it."
            )
        if np.isnan(self.scale_p_value):
            return (
                "The runs have one pressure, so that the dependence of the friction on the pressure"
                " is not known."
            )
        return (
            "The data justify no dependence of the friction on the pressure (F test "
            f"{format_p_value(self.scale_p_value)})."
        )

    @property
    def verdict(self) -> str:
        """Whether the runs justify one friction, as sentences with the numbers."""
        text = (
            f"{self.name} fitted to {len(self.series)} runs together reduces the rms error from "
            f"{self.rmse_without_friction:.3g} to {self.rmse:.3g} N. {self.scale_text}"
        )
        return self._judged(text, "this friction for all runs", "second runs")

    def plot(self, *, ax: Any = None) -> Any:
        """Plot half the range of the friction force over the gauge pressure: each run alone with
        two standard errors, and the joint fit. `ax` is an Axes and is returned; without it a new
        figure is returned. Raises ParameterError for another `ax`."""
        fields = ("pressure", "amplitude", "amplitude_stderr", "joint_amplitude")
        pressure, alone, error, joint = (
            np.array([getattr(run, name) for run in self.agreement]) for name in fields
        )
        grid = np.linspace(0.0, 1.05 * pressure.max(), 100)
        at_runs, factors = (
            [float(self.friction.pressure_factor(p)) for p in pressures]
            for pressures in (pressure, grid)
        )
        acting = np.array(at_runs) > 0
        at_one = float(np.mean(joint[acting] / np.array(at_runs)[acting])) if acting.any() else 0.0
        figure, axes = (None, None) if ax is not None else new_figure(width=6.0, height=3.9)
        axes = axes or given_axes(ax, 1, "plot of a friction")[0]
        axes.plot(
            grid / 1e3, [at_one * factor for factor in factors], color=LINES[1], label="joint fit"
        )
        dots = {
            "fmt": "o",
            "color": LINES[0],
            "capsize": 3,
            "label": "each run alone, 2 standard errors",
        }
        axes.errorbar(pressure / 1e3, alone, 2.0 * error, **dots)
        labels = {
            "xlabel": "gauge pressure [kPa]",
            "ylabel": "friction, half its range [N]",
            "title": self.name,
        }
        axes.set(**labels, ylim=(0.0, None))
        relabel_in_display_units([axes])
        if figure is None:
            axes.legend(loc="best", frameon=False, fontsize=8)
            return ax
        legend_below(figure, axes, 2)
        return figure

    def chapter(self) -> Chapter:
        """The description of the fit: verdict, parameters, and friction over pressure."""
        of_runs = "half the range of the friction force of each run, and joint fit"
        plots = (
            Plot("joint-friction", f"Friction over pressure, {self.name}: {of_runs}.", self.plot),
        )
        heading = f"Parameters of {self.name} from all runs"
        tables = (parameter_table(self.friction, "joint-parameters", heading, brief=True),)
        references = (
            *self.friction.references,
            *(() if self.law is self.friction else self.law.references),
        )
        title = f"{self.name} fitted to {len(self.series)} runs"
        return Chapter(
            "joint-friction", title, self.verdict, tables=tables, plots=plots, references=references
        )


MIN_PRESSURE_RATIO = 1.2
"""Minimum ratio of the highest to the lowest pressure of the runs for a fitted dependence on
pressure (chosen).
"""
PRESSURE_QUANTILES = (0.01, 0.99)
"""Quantiles of the pressures of the fitted rows that count as the range of the data (chosen)."""


def loops_not_joined(loop_fits: Sequence[LoopFit]) -> tuple[str, ...]:
    """Sentences that name each loop that the joint fit does not use, and the reason."""
    reasons = [
        (f"{fit.loop.recording.origin}, {fit.loop.description}", _reason_against(fit))
        for fit in loop_fits
    ]
    return tuple(f"Not in the joint fit: {loop}. {reason}" for loop, reason in reasons if reason)


def _reason_against(loop_fit: LoopFit) -> str:
    """Why a loop is not fitted together with others, as sentences; empty if it is."""
    if not loop_fit.usable_in_plant:
        return "The friction acts along the pressure, which a plant cannot use."
    if not loop_fit.fits:
        return "No law could be fitted to it alone."
    return " ".join(loop_fit.fits[0].reservations_of_rows)


def fit_jointly(
    loop_fits: Sequence[LoopFit],
    *,
    progress: Callable[[str], None] | None = None,
    workers: Workers = 1,
) -> tuple[JointFit, ...]:
    """Fit every friction law to all loops together, lowest AICc first; empty for fewer than two
    usable loops.

    Each run has its own static curve, all runs have one friction. Its force scale depends on the
    pressure (`PressureScaledFriction`) if the F test and AICc favour this, and is constant
    otherwise.

    progress  called with a text for each law
    workers   number of processes, as in `compare`: a law is a task
    """
    usable = tuple(loop_fit for loop_fit in loop_fits if not _reason_against(loop_fit))
    if len(usable) < 2:
        return ()
    by_law: dict[type[Friction], list[HysteresisFit]] = {}
    for fit in (fit for loop_fit in usable for fit in loop_fit.fits):
        by_law.setdefault(type(fit.friction), []).append(fit)
    tasks = [law_fits for law_fits in by_law.values() if len(law_fits) == len(usable)]
    fits: dict[int, JointFit] = {}
    with process_pool(workers) as executor:
        for i, joint in DistributedCalls(executor, _fit_law, usable).completed(tasks):
            fits[i] = joint
            if progress is not None:
                progress(f"{joint.name}, all runs")
    return tuple(sorted((fits[i] for i in sorted(fits)), key=lambda fit: -fit.aicc_reduction))


def identified_friction(friction: Friction, runs: Sequence[LoopSeries]) -> Friction:
    """The friction with the range of pressure and speed of the runs it was fitted to."""
    pressures = [run.pressure[run.fitted_rows] for run in runs if run.pressure is not None]
    if not pressures:
        return friction
    low, high = np.quantile(np.concatenate(pressures), PRESSURE_QUANTILES)
    margin = RELATIVE_BAND * max(abs(low), abs(high), 1e3)
    speed = combine_limits(tuple(run.limits for run in runs)).high_speed
    identified = IdentifiedFriction(friction, float(low - margin), float(high + margin))
    if np.isfinite(speed) and speed > 0:
        return dataclasses.replace(identified, max_speed=speed)
    return identified


def _fit_law(usable: Sequence[LoopFit], law_fits: Sequence[HysteresisFit]) -> JointFit:
    """One law fitted to all runs, with a constant and with a pressure-dependent scale; the better
    of the two. The search of the scale starts from the run at the highest pressure, and a line
    through the amplitudes of all runs.
    """
    runs = [fit.series for fit in law_fits]
    scale_p_value = float("nan")
    known = [
        None if run.pressure is None else float(np.mean(run.pressure[run.fitted_rows]))
        for run in runs
    ]
    pressures = np.array(
        [float("-inf") if mean_pressure is None else mean_pressure for mean_pressure in known]
    )
    # -inf where a run has no pressure
    reference = int(np.argmax(pressures))
    lowest = float(pressures.min())
    friction, weak = search_parameters(law_fits[len(law_fits) // 2].friction, runs)
    if np.isfinite(lowest) and pressures[reference] > max(1e3, MIN_PRESSURE_RATIO * lowest):
        amplitudes = [force_amplitude(fit.series, fit.friction) for fit in law_fits]
        slope, offset = np.polyfit(pressures, amplitudes, 1)
        rounded = float(f"{pressures[reference]:.3g}")
        at_reference = offset + slope * rounded
        ratio = float(np.clip(offset / at_reference if at_reference > 0 else 1.0, 0.01, 5.0))
        scaled = search_parameters(
            PressureScaledFriction(law_fits[reference].friction, ratio, rounded), runs
        )
        small, large = (Misfit.of(candidate, runs) for candidate in (friction, scaled[0]))
        scale_p_value = large.p_value(small)
        if scale_p_value < SIGNIFICANCE_LEVEL and large.reduction_of_aicc(small) > 0:
            friction, weak = scaled
    repeats = [
        loop_fit.loop.series(*loop_fit.loop.repeat)
        for loop_fit in usable
        if loop_fit.loop.repeat is not None
    ]
    parts = zip(law_fits, usable, pressures.tolist(), strict=True)
    agreement = [
        agreement_of_run(friction, fit, loop_fit.loop.description, pressure)
        for fit, loop_fit, pressure in parts
    ]
    return JointFit(
        **evidence(friction, runs, repeats),
        weak_combinations=weak,
        series=tuple(runs),
        agreement=tuple(agreement),
        scale_p_value=scale_p_value,
    )


class SelectedFriction(NamedTuple):
    """A friction with the range of its data, its origin and verdict."""

    friction: Friction
    origin: str
    verdict: str


def select_friction(fits: Sequence[LoopFit], joint: Sequence[JointFit]) -> SelectedFriction | None:
    """The friction to write: that of all runs together or, if they are not several, of the only run
    a plant can use.
    """
    if joint:
        best = preferred_fit(joint)
        if best is None:
            return None
        friction = identified_friction(best.friction, best.series)
        return SelectedFriction(friction, f"{len(best.series)} runs", best.verdict)
    usable = [
        fit.recommended for fit in fits if fit.recommended is not None and fit.usable_in_plant
    ]
    if not usable:
        return None
    only = max(usable, key=lambda fit: fit.effective_sample_size)
    friction = identified_friction(only.friction, (only.series,))
    return SelectedFriction(friction, only.series.origin, only.verdict)
