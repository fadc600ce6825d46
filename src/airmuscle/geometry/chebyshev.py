"""A polynomial that stands in for a geometry without closed form, and says how far it is off."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..core import ops
from ..core.declaration import model, parameter
from ..core.errors import ParameterError
from ..core.ops import Value
from .base import Geometry

_ERROR_POINTS = 1001
"""Where the error of a stand-in is measured: close enough for the corners in the slope of a table."""


@model
class ChebyshevGeometry(Geometry):
    """V = Sum_k a_k T_k(x),   x = (2 eps - eps_low - eps_high)/(eps_high - eps_low).

    T_k Chebyshev polynomials, by Clenshaw's scheme; outside the validity range the volume goes on by its tangent. The outline
    is the cylinder of this volume: draw the geometry it stands in for instead. `volume_error` and `growth_error`
    are the largest differences to that one in V and dV/deps, as `as_polynomial` measured them.
    """

    coefficients: tuple[float, ...] = parameter("m3", "a_k", "coefficients of the Chebyshev polynomials", fitted=False)
    min_contraction: float = parameter("1", "eps_low", "lower end of the validity range in contraction", fitted=False)
    max_contraction: float = parameter("1", "eps_high", "upper end of the validity range in contraction", fitted=False)
    resting_length: float = parameter(
        "m", "L_0", "length between the fittings, unpressurised and unloaded", bounds=(1e-3, 20.0), fitted=False
    )
    volume_error: float = parameter(
        "m3", "dV", "largest error of the volume on the validity range", fitted=False, default=0.0
    )
    derivative_error: float = parameter(
        "m3", "dV'", "largest error of dV/deps on the validity range", fitted=False, default=0.0
    )

    def check(self) -> None:
        if len(self.coefficients) < 2 or not self.min_contraction < self.max_contraction < 1.0:
            raise ParameterError(
                f"ChebyshevGeometry: {len(self.coefficients)} coefficients on contractions {self.min_contraction:g} "
                f"to {self.max_contraction:g}; it needs two coefficients at least and rising ends below 1."
            )

    @property
    def contraction_range(self) -> tuple[float, float]:
        return (self.min_contraction, self.max_contraction)

    def volume(self, contraction: Value) -> Value:
        half = (self.max_contraction - self.min_contraction) / 2
        x = (contraction - self.min_contraction) / half - 1.0
        inner = ops.clip(x, -1.0, 1.0)
        value, slope = self._clenshaw(inner)
        return value + slope * (x - inner)

    def _clenshaw(self, x: Value) -> tuple[Value, Value]:
        """The polynomial and its slope by x, from b_k = a_k + 2 x b_(k+1) - b_(k+2) and its derivative."""
        b: Value = 0.0
        b_next: Value = 0.0
        d: Value = 0.0
        d_next: Value = 0.0
        for a in reversed(self.coefficients[1:]):
            d, d_next = 2 * b + 2 * x * d - d_next, d
            b, b_next = a + 2 * x * b - b_next, b
        return self.coefficients[0] + x * b - b_next, b + x * d - d_next

    def outline(self, contraction: float, points: int = 201) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        self.check_contraction(contraction)
        length = self.resting_length * (1.0 - contraction)
        radius = float(np.sqrt(self.volume(contraction) / (np.pi * length)))
        return np.linspace(-length / 2, length / 2, points), np.full(points, radius)


def as_polynomial(geometry: Geometry, degree: int = 16, reach: tuple[float, float] | None = None) -> ChebyshevGeometry:
    """A traceable geometry that interpolates `geometry` on `reach` (all of its own where none is given).

    Interpolates at the Chebyshev points; the errors are measured at 1001 places. A growth that is infinite at zero
    contraction, as of straight fibres, needs a `reach` that begins above zero.
    """
    low, high = reach or geometry.contraction_range
    geometry.check_contraction([low, high])
    middle, half = (low + high) / 2, (high - low) / 2
    fit = np.polynomial.chebyshev.chebinterpolate(
        lambda x: geometry.volume(_clip_to_range(middle + half * x, low, high)), degree
    )
    found = ChebyshevGeometry(tuple(fit), low, high, geometry.resting_length)
    between = np.linspace(low, high, _ERROR_POINTS)
    errors = (
        np.abs(found.volume(between) - geometry.volume(between)).max(),
        np.abs(found.volume_derivative(between) - geometry.volume_derivative(between)).max(),
    )
    return ChebyshevGeometry(tuple(fit), low, high, geometry.resting_length, *(float(e) for e in errors))


def _clip_to_range(contraction: npt.NDArray[np.float64], low: float, high: float) -> npt.NDArray[np.float64]:
    """Rounding must not carry a sample past the end of the reach."""
    return np.clip(contraction, low, high)
