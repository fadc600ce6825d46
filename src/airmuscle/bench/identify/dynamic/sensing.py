"""Location of the pressure sensor in a fill, by comparing two models."""

from __future__ import annotations

import dataclasses

import numpy as np

from ....core.errors import IdentificationError
from .result import DynamicFit

MIN_RELATIVE_RESIDUAL = 0.02
"""Rms residual relative to the pressure rise above which a model is rejected; chosen."""
MIN_RESIDUAL_RATIO = 2.0
"""Ratio of rms residuals above which one model is better than another; chosen."""


@dataclasses.dataclass(frozen=True)
class SensorLocation:
    """Rms residuals [Pa] of two models of one fill, and the pressure rise [Pa], from which the location follows."""

    rms_in_muscle: float
    """Rms residual of a muscle with a growing volume, with the sensor in the muscle."""
    rms_in_line: float
    """Rms residual of a line and a muscle, with the sensor in the line."""
    pressure_rise: float

    @property
    def is_upstream(self) -> bool:
        """Whether the sensor is probably upstream of the muscle: the model with the line fits, the other does not."""
        return self.line_fits_better and self.rms_in_muscle > MIN_RELATIVE_RESIDUAL * self.pressure_rise

    @property
    def line_fits_better(self) -> bool:
        """Whether the rms residual with the line is less than half of that with the growing volume."""
        return self.rms_in_line * MIN_RESIDUAL_RATIO < self.rms_in_muscle

    def __str__(self) -> str:
        rms = (
            f"rms residual {self.rms_in_muscle / 1e3:.2f} kPa for a growing volume with the sensor in the muscle "
            f"({100 * self.rms_in_muscle / self.pressure_rise:.1f} % of the pressure rise), "
            f"{self.rms_in_line / 1e3:.2f} kPa for a line and a muscle"
        )
        if self.is_upstream:
            return f"the sensor is probably upstream of the muscle: {rms}"
        if self.line_fits_better:
            return (
                f"the sensor may be upstream of the muscle: {rms}; another model of the volume may fit as well. Record "
                "the length, or the pressure at both ends of the line"
            )
        return f"the record does not determine the location of the sensor: {rms}"


def locate_pressure_sensor(*, in_muscle: DynamicFit, in_line: DynamicFit) -> SensorLocation:
    """Locate the pressure sensor of one fill by two fits of it: sensor in the muscle, and sensor in the line.

    Both fits need physical bounds, because a valve with b = 0.9 or a muscle that grows tenfold would imitate a line.
    Raises IdentificationError where a fit is not of one pressure in one record, or the rows differ.
    """
    for fit in (in_muscle, in_line):
        if len(fit.problem.record_models) != 1 or len(fit.problem.record_models[0].names) != 1:
            raise IdentificationError(
                "locate_pressure_sensor compares two fits of one record with one observed pressure."
            )
    rows, others = (fit.problem.record_models[0].measured[:, 0] for fit in (in_muscle, in_line))
    if not np.array_equal(rows, others):
        raise IdentificationError(
            "locate_pressure_sensor compares two fits of the same record, but these have different rows."
        )
    rms = [fit.rms(fit.problem.record_models[0].names[0]) for fit in (in_muscle, in_line)]
    return SensorLocation(rms[0], rms[1], float(np.ptp(rows)))
