"""DynamicFit: estimates, standard errors, goodness of fit and undetermined combinations of parameters."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from ....core import tree
from ....core.arrays import Array
from ....core.errors import ParameterError, suggestion
from ....engine.compile import System
from ....recording import Recording
from ....recording.display_units import displayed
from ....recording.notebook import Card, NotebookDisplay
from ..identifiability import Identifiability
from ..result import Estimate, estimate_rows, estimate_table
from .experiment import Unknown
from .plot import plot_record
from .problem import DynamicFitProblem
from .profile import DynamicProfile, compute_profile
from .reliability import Optimum, searches_at_lowest


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class DynamicFit(NotebookDisplay):
    """Plant parameters estimated from transient records; `print` it."""

    problem: DynamicFitProblem
    estimates: tuple[Estimate, ...]
    correlations: Array
    """Correlation matrix of the estimates, in their order, shape (P, P)."""
    identifiability: Identifiability
    residual_std: float
    """Standard deviation of the residuals relative to the sensors, with N - P degrees of freedom."""
    costs: Array
    """Sums of squared residuals of the searches, lowest first; infinite where an initial guess failed."""
    optima: tuple[Optimum, ...]
    """The distinct optima of the searches, lowest first."""
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Estimate:
        """An estimate by its name, for example `circuit.fill.conductance` or `start time of record 2`.

        Raises ParameterError.
        """
        for estimate in self.estimates:
            if estimate.name == name:
                return estimate
        names = [e.name for e in self.estimates]
        raise ParameterError(f"the fit has no unknown '{name}'; it has {', '.join(names)}.{suggestion(name, names)}")

    @property
    def values(self) -> Array:
        """Estimated values [SI], shape (P,)."""
        return np.array([e.value for e in self.estimates])

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        """The unknowns of the fit, in the order of the estimates."""
        return self.problem.unknowns

    @property
    def starts_at_optimum(self) -> int:
        """Number of searches that reached the lowest sum of squares, within 0.1 %."""
        return searches_at_lowest(self.costs)

    def plant(self, record: int = 0) -> System:
        """The plant of one record with the estimated parameters."""
        model = self.problem.record_models[record]
        return tree.with_parameters(model.plant, [float(v) for v in model.leaves(self.values)])

    def modelled(self, record: int = 0) -> Recording:
        """The observed quantities of the fitted plant at the rows of one record [SI]."""
        model = self.problem.record_models[record]
        values = model.evaluate(self.values).values
        columns = {name: values[:, i] for i, name in enumerate(model.names)}
        return Recording({"time": model.times, **columns}, f"fit to {model.experiment.recording.origin}")

    def residuals(self, record: int = 0) -> Recording:
        """Residuals (model - measured) at the rows of one record [SI]."""
        model, modelled = self.problem.record_models[record], self.modelled(record)
        measured = model.experiment.recording
        differences = {name: modelled[name] - measured[name] for name in model.names}
        return Recording({"time": model.times, **differences}, f"residuals of {measured.origin}")

    def rms(self, name: str, record: int = 0) -> float:
        """Root mean square residual of an observed quantity in one record [SI]."""
        return float(np.sqrt(np.nanmean(self.residuals(record)[name] ** 2)))

    def profile(self, name: str, points: int = 9) -> DynamicProfile:
        """The profile likelihood of one estimate at `points` values to either side; all others are fitted again."""
        index = [e.name for e in self.estimates].index(self[name].name)
        variance = max(self.residual_std, 1e-300) ** 2
        return compute_profile(self.problem, self.estimates, index, self.costs[0], variance, points)

    def plot(self, record: int = 0, *, ax: Any = None) -> Any:
        """Plot the observed quantities of one record, measured and modelled.

        `ax` is an Axes, or a sequence of one for each quantity, and is returned; without it a figure is returned.
        """
        model = self.problem.record_models[record]
        return plot_record(model.experiment.recording, self.modelled(record), model.names, ax)

    def _card(self) -> Card:
        return Card("Dynamic fit", estimate_rows(self.estimates), self.plot, [*self._summary_lines(), *self.notes])

    def __str__(self) -> str:
        notes = (f"note: {note}" for note in self.notes)
        return "\n".join([*estimate_table(self.estimates), "", *self._summary_lines(), *notes])

    def _summary_lines(self) -> list[str]:
        lines = []
        for i, model in enumerate(self.problem.record_models):
            rms = ", ".join(f"{name} {displayed(name, self.rms(name, i))}" for name in model.names)
            lines.append(f"record {i + 1}, {model.experiment.recording.origin}: rms residual {rms}")
        analysis = self.identifiability
        lines.append(
            f"residual std {self.residual_std:.3g} times that of the sensors; rank {analysis.rank} of "
            f"{analysis.singular_values.size} unknowns that are not on a bound"
        )
        single = "one search, so other optima were not sought; increase the number of starts"
        several = f"{self.starts_at_optimum} of {self.costs.size} searches reached this optimum"
        lines.append(single if self.costs.size == 1 else several)
        return lines
