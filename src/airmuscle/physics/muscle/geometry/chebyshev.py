"""Geometries from numbers: a table of measured volumes, a rigid vessel, a Chebyshev approximation
with its error.
"""

import functools
from typing import Any, ClassVar

import numpy as np

from ....core import GeometryLimitError, ParameterError, Value, model, ops, parameter
from .base import LENGTHS, RESTING_LENGTH, Geometry, check_degree


@model
class TabulatedGeometry(Geometry):
    """Monotone piecewise cubic interpolation (PCHIP) of V(eps) through the rows (eps_i, V_i).

    The outline is the cylinder of this volume. Contractions outside the table raise
    GeometryLimitError. The geometry is not in closed form; for a plant, approximate it with
    `as_polynomial`, which states the approximation error. Reference: Fritsch and Carlson, SIAM J.
    Numer. Anal. 17:238 (1980).
    """

    traceable: ClassVar[bool] = False

    contractions: tuple[float, ...] = parameter(
        "1", "eps_i", "contractions of the rows, increasing", fitted=False
    )
    volumes: tuple[float, ...] = parameter(
        "m3", "V_i", "volumes of the rows", bounds=(0.0, 1.0), fitted=False
    )
    resting_length: float = parameter(*RESTING_LENGTH, bounds=LENGTHS, fitted=False)

    def check(self) -> None:
        rows = len(self.contractions)
        if rows < 2 or rows != len(self.volumes) or (np.diff(self.contractions) <= 0).any():
            raise ParameterError(
                f"TabulatedGeometry: {rows} contractions and {len(self.volumes)} volumes; at least"
                " two rows are required, each with both values, in order of increasing"
                " contraction."
            )

    @property
    def contraction_range(self) -> tuple[float, float]:
        return (self.contractions[0], self.contractions[-1])

    @functools.cached_property
    def _curve(self) -> Any:
        from scipy.interpolate import PchipInterpolator  # slow to import and rarely needed

        return PchipInterpolator(self.contractions, self.volumes, extrapolate=False)

    def volume(self, contraction: Value) -> Value:
        self.check_contraction(contraction)
        return self._curve(contraction)[()]

    def volume_derivative(self, contraction: Value) -> Value:
        self.check_contraction(contraction)
        return self._curve.derivative()(contraction)[()]


@model
class Vessel(Geometry):
    """Constant volume: a test chamber, or a muscle (with an expanding wall) whose contraction was
    not recorded.
    """

    enclosed_volume: float = parameter("m3", "V_0", "enclosed volume", bounds=(1e-7, 1e-1))
    resting_length: float = parameter(
        "m", "L_0", "length between the fittings", bounds=(1e-3, 10.0), fitted=False, default=0.2
    )

    contraction_range = (-0.5, 0.9)

    def volume(self, contraction: Value) -> Value:
        return self.enclosed_volume + 0.0 * contraction

    def volume_derivative(self, contraction: Value) -> Value:
        return 0.0 * contraction

    def radius_at(self, contraction: Value) -> Value:
        return (self.enclosed_volume / (np.pi * (self.resting_length * (1.0 - contraction)))) ** 0.5


_ERROR_POINTS = 1001
"""Points at which the approximation error is evaluated; dense enough for the kinks in the slope of
a table.
"""


@model
class ChebyshevGeometry(Geometry):
    """Polynomial volume: V = Sum_k a_k T_k(x),   x = (2 eps - eps_low - eps_high)/(eps_high -
    eps_low).

    T_k: Chebyshev polynomials, evaluated by Clenshaw's recurrence. Outside the validity range the
    volume is extrapolated linearly. The outline is the cylinder of this volume; plot the
    approximated geometry instead. `volume_error` and `derivative_error` are the maximum errors of V
    and dV/deps, as evaluated by `as_polynomial`.
    """

    coefficients: tuple[float, ...] = parameter(
        "m3", "a_k", "coefficients of the Chebyshev polynomials", fitted=False
    )
    min_contraction: float = parameter(
        "1", "eps_low", "lower limit of the validity range in contraction", fitted=False
    )
    max_contraction: float = parameter(
        "1", "eps_high", "upper limit of the validity range in contraction", fitted=False
    )
    resting_length: float = parameter(*RESTING_LENGTH, bounds=LENGTHS, fitted=False)
    volume_error: float = parameter(
        "m3", "dV", "maximum error of the volume in the validity range", fitted=False, default=0.0
    )
    derivative_error: float = parameter(
        "m3", "dV'", "maximum error of dV/deps in the validity range", fitted=False, default=0.0
    )

    def check(self) -> None:
        if len(self.coefficients) < 2:
            raise ParameterError(
                f"ChebyshevGeometry: {len(self.coefficients)} coefficients; at least two are"
                " required (degree 1)."
            )
        if not self.max_contraction < 1.0:
            raise ParameterError(
                "ChebyshevGeometry: max_contraction must be less than 1, where the length is zero."
            )

    @property
    def contraction_range(self) -> tuple[float, float]:
        return (self.min_contraction, self.max_contraction)

    def volume(self, contraction: Value) -> Value:
        half = (self.max_contraction - self.min_contraction) / 2
        x = (contraction - self.min_contraction) / half - 1.0
        inner = ops.clip(x, -1.0, 1.0)
        # polynomial and derivative by x, from b_k = a_k + 2 x b_(k+1) - b_(k+2) and its derivative
        b: Value = 0.0
        b_next: Value = 0.0
        d: Value = 0.0
        d_next: Value = 0.0
        for a in reversed(self.coefficients[1:]):
            d, d_next = 2 * b + 2 * inner * d - d_next, d
            b, b_next = a + 2 * inner * b - b_next, b
        value = self.coefficients[0] + inner * b - b_next
        slope = b + inner * d - d_next
        return value + slope * (x - inner)


def as_polynomial(
    geometry: Geometry, degree: int = 16, contraction_range: tuple[float, float] | None = None
) -> ChebyshevGeometry:
    """Return a traceable geometry that interpolates `geometry` at the Chebyshev points of a
    contraction range [1].

    The default range is that of the geometry. The errors are evaluated at 1001 points. If dV/deps
    is infinite at zero contraction, as for straight fibres, the range must begin above zero,
    otherwise GeometryLimitError is raised, as it is if the range exceeds that of the geometry.
    Raises ParameterError for a degree that is not a positive integer.
    """
    check_degree("as_polynomial", degree, 1)
    low, high = contraction_range or geometry.contraction_range
    geometry.check_contraction([low, high])
    if low < high and not np.isfinite(geometry.volume_derivative(low)):
        raise GeometryLimitError(
            f"as_polynomial: dV/deps of {type(geometry).__name__} is infinite at a contraction of"
            f" {100 * low:.4g} %. Give a contraction_range that begins above it, such as"
            f" ({low + 0.01:g}, {high:g})."
        )
    middle = (low + high) / 2
    half = (high - low) / 2
    coefficients = np.polynomial.chebyshev.chebinterpolate(
        lambda x: geometry.volume(np.clip(middle + half * x, low, high)),
        degree,  # rounding may leave the limits
    )
    polynomial = ChebyshevGeometry(tuple(coefficients), low, high, geometry.resting_length)
    points = np.linspace(low, high, _ERROR_POINTS)
    errors = (
        np.abs(polynomial.volume(points) - geometry.volume(points)).max(),
        np.abs(polynomial.volume_derivative(points) - geometry.volume_derivative(points)).max(),
    )
    return ChebyshevGeometry(
        tuple(coefficients), low, high, geometry.resting_length, *(float(e) for e in errors)
    )
