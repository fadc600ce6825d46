"""Contractile surface of Hill's muscle model: polynomial of total degree n in contraction and
pressure.
"""

import dataclasses
import functools
from collections.abc import Callable
from typing import ClassVar

from ....core import ParameterError, Reference, Value, model, ops, parameter, published
from ..geometry.base import check_degree
from .base import Characteristic, ForceLaw
from .data_scales import DataScales, MeasuredPoints
from .validity_range import Limits, ValidityRange

HOSOVSKY_HILL = published("hosovsky-hill")


@functools.cache
def exponents(degree: int) -> tuple[tuple[int, int], ...]:
    """Return the powers (i, j) of contraction and pressure with i + j <= degree, in the order of
    the coefficients.
    """
    return tuple((i, j) for j in range(degree + 1) for i in range(degree + 1 - j))


@model
class ContractileSurface(ForceLaw):
    """Polynomial force surface: F = clamp(Sum_{i+j<=n} a_ij x^i q^j).

        x = (2 eps - eps_low - eps_high)/(eps_high - eps_low),   q likewise from p

    eps: contraction [1]; p: gauge pressure [Pa]; x, q: contraction and pressure scaled to -1..1 on
    the validity range; a_ij: coefficients [N] of the scaled polynomial; n = 5 gives the 21
    coefficients of the paper. The scaling keeps the fit well conditioned. Outside the validity
    range the surface is extrapolated linearly, with a slope that is limited so that force neither
    increases with contraction nor decreases with pressure. Reference: Hošovský et al., F_KE = f(k,
    P) below their equation (1).
    """

    references: ClassVar[tuple[Reference, ...]] = (HOSOVSKY_HILL,)
    linear_in: ClassVar[tuple[str, ...]] = ("coefficients",)
    """The parameters in which the model is linear; a fit solves for them by linear least
    squares.
    """

    coefficients: tuple[float, ...] = parameter(
        "N",
        "a_ij",
        "coefficients of the polynomial: a(x^i q^j) of powers of contraction x and pressure q, each"
        " scaled to -1..1 on the validity range; ordered by power of pressure",
    )
    min_pressure: float = parameter(
        "Pa", "p_low", "lower limit of the validity range in gauge pressure", fitted=False
    )
    max_pressure: float = parameter(
        "Pa", "p_high", "upper limit of the validity range in gauge pressure", fitted=False
    )
    min_contraction: float = parameter(
        "1", "eps_low", "lower limit of the validity range in contraction", fitted=False
    )
    max_contraction: float = parameter(
        "1", "eps_high", "upper limit of the validity range in contraction", fitted=False
    )
    min_force: float = parameter(
        "N", "F_min", "lower limit of the force", fitted=False, default=0.0
    )
    max_force: float = parameter(
        "N", "F_max", "upper limit of the force", fitted=False, default=1200.0
    )
    degree: int = 5

    def check(self) -> None:
        check_degree("ContractileSurface", self.degree)
        expected = (self.degree + 1) * (self.degree + 2) // 2
        if len(self.coefficients) != expected:
            raise ParameterError(
                f"ContractileSurface: degree {self.degree} requires {expected} coefficients, not "
                f"{len(self.coefficients)}."
            )

    @classmethod
    def blank(
        cls, degree: int = 5, *, min_force: float = 0.0, max_force: float = 1e5
    ) -> "ContractileSurface":
        """Return a surface with zero coefficients as the initial model of `fit`, which sets the
        validity range.

        The fitted surface is limited to `min_force` and `max_force`; the default limit is above the
        force of a muscle.
        """
        check_degree("ContractileSurface", degree)
        size = len(exponents(degree))
        return cls((0.0,) * size, 0.0, 1.0, 0.0, 1.0, min_force, max_force, degree)

    @classmethod
    def guess(cls, data: MeasuredPoints, degree: int = 5) -> "ContractileSurface":
        """Return the blank surface of a total degree with an upper limit of twice the measured
        force.
        """
        return cls.blank(degree, max_force=max(2.0 * DataScales.of(data).force, 1.0))

    @classmethod
    def variants(
        cls, data: MeasuredPoints, surface: Callable[[int], ForceLaw]
    ) -> dict[str, Characteristic]:
        return {f"surface of degree {n}": cls.guess(data, n) for n in range(1, 7)}

    def with_validity_range(self, pressure: Limits, contraction: Limits) -> "ContractileSurface":
        """Return the surface with the same coefficients on another validity range; `fit` calls it
        before it solves.
        """
        limits = (*pressure, *contraction, self.min_force, self.max_force)
        return ContractileSurface(self.coefficients, *limits, self.degree)

    def rescaled(self, pressure: Limits, contraction: Limits) -> "ContractileSurface":
        """Return the same polynomial on another validity range, outside which it is extrapolated
        linearly.
        """
        new = self.with_validity_range(pressure, contraction)
        x0, q0 = self._scale(0.0, 0.0)
        new_x0, new_q0 = new._scale(0.0, 0.0)
        factor_x = (new.max_contraction - new.min_contraction) / (
            self.max_contraction - self.min_contraction
        )
        factor_q = (new.max_pressure - new.min_pressure) / (self.max_pressure - self.min_pressure)
        powers_x = _powers_of_linear(x0 - factor_x * new_x0, factor_x, self.degree)
        powers_q = _powers_of_linear(q0 - factor_q * new_q0, factor_q, self.degree)
        return dataclasses.replace(
            new, coefficients=tuple(self._expand(powers_x, powers_q).values())
        )

    @property
    def validity_range(self) -> ValidityRange:
        """Range of the data; outside, the surface is extrapolated linearly."""
        return ValidityRange(
            self.min_pressure, self.max_pressure, self.min_contraction, self.max_contraction
        )

    def force(self, pressure: Value, contraction: Value) -> Value:
        return ops.clip(self.polynomial(pressure, contraction), self.min_force, self.max_force)

    def unclamped_force(self, pressure: Value, contraction: Value) -> Value:
        return self.polynomial(pressure, contraction)

    def basis(self, pressure: Value, contraction: Value) -> list[Value]:
        """Basis functions at points in the validity range, one per coefficient: the columns of the
        design matrix.
        """
        x, q = self._scale(pressure, contraction)
        powers_x = [x * 0.0 + 1.0]
        powers_q = [q * 0.0 + 1.0]
        for _ in range(self.degree):
            powers_x.append(powers_x[-1] * x)
            powers_q.append(powers_q[-1] * q)
        return [powers_x[i] * powers_q[j] for i, j in exponents(self.degree)]

    @property
    def term_labels(self) -> tuple[str, ...]:
        """Labels of the basis functions for tables and messages, such as `x^2 q`."""
        return _term_labels(self.degree)

    def polynomial(self, pressure: Value, contraction: Value) -> Value:
        """Force [N] before the limits are applied, extrapolated linearly outside the validity
        range.
        """
        x, q = self._scale(pressure, contraction)
        inner_q = ops.clip(q, -1.0, 1.0)
        inner_x = ops.clip(x, -1.0, 1.0)
        # the polynomial and its derivatives by x and q, by Horner's method in both variables
        value: Value = 0.0
        by_x: Value = 0.0
        by_q: Value = 0.0
        start = len(self.coefficients)
        for j in range(self.degree, -1, -1):
            start -= self.degree + 1 - j
            row: Value = 0.0
            slope: Value = 0.0
            for a in reversed(self.coefficients[start : start + self.degree + 1 - j]):
                slope = slope * inner_x + row
                row = row * inner_x + a
            by_q = by_q * inner_q + value
            value = value * inner_q + row
            by_x = by_x * inner_q + slope
        return (
            value + ops.minimum(by_x, 0.0) * (x - inner_x) + ops.maximum(by_q, 0.0) * (q - inner_q)
        )

    def _scale(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        """Scaled contraction x and pressure q, from -1 to 1 on the validity range."""
        half_p = (self.max_pressure - self.min_pressure) / 2
        half_c = (self.max_contraction - self.min_contraction) / 2
        return (contraction - self.min_contraction) / half_c - 1, (
            pressure - self.min_pressure
        ) / half_p - 1

    def monomial_coefficients(self, pressure_unit: float = 1.0) -> dict[tuple[int, int], float]:
        """Return the coefficients of eps^i p^j in the validity range, p in units of `pressure_unit`
        [Pa] (1e5: bar).

        Returns {(i, j): value in N per pressure_unit^j}. Monomials are badly conditioned: for
        export, not for fits.
        """
        scale_c = 2 / (self.max_contraction - self.min_contraction)
        scale_p = 2 / (self.max_pressure - self.min_pressure)
        powers_c = _powers_of_linear(-1 - scale_c * self.min_contraction, scale_c, self.degree)
        powers_p = _powers_of_linear(
            -1 - scale_p * self.min_pressure, scale_p * pressure_unit, self.degree
        )
        return self._expand(powers_c, powers_p)

    def _expand(
        self, powers_x: list[list[float]], powers_q: list[list[float]]
    ) -> dict[tuple[int, int], float]:
        """Coefficients of the polynomial in the variables in which the powers of x and q are
        given.
        """
        monomial = dict.fromkeys(exponents(self.degree), 0.0)
        for (i, j), a in zip(exponents(self.degree), self.coefficients, strict=True):
            for m, by_x in enumerate(powers_x[i]):
                for n, by_q in enumerate(powers_q[j]):
                    monomial[m, n] += a * by_x * by_q
        return monomial


@functools.cache
def _term_labels(degree: int) -> tuple[str, ...]:
    x, q = (
        ["", symbol, *(f"{symbol}^{power}" for power in range(2, degree + 1))] for symbol in "xq"
    )
    return tuple(f"{x[i]} {q[j]}".strip() or "1" for i, j in exponents(degree))


def _powers_of_linear(constant: float, factor: float, degree: int) -> list[list[float]]:
    """Coefficients of (constant + factor t)^i in t, for i up to `degree`."""
    powers = [[1.0]]
    for _ in range(degree):
        multiplied = zip([*powers[-1], 0.0], [0.0, *powers[-1]], strict=True)
        powers.append([constant * same + factor * lower for same, lower in multiplied])
    return powers
