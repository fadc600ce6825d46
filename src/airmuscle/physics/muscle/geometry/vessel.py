"""Rigid vessel: a volume independent of contraction."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ....core.declaration import model, parameter
from ....core.ops import Value
from .base import Geometry


@model
class Vessel(Geometry):
    """Constant volume: a test chamber, or a muscle (with an expanding wall) whose contraction was not recorded."""

    enclosed_volume: float = parameter("m3", "V_0", "enclosed volume", bounds=(1e-7, 1e-1))
    resting_length: float = parameter(
        "m", "L_0", "length between the fittings", bounds=(1e-3, 10.0), fitted=False, default=0.2
    )

    @property
    def contraction_range(self) -> tuple[float, float]:
        return (-0.5, 0.9)

    def volume(self, contraction: Value) -> Value:
        return self.enclosed_volume + 0.0 * contraction

    def volume_derivative(self, contraction: Value) -> Value:
        return 0.0 * contraction

    def outline(self, contraction: float, points: int = 201) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        self.check_contraction(contraction)
        length = self.resting_length * (1.0 - contraction)
        radius = (self.enclosed_volume / (np.pi * length)) ** 0.5
        return np.linspace(-length / 2, length / 2, points), np.full(points, radius)
