"""Borzíková et al.: contraction of the Shadow Air Muscle SAM 30 x 290, three plane curves and two
surfaces.

The coefficients are given as printed in the paper, in per cent, bar and newton. They are converted
when used and are not refitted.
"""

import abc
from collections.abc import Callable
from typing import ClassVar

import numpy as np

from ....core import (
    GeometryLimitError,
    ParameterError,
    Reference,
    Value,
    model,
    ops,
    parameter,
    published,
)
from ....core.units import bar, percent
from .base import ContractionLaw
from .modes import is_formula_alone
from .solve import check_solution, describe_range

BORZIKOVA = published("borzikova-sam")


@model
class PlaneCurve:
    """Contraction at one constant load, as fitted in the paper: k = k_max (1 - exp(b_0 + b_1 p +
    ...)).

    p: gauge pressure in bar; k_max: saturation contraction. The authors computed the correlation
    index IK from measurements that are lost. Reference: Borzíková et al., the three plane
    characteristics.
    """

    force: float = parameter(
        "N", "F", "constant load of the curve", bounds=(0.0, 1e5), fitted=False
    )
    coefficients: tuple[float, ...] = parameter(
        "1/bar^i", "b_i", "coefficients of the exponent, by power of p in bar"
    )
    saturation: float = parameter("1", "k_max", "saturation contraction", bounds=(1e-3, 1.0))
    printed_index: float = parameter(
        "1", "IK", "printed correlation index of the curve", bounds=(0, 1), fitted=False
    )

    def exponent(self, pressure: Value) -> Value:
        """Exponent [1] at a gauge pressure [Pa]."""
        return ops.polynomial(self.coefficients, pressure / bar)

    def contraction(self, pressure: Value) -> Value:
        """Contraction [1] at a gauge pressure [Pa]."""
        return self.saturation * (1.0 - ops.exp(self.exponent(pressure)))

    def turning_pressures(self) -> tuple[float, ...]:
        """Positive gauge pressures [Pa] of the extrema of the contraction, in ascending order."""
        roots = [complex(r) for r in np.polynomial.Polynomial(self.coefficients).deriv().roots()]
        return tuple(sorted(r.real * bar for r in roots if abs(r.imag) < 1e-9 and r.real > 0))


@model
class PlaneCurves:
    """Plane curves of one muscle; they replace its measurements, which are lost, as data."""

    references: ClassVar[tuple[Reference, ...]] = (BORZIKOVA,)

    curves: tuple[PlaneCurve, ...]
    max_pressure: float = parameter(
        "Pa", "p_high", "upper limit of the measured gauge pressure", fitted=False
    )

    def curve_at(self, force: float) -> PlaneCurve:
        """Return the curve of one load [N]. Raises GeometryLimitError if the paper has no curve for
        it.
        """
        if found := [curve for curve in self.curves if curve.force == force]:
            return found[0]
        loads = ", ".join(f"{c.force:g}" for c in self.curves)
        raise GeometryLimitError(
            f"No plane curve at {force:g} N; curves exist at {loads} N. Use a surface between these"
            " loads."
        )

    def interpolate(self) -> "BorzikovaExponential":
        """Return the exponential surface through all curves; its degree in the force is their
        number less one.
        """
        force_degree = len(self.curves) - 1
        loads = np.array([c.force for c in self.curves])
        degree = max(len(c.coefficients) for c in self.curves) - 1
        rows = np.array(
            [(*c.coefficients, *(0.0,) * (degree + 1 - len(c.coefficients))) for c in self.curves]
        )
        # in F / F_max, because the powers of the load are badly conditioned
        scaled = np.linalg.solve(
            np.vander(loads / loads.max(), force_degree + 1, increasing=True), rows
        ).T
        matrix = scaled / loads.max() ** np.arange(force_degree + 1)
        validity_range = (0.0, self.max_pressure, float(loads.min()), float(loads.max()))
        saturation = self.curves[0].saturation
        return BorzikovaExponential(
            tuple(matrix.ravel()), *validity_range, degree, force_degree, saturation=saturation
        )


SAM_30X290 = PlaneCurves(
    (
        PlaneCurve(45.0, (0.0856, -1.2602, 0.1273), 0.40, 0.998),
        PlaneCurve(130.0, (-0.0082, 0.0872, -0.3787, 0.0742), 0.40, 0.999),
        PlaneCurve(260.0, (0.007, 0.0147, -0.0034, -0.0607, 0.0127), 0.40, 0.999),
    ),
    3.5 * bar,
)
"""Plane curves at 4.5, 13 and 26 kg, converted to 45, 130 and 260 N as in the paper.

The minus signs are restored: plus signs are present in the text, so that a gap inside a sum is a
minus; the leading signs are those that agree with the printed matrix. The range of 3.5 bar is
inferred (the catalogue pressure).
"""


@model
class _PolynomialSurface(ContractionLaw):
    """Common part of the two surfaces: Sum_ij a_ij p^i F^j in bar and newton, and its validity
    range.
    """

    references: ClassVar[tuple[Reference, ...]] = (BORZIKOVA,)
    refuses_beyond: ClassVar[bool] = True

    coefficients: tuple[float, ...] = parameter(
        "1/(bar^i N^j)",
        "a_ij",
        "coefficients ordered by power of p [bar], then of F [N]; for the direct surface in per"
        " cent",
    )
    min_pressure: float = parameter(
        "Pa", "p_low", "lower limit of the validity range in gauge pressure", fitted=False
    )
    max_pressure: float = parameter(
        "Pa", "p_high", "upper limit of the validity range in gauge pressure", fitted=False
    )
    min_force: float = parameter(
        "N", "F_low", "lower limit of the validity range in force", fitted=False
    )
    max_force: float = parameter(
        "N", "F_high", "upper limit of the validity range in force", fitted=False
    )
    pressure_degree: int = 4
    force_degree: int = 2

    def check(self) -> None:
        expected = (self.pressure_degree + 1) * (self.force_degree + 1)
        if len(self.coefficients) != expected:
            raise ParameterError(
                f"{type(self).__name__} with pressure_degree {self.pressure_degree} and"
                f" force_degree {self.force_degree} needs {expected} coefficients, not"
                f" {len(self.coefficients)}."
            )

    @property
    def pressure_range(self) -> tuple[float, float]:
        """Validity range in gauge pressure [Pa]; solutions are searched within it."""
        return (self.min_pressure, self.max_pressure)

    @property
    def force_range(self) -> tuple[float, float]:
        """Validity range in force [N]; solutions are searched within it."""
        return (self.min_force, self.max_force)

    def inside_validity_range(self, pressure: Value, force: Value) -> Value:
        """Return whether gauge pressure [Pa] and force [N] are within the validity range."""
        in_pressure = ops.both(pressure >= self.min_pressure, pressure <= self.max_pressure)
        return ops.both(in_pressure, ops.both(force >= self.min_force, force <= self.max_force))

    def force(self, pressure: Value, contraction: Value) -> Value:
        self._check_pressure(pressure + 0.0 * contraction)
        return super().force(pressure, contraction)

    def pressure(self, contraction: Value, force: Value) -> Value:
        self._check_force(force + 0.0 * contraction)
        return super().pressure(contraction, force)

    def contraction(self, pressure: Value, force: Value) -> Value:
        if not is_formula_alone():  # a search looks beyond the range
            self._check_pressure(pressure + 0.0 * force)
            self._check_force(force + 0.0 * pressure)
        return self.surface(pressure, force)

    def _check_pressure(self, pressure: Value) -> None:
        """Raise SolveError for a gauge pressure [Pa] outside the validity range."""
        self._check(pressure, self.pressure_range, lambda p: f"{p / 1e3:.4g} kPa is")

    def _check_force(self, force: Value) -> None:
        """Raise SolveError for a tension [N] outside the validity range."""
        self._check(force, self.force_range, lambda f: f"{f:.4g} N is")

    def _check(
        self, value: Value, limits: tuple[float, float], text: Callable[[float], str]
    ) -> None:
        def message(number: float, _: float) -> str:
            pressures = describe_range(self.min_pressure / 1e3, self.max_pressure / 1e3, "kPa")
            return (
                f"{type(self).__name__}: {text(number)} outside the validity range of the surface,"
                f" {pressures} and {describe_range(*self.force_range, 'N')}. Choose a point inside,"
                " or fit a law to measurements there."
            )

        check_solution(value, limits, (value, value), message)

    @abc.abstractmethod
    def surface(self, pressure: Value, force: Value) -> Value:
        """Contraction [1] at a gauge pressure [Pa] and a tension [N], extrapolated outside the
        validity range."""

    def polynomial(self, pressure: Value, force: Value) -> Value:
        """Sum_ij a_ij p^i F^j at gauge pressure [Pa] and force [N]; linear extrapolation outside
        the validity range.
        """
        inner_p = ops.clip(pressure, self.min_pressure, self.max_pressure)
        inner_f = ops.clip(force, self.min_force, self.max_force)
        # the polynomial and its derivatives by p [bar] and F [N], by Horner's method in both
        # variables
        p = inner_p / bar
        width = self.force_degree + 1
        value: Value = 0.0
        by_p: Value = 0.0
        by_f: Value = 0.0
        for start in range(len(self.coefficients) - width, -1, -width):
            row = self.coefficients[start : start + width]
            by_p = by_p * p + value
            value = value * p + ops.polynomial(row, inner_f)
            by_f = by_f * p + ops.polynomial(tuple(j * a for j, a in enumerate(row))[1:], inner_f)
        return value + by_p * (pressure - inner_p) / bar + by_f * (force - inner_f)


@model
class BorzikovaDirect(_PolynomialSurface):
    """Polynomial contraction surface: k = Sum_{i=0..m} Sum_{j=0..n} a_ij p^i F^j.

    k: contraction in per cent; p: gauge pressure in bar; F: load in N; m = 4 and n = 2 give the 15
    coefficients of the printed matrix. Outside the validity range the surface is extrapolated
    linearly; `inside_validity_range` tests for it. Reference: Borzíková et al., the printed matrix,
    which belongs to this polynomial and not to the exponent of equation (1).
    """

    def surface(self, pressure: Value, force: Value) -> Value:
        return percent * self.polynomial(pressure, force)


@model
class BorzikovaExponential(_PolynomialSurface):
    """Exponential contraction surface: k = k_max (1 - exp v), v = Sum_{i=0..m} Sum_{j=0..n} a_ij
    p^i F^j.

    p: gauge pressure in bar; F: load in N; k_max: saturation contraction [1], 0.40 for the SAM 30 x
    290. The coefficients depend on material and geometry, so that each muscle must be measured.
    Outside the validity range v is extrapolated linearly. Reference: Borzíková et al., equation
    (1).
    """

    saturation: float = parameter(
        "1", "k_max", "saturation contraction", bounds=(1e-3, 1.0), kw_only=True
    )

    def surface(self, pressure: Value, force: Value) -> Value:
        return self.saturation * (1.0 - ops.exp(self.polynomial(pressure, force)))
