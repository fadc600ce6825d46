"""Polynomial surrogate: a traceable approximation of any characteristic, with its approximation error."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from ....core.arrays import Array
from ....core.declaration import model, parameter
from ....core.errors import AirmuscleWarning, PhysicsError, SolveError
from ....core.ops import Value
from ..geometry.base import check_degree
from .base import Characteristic, ForceLaw
from .contractile_surface import ContractileSurface, exponents
from .error_search import estimate_maximum
from .solve import unsolved_as_nan
from .validity_range import ValidityRange

_NO_CLAMP = 1e6
"""Force limit [N] of the surface, above that of any muscle, so that negative forces are approximated as well."""
_MARGIN = 1.05
"""Factor of the maximum error that the search finds, chosen, for what lies between the points of its last grids."""


@model
class PolynomialSurrogate(ForceLaw):
    """Polynomial surface fitted to another characteristic, with its errors on the validity range.

    `max_error` is estimated: 1.05 times the maximum that a search finds (grid, edge of the region with a solution,
    local refinement). It is no proven bound: a peak of the error narrower than 1/38 of the range may be missed.
    `coverage` is the fraction of the validity range in which that characteristic has a solution; elsewhere the
    polynomial is extrapolated.
    """

    surface: ContractileSurface
    max_error: float = parameter(
        "N", "dF_max", "estimated maximum error on the validity range", bounds=(0.0, 1e9), fitted=False
    )
    rms_error: float = parameter(
        "N", "dF_rms", "root mean square error on the validity range", bounds=(0.0, 1e9), fitted=False
    )
    coverage: float = parameter(
        "1", "A", "fraction of the validity range with a solution", bounds=(0.0, 1.0), fitted=False
    )
    surrogate_of: str = ""

    @property
    def contraction_range(self) -> tuple[float, float]:
        return (self.surface.min_contraction, self.surface.max_contraction)

    def force(self, pressure: Value, contraction: Value) -> Value:
        return self.surface.force(pressure, contraction)


def as_force_law(law: Characteristic, validity_range: ValidityRange, *, degree: int = 9) -> PolynomialSurrogate:
    """Return a traceable force law that approximates `law` on a validity range.

    A polynomial of total degree `degree` is fitted by least squares on a dense grid; the errors are evaluated on a
    second grid between its points, from which the search for the maximum error starts. Points without a solution are
    omitted, with an AirmuscleWarning that states their fraction. Raises SolveError if too few points have a solution,
    or if the force is unbounded at one of them, as that of straight fibres at zero contraction, and ParameterError for
    a degree that is not an integer, 0 or more.
    """
    check_degree("as_force_law", degree)
    count = 4 * (degree + 1)
    pressure, contraction = _grid(validity_range, np.cos(np.pi * (np.arange(count) + 0.5) / count))
    force = forces_or_nan(law, pressure, contraction)
    known = np.isfinite(force)
    if known.sum() < 2 * len(exponents(degree)):
        raise SolveError(
            f"as_force_law: {type(law).__name__} has a solution at {known.sum()} of {known.size} points of the "
            f"validity range, too few for degree {degree}. Choose a validity range in which the model has solutions."
        )
    x, q = _scale(validity_range, pressure[known], contraction[known])
    powers = np.stack([x**i * q**j for i, j in exponents(degree)], axis=1)
    coefficients = np.linalg.lstsq(powers, force[known], rcond=None)[0]
    surface = ContractileSurface(
        tuple(float(a) for a in coefficients),
        *validity_range.pressure,
        *validity_range.contraction,
        -_NO_CLAMP,
        _NO_CLAMP,
        degree,
    )
    return _with_errors(law, surface, validity_range)


def _with_errors(
    law: Characteristic, surface: ContractileSurface, validity_range: ValidityRange
) -> PolynomialSurrogate:
    """Return the surrogate of a fitted surface with its errors."""
    nodes = np.linspace(-1.0, 1.0, 4 * surface.degree + 3)
    pressure, contraction = _grid(validity_range, nodes)
    force = forces_or_nan(law, pressure, contraction)
    if (unbounded := np.abs(force) > _NO_CLAMP).any():
        at = int(np.argmax(unbounded))
        raise SolveError(
            f"as_force_law: the force of {type(law).__name__} is unbounded at a contraction of "
            f"{100 * contraction[at]:.4g} % and {pressure[at] / 1e3:.4g} kPa. Choose a validity range without this "
            "point."
        )
    error = surface.force(pressure, contraction) - force
    known = np.isfinite(error)
    if not known.all():
        warnings.warn(
            f"{type(law).__name__} has no solution on {100 * (1 - known.mean()):.2g} % of the validity range; the "
            "values of its polynomial surrogate there are meaningless.",
            AirmuscleWarning,
            stacklevel=4,
        )

    def magnitude(x: Array, q: Array) -> Array:
        at = _physical(validity_range, x, q)
        return np.asarray(np.abs(surface.force(*at) - forces_or_nan(law, *at)))

    largest = _MARGIN * estimate_maximum(magnitude, np.abs(error).reshape(nodes.size, nodes.size), nodes)
    rms = float(np.sqrt(np.mean(error[known] ** 2)))
    return PolynomialSurrogate(surface, largest, rms, float(known.mean()), type(law).__name__)


def _grid(validity_range: ValidityRange, nodes: Array) -> tuple[Array, Array]:
    """Pressures [Pa] and contractions [1] of all pairs of scaled nodes in -1..1, as two vectors."""
    q, x = (v.reshape(-1) for v in np.meshgrid(nodes, nodes, indexing="ij"))
    return _physical(validity_range, x, q)


def _physical(validity_range: ValidityRange, x: Array, q: Array) -> tuple[Array, Array]:
    """Pressures [Pa] and contractions [1] of the scaled contraction x and pressure q, -1..1."""
    (p_low, p_high), (c_low, c_high) = validity_range.pressure, validity_range.contraction
    pressure = np.clip(p_low + (q + 1) / 2 * (p_high - p_low), p_low, p_high)
    return pressure, np.clip(c_low + (x + 1) / 2 * (c_high - c_low), c_low, c_high)


def _scale(validity_range: ValidityRange, pressure: Array, contraction: Array) -> tuple[Array, Array]:
    """Contraction and pressure scaled to -1..1 on the validity range."""
    (p_low, p_high), (c_low, c_high) = validity_range.pressure, validity_range.contraction
    return 2 * (contraction - c_low) / (c_high - c_low) - 1, 2 * (pressure - p_low) / (p_high - p_low) - 1


def forces_or_nan(law: Characteristic, pressure: Array, contraction: Array) -> Array:
    """Forces [N] at N points, NaN without a solution; bisects the points to locate those."""
    try:
        with unsolved_as_nan():
            force: Any = np.asarray(law.force(pressure, contraction), dtype=float)
    except PhysicsError:
        if pressure.size == 1:
            return np.array([np.nan])
        half = pressure.size // 2
        halves = (forces_or_nan(law, pressure[s], contraction[s]) for s in (slice(None, half), slice(half, None)))
        return np.concatenate(list(halves))
    return np.broadcast_to(force, pressure.shape)
