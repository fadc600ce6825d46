"""JointFit: one friction law for several runs, its dependence on pressure, and its agreement with each run."""

import dataclasses
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from ....core import LINES, given_axes, leaves, legend_below, new_figure, relabel_in_display_units
from ....physics.muscle.friction import Friction, PressureScaledFriction
from ....report.chapter import Chapter, Plot
from ....report.shown import parameter_table
from ..model_evidence import effective_sample_size, format_p_value
from .limits import MILLIMETRES, DataLimits, combine_limits, limit_reservations
from .result import SIGNIFICANCE_LEVEL, FrictionFit, HysteresisFit, Misfit
from .search import LoopSeries, free_parameters

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
    forces = [each[rows] for each in (run.friction_force(joint), run.friction_force(own.friction), run.target)]
    parts = [curve @ np.linalg.lstsq(curve, each, rcond=None)[0] for each in forces]  # that the static curve takes up
    joint_force, own_force, target = (force - part for force, part in zip(forces, parts, strict=True))
    power = float(joint_force @ joint_force) or 1e-300
    factor = -float(joint_force @ target) / power
    rest = target + factor * joint_force
    variance = float(np.mean(rest**2)) * rest.size / max(effective_sample_size(rest), 1.0)
    joint_misfit, misfit = Misfit.of(joint, (run,)), Misfit.of(own.friction, (run,))
    largest = max(float(np.linalg.norm(force)) for force in (own_force, joint_force)) or 1e-300
    amplitude = force_amplitude(run, joint)
    return RunAgreement(
        origin=run.origin,
        description=description,
        pressure=pressure,
        amplitude=factor * amplitude,
        amplitude_stderr=float(np.sqrt(variance / power)) * amplitude,
        joint_amplitude=amplitude,
        deviation=float(np.linalg.norm(own_force - joint_force)) / largest,
        p_value=misfit.p_value(joint_misfit._replace(parameters=curve.shape[1])),
    )


@dataclasses.dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class JointFit(FrictionFit):
    """A friction law fitted to several runs together, each with its own static curve; forces in N.

    `friction` is a `PressureScaledFriction` if the runs justify a dependence on pressure; `scale_p_value` is that of
    its F test, NaN where the runs have one pressure.
    """

    series: tuple[LoopSeries, ...]
    agreement: tuple[RunAgreement, ...]
    scale_p_value: float

    @property
    def law(self) -> Friction:
        """The friction law without its force scale."""
        return self.friction.inner if isinstance(self.friction, PressureScaledFriction) else self.friction

    @property
    def limits(self) -> DataLimits:
        return combine_limits(tuple(run.limits for run in self.series))

    @property
    def reservations(self) -> tuple[str, ...]:
        different = "; in ".join(str(run) for run in self.agreement if run.disagrees)
        found = (
            (different, f"The friction does not hold for all runs; half the range of its force is, in {different}."),
            (self.repeat_rmse >= self.repeat_rmse_without_friction, "It does not lower the error on the second runs."),
        )
        reasons = [reason for holds, reason in found if holds]
        return (*reasons, *limit_reservations(self.friction, self.limits, self.weak_combinations, MILLIMETRES))

    @property
    def scale_text(self) -> str:
        """The dependence of the friction on the pressure, as a sentence."""
        if isinstance(self.friction, PressureScaledFriction):
            ratio, reference = self.friction.ambient_ratio, self.friction.reference_pressure / 1e3
            factor = f"{ratio:.3g} {'-' if ratio > 1 else '+'} {abs(1.0 - ratio):.3g} " if ratio >= 5e-4 else ""
            text = (
                f"The friction at a gauge pressure p is its value at {reference:.4g} kPa times {factor}"
                f"p/({reference:.4g} kPa) (F test of this dependence {format_p_value(self.scale_p_value)})."
            )
            levels = {round(run.pressure / self.friction.reference_pressure, 1) for run in self.agreement}
            return text if len(levels) > 2 else f"{text} Two pressures determine this dependence but cannot test it."
        if np.isnan(self.scale_p_value):
            return "The runs have one pressure, so that the dependence of the friction on the pressure is not known."
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
        """Plot half the range of the friction force over the gauge pressure: each run alone with two standard errors,
        and the joint fit.

        `ax` is an Axes and is returned; without it a new figure is returned. Raises ParameterError for another `ax`.
        """
        fields = ("pressure", "amplitude", "amplitude_stderr", "joint_amplitude")
        pressure, own, error, joint = (np.array([getattr(run, name) for run in self.agreement]) for name in fields)
        grid = np.linspace(0.0, 1.05 * pressure.max(), 100)
        at_runs, factors = ([float(self.friction.pressure_factor(p)) for p in each] for each in (pressure, grid))
        acting = np.array(at_runs) > 0
        at_one = float(np.mean(joint[acting] / np.array(at_runs)[acting])) if acting.any() else 0.0
        figure, axes = (
            new_figure(width=6.0, height=3.9) if ax is None else (None, given_axes(ax, 1, "plot of a friction")[0])
        )
        axes.plot(grid / 1e3, [at_one * factor for factor in factors], color=LINES[1], label="joint fit")
        dots = {"fmt": "o", "color": LINES[0], "capsize": 3, "label": "each run alone, 2 standard errors"}
        axes.errorbar(pressure / 1e3, own, 2.0 * error, **dots)
        labels = {"xlabel": "gauge pressure [kPa]", "ylabel": "friction, half its range [N]", "title": self.name}
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
        plots = (Plot("joint-friction", f"Friction over pressure, {self.name}: {of_runs}.", self.plot),)
        heading = f"Parameters of {self.name} from all runs"
        tables = (parameter_table(self.friction, "joint-parameters", heading, brief=True),)
        references = (*self.friction.references, *(() if self.law is self.friction else self.law.references))
        title = f"{self.name} fitted to {len(self.series)} runs"
        return Chapter("joint-friction", title, self.verdict, tables=tables, plots=plots, references=references)


SIMILAR_RMSE = 1.02
"""Maximum ratio of the rms errors of two laws that describe the data equally well (chosen)."""
AnyFit = TypeVar("AnyFit", bound=FrictionFit)


def preferred_fit(fits: Sequence[AnyFit]) -> AnyFit | None:
    """The fit to use of several laws, lowest AICc first; None where the data justify none.

    It is the justified one with the lowest AICc. Where the data do not determine all of its parameters, or do not judge
    them one by one because it consists of elements, it is the one with the fewest parameters among those whose rms
    error is at most 2 % greater.
    """
    justified = [fit for fit in fits if fit.justified]
    if not justified:
        return None
    if not justified[0].undetermined and not any("[" in leaf.path for leaf in leaves(justified[0].friction)):
        return justified[0]
    similar = [fit for fit in justified if fit.rmse <= SIMILAR_RMSE * justified[0].rmse]
    return min(similar, key=lambda fit: free_parameters(fit.friction))
