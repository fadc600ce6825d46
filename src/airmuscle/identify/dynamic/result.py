"""What a dynamic fit returns: the numbers found, how sure they are, how well the records are met, what stays open."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np

from ...compile import System
from ...core import tree
from ...core.arrays import Array
from ...core.errors import ParameterError, suggestion
from ...recording import Recording
from ..result import Estimate
from .experiment import Unknown
from .identifiability import Identifiability

if TYPE_CHECKING:
    from .problem import DynamicFitProblem
    from .profile import DynamicProfile


@dataclasses.dataclass(frozen=True, eq=False)
class DynamicFit:
    """Parameters of a plant found from records of its motion; `print` it."""

    problem: DynamicFitProblem
    estimates: tuple[Estimate, ...]
    correlations: Array
    """Of the estimates, in their order, shape (P, P)."""
    identifiability: Identifiability
    residual_std: float
    """Standard deviation of the residuals in units of the sensors' deviations, N - P in the denominator."""
    costs: Array
    """Sum of squared residuals that every start came to, least first; infinite where a start failed."""
    notes: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> Estimate:
        """An estimate by its name: `circuit.fill.conductance`, `start time of record 2`."""
        for estimate in self.estimates:
            if estimate.name == name:
                return estimate
        names = [e.name for e in self.estimates]
        raise ParameterError(f"the fit has no '{name}'; there are {', '.join(names)}.{suggestion(name, names)}")

    @property
    def values(self) -> Array:
        return np.array([e.value for e in self.estimates])

    @property
    def unknowns(self) -> tuple[Unknown, ...]:
        return self.problem.unknowns

    @property
    def starts_at_optimum(self) -> int:
        """How many starts came to the best sum of squares, within a thousandth."""
        return int(np.count_nonzero(self.costs <= 1.001 * self.costs[0] + 1e-9))

    def plant(self, record: int = 0) -> System:
        """The plant of one record with what was found put in."""
        course = self.problem.record_models[record]
        return tree.with_parameters(course.plant, [float(v) for v in course.leaves(self.values)])

    def modelled(self, record: int = 0) -> Recording:
        """What the fitted plant gives at the rows of one record."""
        course = self.problem.record_models[record]
        values = course.evaluate(self.values).values
        columns = {name: values[:, i] for i, name in enumerate(course.names)}
        return Recording({"time": course.times, **columns}, f"fit to {course.experiment.recording.origin}")

    def residuals(self, record: int = 0) -> Recording:
        """Model less measured at the rows of one record."""
        course, model = self.problem.record_models[record], self.modelled(record)
        errors = {name: model[name] - course.experiment.recording[name] for name in course.names}
        return Recording({"time": course.times, **errors}, f"residuals of {course.experiment.recording.origin}")

    def rms(self, name: str, record: int = 0) -> float:
        """Root mean square of an observed quantity's residuals in one record, in its own unit."""
        return float(np.sqrt(np.nanmean(self.residuals(record)[name] ** 2)))

    def profile(self, name: str, points: int = 9) -> DynamicProfile:
        """How the sum of squares grows as one estimate is held at other values and all others are found anew."""
        from .profile import compute_profile

        return compute_profile(self, name, points)

    def __str__(self) -> str:
        rows = [("parameter", "", "value", "2 sd", "unit", "meaning")]
        rows += [(e.name, e.label, f"{e.value:.6g}", _two_stderr(e), e.unit, e.meaning) for e in self.estimates]
        widths = [max(len(row[i]) for row in rows) for i in range(5)]
        table = ["  ".join([*(c.ljust(w) for c, w in zip(row, widths, strict=False)), row[5]]).rstrip() for row in rows]
        return "\n".join([*table, "", *self._summary_lines(), *(f"note: {note}" for note in self.notes)])

    def _summary_lines(self) -> list[str]:
        lines = []
        for i, course in enumerate(self.problem.record_models):
            parts = ", ".join(f"{name} {self.rms(name, i):.4g}" for name in course.names)
            lines.append(f"record {i + 1}, {course.experiment.recording.origin}: rms {parts} (SI)")
        found = self.identifiability
        lines.append(
            f"residuals {self.residual_std:.3g} sensor deviations; rank {found.rank} of {found.singular_values.size} off bounds"
        )
        lines.append(f"{self.starts_at_optimum} of {self.costs.size} starts came to the same optimum")
        return lines


def _two_stderr(estimate: Estimate) -> Any:
    if estimate.on_bound:
        return "on bound"
    return f"{2 * estimate.stderr:.3g}" if np.isfinite(estimate.stderr) else "unknown"
