"""Where the pressure of a fill was sensed: in the muscle or before it, as the residuals of two descriptions say."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...core.errors import IdentificationError
from .result import DynamicFit

MIN_RELATIVE_RESIDUAL = 0.02
"""Share of the rise of the pressure beyond which residuals say that a description cannot be right; chosen."""
MIN_RESIDUAL_RATIO = 2.0
"""Ratio of residuals at which one description counts as better than another; chosen."""


@dataclasses.dataclass(frozen=True)
class SensorLocation:
    """What a fill says about its sensor: residuals of two descriptions [Pa], and how far the pressure rose [Pa]."""

    rms_in_muscle: float
    """Rms that a muscle whose volume grows with its pressure leaves, sensed inside."""
    rms_in_line: float
    """Rms that a line and a muscle leave, sensed in the line."""
    pressure_rise: float

    @property
    def is_upstream(self) -> bool:
        """Whether it looks sensed before the muscle: a growing volume fails, and a line explains it."""
        return self.line_fits_better and self.rms_in_muscle > MIN_RELATIVE_RESIDUAL * self.pressure_rise

    @property
    def line_fits_better(self) -> bool:
        """Whether line and muscle leave less than half of what the growing volume leaves."""
        return self.rms_in_line * MIN_RESIDUAL_RATIO < self.rms_in_muscle

    def __str__(self) -> str:
        rms = (
            f"one growing volume leaves {self.rms_in_muscle / 1e3:.2f} kPa rms ({self.rms_in_muscle / self.pressure_rise:.1%} of the rise), "
            f"line and muscle {self.rms_in_line / 1e3:.2f} kPa"
        )
        if self.is_upstream:
            return f"looks sensed before the muscle: {rms}"
        if self.line_fits_better:
            return (
                f"may be sensed before the muscle: {rms}; another law of growth might do as well. Record the length, "
                "or the pressure at both ends of the line"
            )
        return f"does not tell where it was sensed: {rms}"


def locate_pressure_sensor(*, inside: DynamicFit, before: DynamicFit) -> SensorLocation:
    """Where the pressure of one fill was sensed, by two fits of it: one sensed in the muscle, one in the line.

    Both within physical bounds: a valve of b = 0.9 or a muscle that grows tenfold would imitate a line.
    Raises IdentificationError where a fit is of another number of records than one, or of other rows.
    """
    for fit in (inside, before):
        if len(fit.problem.record_models) != 1 or len(fit.problem.record_models[0].names) != 1:
            raise IdentificationError("where_sensed compares two fits of the pressure of one record.")
    rows, others = (fit.problem.record_models[0].measured[:, 0] for fit in (inside, before))
    if not np.array_equal(rows, others):
        raise IdentificationError("where_sensed compares two fits of the same record; these have different rows.")
    residuals = [fit.rms(fit.problem.record_models[0].names[0]) for fit in (inside, before)]
    return SensorLocation(residuals[0], residuals[1], float(np.ptp(rows)))
