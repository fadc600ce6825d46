"""Contractile surface of Hill's muscle model: a polynomial of total degree n in contraction and pressure."""

from __future__ import annotations

from typing import ClassVar

from ..core import ops
from ..core.declaration import model, parameter
from ..core.errors import ParameterError
from ..core.ops import Value
from ..core.reference import Reference
from .base import ForceLaw
from .validity_range import ValidityRange

HOSOVSKY_HILL = Reference(
    "hosovsky-hill",
    "Hosovsky, A. et al.",
    "Pneumatic artificial muscle modelling based on modified Hill's muscle model",
    "TU Kosice",
    note="polynomial of total degree five in contraction and pressure, 21 coefficients, clamped to 0..1200 N; "
    "the coefficients are not printed",
)


def exponents(degree: int) -> tuple[tuple[int, int], ...]:
    """The powers (i, j) of contraction and pressure with i + j <= degree, in the order of the coefficients."""
    return tuple((i, j) for j in range(degree + 1) for i in range(degree + 1 - j))


@model
class ContractileSurface(ForceLaw):
    """F = clamp( Sum_{i+j<=n} a_ij x^i q^j ), with x and q the contraction and pressure scaled to -1..1 on the validity range.

        x = (2 eps - eps_low - eps_high)/(eps_high - eps_low),   q likewise from p

    eps contraction [1], p gauge pressure [Pa], a_ij scaled coefficients [N], n = 5 gives the 21 of the paper.
    Scaling is what keeps the fit well conditioned. Outside the validity range, where there was no data, the surface goes on
    by its tangent, but there it neither rises with contraction nor falls with pressure, which no muscle does.
    Reference: Hosovsky et al., F_KE = f(k, P) under their equation (1).
    """

    references: ClassVar[tuple[Reference, ...]] = (HOSOVSKY_HILL,)
    linear_in: ClassVar[str] = "coefficients"
    """The parameters in which the law is linear, so that a fit solves for them directly."""

    coefficients: tuple[float, ...] = parameter("N", "a_ij", "coefficients of the scaled powers, by pressure's power")
    min_pressure: float = parameter("Pa", "p_low", "lower end of the validity range in gauge pressure", fitted=False)
    max_pressure: float = parameter("Pa", "p_high", "upper end of the validity range in gauge pressure", fitted=False)
    min_contraction: float = parameter("1", "eps_low", "lower end of the validity range in contraction", fitted=False)
    max_contraction: float = parameter("1", "eps_high", "upper end of the validity range in contraction", fitted=False)
    min_force: float = parameter("N", "F_min", "force that the clamp lets through at least", fitted=False, default=0.0)
    max_force: float = parameter(
        "N", "F_max", "force that the clamp lets through at most", fitted=False, default=1200.0
    )
    degree: int = 5

    def check(self) -> None:
        wanted = len(exponents(self.degree))
        if len(self.coefficients) != wanted:
            raise ParameterError(
                f"ContractileSurface: degree {self.degree} needs {wanted} coefficients, not {len(self.coefficients)}."
            )
        for name, low, high in (
            ("pressure", self.min_pressure, self.max_pressure),
            ("contraction", self.min_contraction, self.max_contraction),
            ("force", self.min_force, self.max_force),
        ):
            if not low < high:
                raise ParameterError(f"ContractileSurface: min_{name} {low:g} must lie below max_{name} {high:g}.")

    @classmethod
    def blank(cls, degree: int = 5, *, min_force: float = 0.0, max_force: float = 1200.0) -> ContractileSurface:
        """A surface without coefficients yet, for `fit`, which takes its validity range from the data."""
        size = len(exponents(degree))
        return cls((0.0,) * size, 0.0, 1.0, 0.0, 1.0, min_force, max_force, degree)

    def with_validity_range(
        self, pressure: tuple[float, float], contraction: tuple[float, float]
    ) -> ContractileSurface:
        """The surface with the same coefficients on another validity range; `fit` calls it before it solves."""
        return ContractileSurface(
            self.coefficients, *pressure, *contraction, self.min_force, self.max_force, self.degree
        )

    @property
    def validity_range(self) -> ValidityRange:
        """Where the surface has data; outside it goes on by its tangent."""
        return ValidityRange(self.min_pressure, self.max_pressure, self.min_contraction, self.max_contraction)

    def force(self, pressure: Value, contraction: Value) -> Value:
        return ops.clip(self.polynomial(pressure, contraction), self.min_force, self.max_force)

    def unclamped_force(self, pressure: Value, contraction: Value) -> Value:
        return self.polynomial(pressure, contraction)

    def basis(self, pressure: Value, contraction: Value) -> list[Value]:
        """What each coefficient multiplies at points inside the validity range: the columns of the matrix that a fit solves."""
        x, q = self._scale(pressure, contraction)
        powers_x, powers_q = [x * 0.0 + 1.0], [q * 0.0 + 1.0]
        for _ in range(self.degree):
            powers_x.append(powers_x[-1] * x)
            powers_q.append(powers_q[-1] * q)
        return [powers_x[i] * powers_q[j] for i, j in exponents(self.degree)]

    @property
    def term_labels(self) -> tuple[str, ...]:
        """What each coefficient multiplies, in words for tables and messages: `x^2 q`."""
        return tuple(f"{_power_label('x', i)} {_power_label('q', j)}".strip() or "1" for i, j in exponents(self.degree))

    def polynomial(self, pressure: Value, contraction: Value) -> Value:
        """The force [N] before the clamp, continued by its tangent outside the validity range."""
        x, q = self._scale(pressure, contraction)
        inner_q, inner_x = ops.clip(q, -1.0, 1.0), ops.clip(x, -1.0, 1.0)
        value, by_x, by_q = self._horner(inner_x, inner_q)
        return value + ops.minimum(by_x, 0.0) * (x - inner_x) + ops.maximum(by_q, 0.0) * (q - inner_q)

    def _scale(self, pressure: Value, contraction: Value) -> tuple[Value, Value]:
        """Contraction and pressure as x and q, from -1 to 1 on the validity range."""
        half_p = (self.max_pressure - self.min_pressure) / 2
        half_c = (self.max_contraction - self.min_contraction) / 2
        return (contraction - self.min_contraction) / half_c - 1, (pressure - self.min_pressure) / half_p - 1

    def _horner(self, x: Value, q: Value) -> tuple[Value, Value, Value]:
        """The polynomial and its slopes by x and q, by Horner's scheme in both variables."""
        value: Value = 0.0
        by_x: Value = 0.0
        by_q: Value = 0.0
        start = len(self.coefficients)
        for j in range(self.degree, -1, -1):
            start -= self.degree + 1 - j
            row: Value = 0.0
            slope: Value = 0.0
            for a in reversed(self.coefficients[start : start + self.degree + 1 - j]):
                slope = slope * x + row
                row = row * x + a
            by_q = by_q * q + value
            value = value * q + row
            by_x = by_x * q + slope
        return value, by_x, by_q

    def monomial_coefficients(self, pressure_unit: float = 1.0) -> dict[tuple[int, int], float]:
        """Coefficients of eps^i p^j inside the validity range, p in multiples of `pressure_unit` [Pa] (1e5 for bar).

        Returns {(i, j): value in N per pressure_unit^j}. Plain powers are badly conditioned: for export, not for fits.
        """
        scale_c = 2 / (self.max_contraction - self.min_contraction)
        scale_p = 2 / (self.max_pressure - self.min_pressure)
        powers_c = _powers_of_linear(-1 - scale_c * self.min_contraction, scale_c, self.degree)
        powers_p = _powers_of_linear(-1 - scale_p * self.min_pressure, scale_p * pressure_unit, self.degree)
        plain = dict.fromkeys(exponents(self.degree), 0.0)
        for (i, j), a in zip(exponents(self.degree), self.coefficients, strict=True):
            for m, by_c in enumerate(powers_c[i]):
                for n, by_p in enumerate(powers_p[j]):
                    plain[m, n] += a * by_c * by_p
        return plain


def _power_label(symbol: str, exponent: int) -> str:
    return "" if exponent == 0 else symbol if exponent == 1 else f"{symbol}^{exponent}"


def _powers_of_linear(constant: float, factor: float, degree: int) -> list[list[float]]:
    """The coefficients of (constant + factor t)^i in t, for i up to `degree`."""
    powers = [[1.0]]
    for _ in range(degree):
        last = powers[-1]
        powers.append(
            [
                constant * (last[m] if m < len(last) else 0.0) + factor * (last[m - 1] if m else 0.0)
                for m in range(len(last) + 1)
            ]
        )
    return powers
