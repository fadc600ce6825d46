"""Where the pressure of a fill was sensed: in the muscle or before it, as the residuals of two descriptions say."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...core.errors import IdentificationError
from .result import DynamicFit

NOTABLE = 0.02
"""Share of the rise of the pressure beyond which residuals say that a description cannot be right; chosen."""
BETTER = 2.0
"""Ratio of residuals at which one description counts as better than another; chosen."""


@dataclasses.dataclass(frozen=True)
class Sensing:
    """What a fill says about its sensor: residuals of two descriptions [Pa], and how far the pressure rose [Pa]."""

    inside: float
    """Rms that a muscle whose volume grows with its pressure leaves, sensed inside."""
    before: float
    """Rms that a line and a muscle leave, sensed in the line."""
    rise: float

    @property
    def before_muscle(self) -> bool:
        """Whether it looks sensed before the muscle: a growing volume fails, and a line explains it."""
        return self.line_better and self.inside > NOTABLE * self.rise

    @property
    def line_better(self) -> bool:
        """Whether line and muscle leave less than half of what the growing volume leaves."""
        return self.before * BETTER < self.inside

    def __str__(self) -> str:
        rms = (
            f"one growing volume leaves {self.inside / 1e3:.2f} kPa rms ({self.inside / self.rise:.1%} of the rise), "
            f"line and muscle {self.before / 1e3:.2f} kPa"
        )
        if self.before_muscle:
            return f"looks sensed before the muscle: {rms}"
        if self.line_better:
            return (
                f"may be sensed before the muscle: {rms}; another law of growth might do as well. Record the length, "
                "or the pressure at both ends of the line"
            )
        return f"does not tell where it was sensed: {rms}"


def where_sensed(*, inside: DynamicFit, before: DynamicFit) -> Sensing:
    """Where the pressure of one fill was sensed, by two fits of it: one sensed in the muscle, one in the line.

    Both within physical bounds: a valve of b = 0.9 or a muscle that grows tenfold would imitate a line.
    Raises IdentificationError where a fit is of another number of records than one, or of other rows.
    """
    for fit in (inside, before):
        if len(fit.problem.courses) != 1 or len(fit.problem.courses[0].names) != 1:
            raise IdentificationError("where_sensed compares two fits of the pressure of one record.")
    rows, others = (fit.problem.courses[0].measured[:, 0] for fit in (inside, before))
    if not np.array_equal(rows, others):
        raise IdentificationError("where_sensed compares two fits of the same record; these have different rows.")
    residuals = [fit.rms(fit.problem.courses[0].names[0]) for fit in (inside, before)]
    return Sensing(residuals[0], residuals[1], float(np.ptp(rows)))
