"""Contraction of the Shadow Air Muscle SAM 30 x 290 against pressure and load: plane curves and two surfaces.

The coefficients stand here as the paper has them, in per cent, bar and newton; they are converted where they
are used and never refitted.
"""

from __future__ import annotations

import abc
from typing import ClassVar

import numpy as np

from ..core import ops
from ..core.declaration import model, parameter
from ..core.errors import GeometryLimitError, ParameterError
from ..core.ops import Value
from ..core.reference import Reference
from ..core.units import bar, percent
from ..recording import Recording
from .base import ContractionLaw

BORZIKOVA = Reference(
    "borzikova-sam",
    "Borzikova, Balara, Pitel",
    "The Mathematical Model of Contraction Characteristic k = (F, p) of the Pneumatic Artificial Muscle",
    "FVT TU Kosice, Presov",
    note="undated, newest reference of 2006, grant 1/4077/07: 2007 or later; its text lost its minus signs",
)


@model
class PlaneCurve:
    """Contraction under one constant load, as the paper fitted it: k = k_max (1 - exp(b_0 + b_1 p + ...)).

    p gauge pressure in bar in the coefficients, k_max the contraction that the muscle saturates towards. The
    index IK was computed by the authors against measurements that are lost.
    Reference: Borzikova et al., the three plane characteristics.
    """

    force: float = parameter("N", "F", "load, constant along the curve", bounds=(0.0, 1e5), fitted=False)
    coefficients: tuple[float, ...] = parameter("1/bar^i", "b_i", "coefficients of the exponent, by power of p in bar")
    saturation: float = parameter("1", "k_max", "contraction that the muscle saturates towards", bounds=(1e-3, 1.0))
    printed_index: float = parameter("1", "IK", "correlation index printed for the curve", bounds=(0, 1), fitted=False)

    def exponent(self, pressure: Value) -> Value:
        """The exponent [1] at a gauge pressure [Pa]."""
        return _horner(self.coefficients, pressure / bar)

    def contraction(self, pressure: Value) -> Value:
        """Contraction [1] at a gauge pressure [Pa]."""
        return self.saturation * (1.0 - ops.exp(self.exponent(pressure)))

    def turning_pressures(self) -> tuple[float, ...]:
        """The positive gauge pressures [Pa], ascending, at which the contraction turns over."""
        roots = [complex(r) for r in np.polynomial.Polynomial(self.coefficients).deriv().roots()]
        return tuple(sorted(r.real * bar for r in roots if abs(r.imag) < 1e-9 and r.real > 0))


@model
class PlaneCurves:
    """The plane curves of one muscle: the only record left of its measurements, so they serve as data."""

    references: ClassVar[tuple[Reference, ...]] = (BORZIKOVA,)

    curves: tuple[PlaneCurve, ...]
    max_pressure: float = parameter("Pa", "p_high", "upper end of the measured gauge pressures", fitted=False)

    def curve_at(self, force: float) -> PlaneCurve:
        """The curve of one load [N]. Raises OutOfReach where the paper has no curve for it."""
        for curve in self.curves:
            if curve.force == force:
                return curve
        loads = ", ".join(f"{c.force:g}" for c in self.curves)
        raise GeometryLimitError(f"No plane curve under {force:g} N; there are {loads} N. Between them ask a surface.")

    def sample(self, points: int = 15) -> Recording:
        """A recording of `points` even pressures [Pa] from zero on every curve, curve after curve."""
        pressures = np.linspace(0.0, self.max_pressure, points)
        return Recording(
            {
                "pressure": np.tile(pressures, len(self.curves)),
                "force": np.repeat([c.force for c in self.curves], points),
                "contraction": np.concatenate([c.contraction(pressures) for c in self.curves]),
            },
            origin="plane curves of Borzikova et al., sampled",
            constants={"specimen": "Shadow Air Muscle SAM 30 x 290", "resting_length": 0.29},
            notes=("Curves fitted by the authors, not measured points: those are lost.",),
        )

    def interpolate(self, force_degree: int = 2) -> BorzikovaExponential:
        """The one exponential surface through all the curves, for one load more than its degree in force."""
        loads = np.array([c.force for c in self.curves])
        degree = max(len(c.coefficients) for c in self.curves) - 1
        rows = np.array([(*c.coefficients, *(0.0,) * (degree + 1 - len(c.coefficients))) for c in self.curves])
        # in F / F_max, or the powers of the load would cost digits
        scaled = np.linalg.solve(np.vander(loads / loads.max(), force_degree + 1, increasing=True), rows).T
        matrix = scaled / loads.max() ** np.arange(force_degree + 1)
        validity_range = (0.0, self.max_pressure, float(loads.min()), float(loads.max()))
        saturation = self.curves[0].saturation
        return BorzikovaExponential(tuple(matrix.ravel()), *validity_range, degree, force_degree, saturation=saturation)


SAM_30X290 = PlaneCurves(
    (
        PlaneCurve(45.0, (0.0856, -1.2602, 0.1273), 0.40, 0.998),
        PlaneCurve(130.0, (-0.0082, 0.0872, -0.3787, 0.0742), 0.40, 0.999),
        PlaneCurve(260.0, (0.007, 0.0147, -0.0034, -0.0607, 0.0127), 0.40, 0.999),
    ),
    3.5 * bar,
)
"""Loads of 4.5, 13 and 26 kg, taken as 45, 130 and 260 N as in the paper.

Minus signs are restored: plus signs survived in the text, so a gap inside a sum is a minus; the leading signs
are those with which the printed matrix agrees. The range of 3.5 bar is inferred (the catalogue pressure).
"""


@model
class _PolynomialSurface(ContractionLaw):
    """What the two surfaces share: Sum_ij a_ij p^i F^j in bar and newton, and the validity range it was fitted on."""

    references: ClassVar[tuple[Reference, ...]] = (BORZIKOVA,)

    coefficients: tuple[float, ...] = parameter(
        "1/(bar^i N^j)", "a_ij", "coefficients by power of p in bar, then of F in N; in per cent if direct"
    )
    min_pressure: float = parameter("Pa", "p_low", "lower end of the validity range in gauge pressure", fitted=False)
    max_pressure: float = parameter("Pa", "p_high", "upper end of the validity range in gauge pressure", fitted=False)
    min_force: float = parameter("N", "F_low", "lower end of the validity range in force", fitted=False)
    max_force: float = parameter("N", "F_high", "upper end of the validity range in force", fitted=False)
    pressure_degree: int = 4
    force_degree: int = 2

    def check(self) -> None:
        name = type(self).__name__
        wanted = (self.pressure_degree + 1) * (self.force_degree + 1)
        if len(self.coefficients) != wanted:
            raise ParameterError(
                f"{name} of degree {self.pressure_degree} in pressure and {self.force_degree} in force needs "
                f"{wanted} coefficients; {len(self.coefficients)} given."
            )
        for what, low, high in (
            ("pressure", self.min_pressure, self.max_pressure),
            ("force", self.min_force, self.max_force),
        ):
            if not low < high:
                raise ParameterError(f"{name}: min_{what} {low:g} must lie below max_{what} {high:g}.")

    @property
    def pressure_range(self) -> tuple[float, float]:
        """The validity range in gauge pressure [Pa]: a search finds nothing outside it."""
        return (self.min_pressure, self.max_pressure)

    @property
    def force_range(self) -> tuple[float, float]:
        """The validity range in force [N]: a search finds nothing outside it."""
        return (self.min_force, self.max_force)

    @abc.abstractmethod
    def contraction(self, pressure: Value, force: Value) -> Value: ...

    def inside_validity_range(self, pressure: Value, force: Value) -> Value:
        """Whether gauge pressure [Pa] and force [N] lie where the muscle was measured."""
        in_pressure = ops.both(pressure >= self.min_pressure, pressure <= self.max_pressure)
        return ops.both(in_pressure, ops.both(force >= self.min_force, force <= self.max_force))

    def polynomial(self, pressure: Value, force: Value) -> Value:
        """Sum_ij a_ij p^i F^j at gauge pressure [Pa] and force [N]; outside the validity range by its tangent."""
        inner_p = ops.clip(pressure, self.min_pressure, self.max_pressure)
        inner_f = ops.clip(force, self.min_force, self.max_force)
        value, by_p, by_f = self._value_and_derivatives(inner_p / bar, inner_f)
        return value + by_p * (pressure - inner_p) / bar + by_f * (force - inner_f)

    def _value_and_derivatives(self, p: Value, f: Value) -> tuple[Value, Value, Value]:
        """The polynomial and its slopes by p [bar] and F [N], by Horner's scheme in both."""
        width = self.force_degree + 1
        value: Value = 0.0
        by_p: Value = 0.0
        by_f: Value = 0.0
        for start in range(len(self.coefficients) - width, -1, -width):
            row = self.coefficients[start : start + width]
            by_p = by_p * p + value
            value = value * p + _horner(row, f)
            by_f = by_f * p + _horner(tuple(j * a for j, a in enumerate(row))[1:], f)
        return value, by_p, by_f


@model
class BorzikovaDirect(_PolynomialSurface):
    """Contraction as a polynomial: k = Sum_{i=0..m} Sum_{j=0..n} a_ij p^i F^j.

    k contraction in per cent, p gauge pressure in bar, F load in N; m = 4 and n = 2 give the 15 coefficients
    that the paper prints in a matrix. Outside its validity range, where nothing was measured, the surface goes on by its
    tangent and `inside_validity_range` says so.
    Reference: Borzikova et al., the printed matrix: it is this polynomial, not the exponent of equation (1).
    """

    def contraction(self, pressure: Value, force: Value) -> Value:
        return percent * self.polynomial(pressure, force)


@model
class BorzikovaExponential(_PolynomialSurface):
    """Contraction that saturates: k = k_max (1 - exp v), v = Sum_{i=0..m} Sum_{j=0..n} a_ij p^i F^j.

    p gauge pressure in bar, F load in N, k_max the contraction that the muscle saturates towards [1], 0.40
    for the SAM 30 x 290. The coefficients depend on material and geometry: each muscle must be measured.
    Outside its validity range v goes on by its tangent.
    Reference: Borzikova et al., equation (1).
    """

    saturation: float = parameter(
        "1", "k_max", "contraction that the muscle saturates towards", bounds=(1e-3, 1.0), kw_only=True
    )

    def contraction(self, pressure: Value, force: Value) -> Value:
        return self.saturation * (1.0 - ops.exp(self.polynomial(pressure, force)))


def _horner(coefficients: tuple[float, ...], x: Value) -> Value:
    value: Value = 0.0
    for a in reversed(coefficients):
        value = value * x + a
    return value
