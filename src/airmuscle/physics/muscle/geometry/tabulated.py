"""Geometries of measured volumes: a table over the contraction, a rigid vessel."""

import functools
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from ....core import ParameterError, Value, model, parameter
from .base import Geometry


@model
class TabulatedGeometry(Geometry):
    """Monotone piecewise cubic interpolation (PCHIP) of V(eps) through the rows (eps_i, V_i).

    The outline is the cylinder of this volume. Contractions outside the table raise GeometryLimitError. The geometry
    is not in closed form; for a plant, approximate it with `as_polynomial`, which states the approximation error.
    Reference: Fritsch and Carlson, SIAM J. Numer. Anal. 17:238 (1980).
    """

    traceable: ClassVar[bool] = False

    contractions: tuple[float, ...] = parameter("1", "eps_i", "contractions of the rows, increasing", fitted=False)
    volumes: tuple[float, ...] = parameter("m3", "V_i", "volumes of the rows", bounds=(0.0, 1.0), fitted=False)
    resting_length: float = parameter(
        "m", "L_0", "length between the fittings, unpressurised and unloaded", bounds=(1e-3, 20.0), fitted=False
    )

    def check(self) -> None:
        rows = len(self.contractions)
        if rows < 2 or rows != len(self.volumes) or (np.diff(self.contractions) <= 0).any():
            raise ParameterError(
                f"TabulatedGeometry: {rows} contractions and {len(self.volumes)} volumes; at least two rows are "
                "required, each with both values, in order of increasing contraction."
            )

    @property
    def contraction_range(self) -> tuple[float, float]:
        return (self.contractions[0], self.contractions[-1])

    def volume(self, contraction: Value) -> Value:
        self.check_contraction(contraction)
        return _curve(self)(contraction)[()]

    def volume_derivative(self, contraction: Value) -> Value:
        self.check_contraction(contraction)
        return _curve(self).derivative()(contraction)[()]

    def outline(self, contraction: float, points: int = 201) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        length = self.resting_length * (1.0 - contraction)
        radius = float(np.sqrt(self.volume(contraction) / (np.pi * length)))
        return np.linspace(-length / 2, length / 2, points), np.full(points, radius)


@functools.lru_cache(maxsize=64)
def _curve(geometry: TabulatedGeometry) -> Any:
    from scipy.interpolate import PchipInterpolator  # slow to import and rarely needed

    return PchipInterpolator(geometry.contractions, geometry.volumes, extrapolate=False)


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
