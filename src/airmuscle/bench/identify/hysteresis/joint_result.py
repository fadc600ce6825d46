"""JointFit: one friction law for several runs, its dependence on pressure, and whether it holds for each run;
preference among justified laws."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from ....core.tree import leaves
from ....physics.muscle.friction import Friction, PressureScaledFriction
from ....report.chapter import Chapter, Plot
from ....report.parameters import parameter_table
from ...reported import Reported
from ..identifiability import UndeterminedCombination
from ..model_evidence import format_p_value
from .agreement import RunAgreement, plot_amplitudes
from .limits import MILLIMETRES, DataLimits, combine_limits, limit_reservations, undetermined_parameters
from .result import SIGNIFICANCE_LEVEL, HysteresisFit
from .search import free_parameters
from .series import LoopSeries


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class JointFit(Reported):
    """A friction law fitted to several runs together, each with its own static curve; forces in N.

    `friction` is a `PressureScaledFriction` if the runs justify a dependence on pressure; `scale_p_value` is that of
    its F test, NaN where the runs have one pressure. `repeat_rmse` is the error on the second runs, NaN without any.
    """

    friction: Friction
    series: tuple[LoopSeries, ...]
    agreement: tuple[RunAgreement, ...]
    rmse: float
    rmse_without_friction: float
    effective_sample_size: float
    aicc_reduction: float
    p_value: float
    scale_p_value: float
    repeat_rmse: float
    repeat_rmse_without_friction: float
    weak_combinations: tuple[UndeterminedCombination, ...] = ()

    @property
    def law(self) -> Friction:
        """The friction law without its force scale."""
        return self.friction.inner if isinstance(self.friction, PressureScaledFriction) else self.friction

    @property
    def name(self) -> str:
        """Name of the law."""
        return type(self.law).__name__

    @property
    def limits(self) -> DataLimits:
        """Maximum force and range of the speed of all runs."""
        return combine_limits(tuple(run.limits for run in self.series))

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Paths of the parameters that the runs do not determine."""
        return undetermined_parameters(self.friction, self.limits, self.weak_combinations)

    @property
    def reservations(self) -> tuple[str, ...]:
        """The reasons, as sentences, why the runs cannot justify one friction whatever the statistical tests say."""
        different = [str(run) for run in self.agreement if run.disagrees]
        reasons = []
        if different:
            reasons.append(
                "The friction does not hold for all runs; half the range of its force is, in "
                f"{'; in '.join(different)}."
            )
        if self.repeat_rmse >= self.repeat_rmse_without_friction:
            reasons.append("It does not lower the error on the second runs.")
        return (*reasons, *limit_reservations(self.friction, self.limits, self.weak_combinations, MILLIMETRES))

    @property
    def justified(self) -> bool:
        """Whether AICc and the F test favour the friction, and no reservation contradicts it."""
        return self.aicc_reduction > 0 and self.p_value < SIGNIFICANCE_LEVEL and not self.reservations

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
            f"{self.rmse_without_friction:.3g} to {self.rmse:.3g} N. {self.scale_text} Difference in AICc "
            f"{-self.aicc_reduction:.4g}, effective sample size {self.effective_sample_size:.0f}; F test "
            f"{format_p_value(self.p_value)}."
        )
        if np.isfinite(self.repeat_rmse):
            text += (
                f" On the second runs the rms error changes from {self.repeat_rmse_without_friction:.3g} to "
                f"{self.repeat_rmse:.3g} N."
            )
        text = " ".join([text, *self.reservations])
        if self.undetermined:
            text += f" Not determined: {', '.join(self.undetermined)}."
        text = " ".join([text, *(str(each) for each in self.weak_combinations)])
        return f"{text} The data {'justify' if self.justified else 'do not justify'} this friction for all runs."

    def plot(self, *, ax: Any = None) -> Any:
        """Plot the amplitude of the friction over the pressure, of each run and of the joint fit.

        `ax` is an Axes and is returned; without it a new figure is returned. Raises ParameterError for another `ax`.
        """
        return plot_amplitudes(self.agreement, self.friction, self.name, ax=ax)

    def chapter(self) -> Chapter:
        """The description of the fit: verdict, parameters, and friction over pressure."""
        caption = (
            f"Friction over pressure, {self.name}: half the range of the friction force of each run, and joint fit."
        )
        table = parameter_table(
            self.friction, "joint-parameters", f"Parameters of {self.name} from all runs", brief=True
        )
        return Chapter(
            name="joint-friction",
            title=f"{self.name} fitted to {len(self.series)} runs",
            summary=self.verdict,
            tables=(table,),
            plots=(Plot("joint-friction", caption, self.plot),),
            references=(*self.friction.references, *(() if self.law is self.friction else self.law.references)),
        )


SIMILAR_RMSE = 1.02
"""Maximum ratio of the rms errors of two laws that describe the data equally well (chosen)."""
AnyFit = TypeVar("AnyFit", HysteresisFit, JointFit)


def preferred_fit(fits: Sequence[AnyFit]) -> AnyFit | None:
    """The fit to use of several laws, lowest AICc first; None where the data justify none.

    It is the justified one with the lowest AICc. Where the data do not determine all of its parameters, or do not judge
    them one by one because it consists of elements, it is the one with the fewest parameters among those whose rms
    error is at most 2 % greater.
    """
    justified = [fit for fit in fits if fit.justified]
    if not justified or not _is_open(justified[0]):
        return justified[0] if justified else None
    similar = [fit for fit in justified if fit.rmse <= SIMILAR_RMSE * justified[0].rmse]
    return min(similar, key=lambda fit: free_parameters(fit.friction))


def _is_open(fit: HysteresisFit | JointFit) -> bool:
    return bool(fit.undetermined) or any("[" in leaf.path for leaf in leaves(fit.friction))
