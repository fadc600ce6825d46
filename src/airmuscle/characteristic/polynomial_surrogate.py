"""Any characteristic as a traceable force law: a polynomial surface that says how far it is off."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np  # noqa: TID251  (the fit works on numbers; the law that it returns is traced)

from ..core.arrays import Array
from ..core.declaration import model, parameter
from ..core.errors import AirmuscleWarning, PhysicsError, SolveError
from ..core.ops import Value
from .base import Characteristic, ForceLaw
from .contractile_surface import ContractileSurface, exponents
from .validity_range import ValidityRange

_NO_CLAMP = 1e6
"""Clamp [N] of the surface: beyond any muscle, so that the surface follows the law below zero too."""


@model
class PolynomialSurrogate(ForceLaw):
    """F of a polynomial surface fitted to another law on a validity range; `max_error` and `rms_error` were measured there.

    `covered` is the part of the validity range where the law has an answer; elsewhere the polynomial goes on by itself.
    """

    surface: ContractileSurface
    max_error: float = parameter("N", "dF_max", "largest error on the validity range", bounds=(0.0, 1e9), fitted=False)
    rms_error: float = parameter(
        "N", "dF_rms", "root mean square error on the validity range", bounds=(0.0, 1e9), fitted=False
    )
    coverage: float = parameter(
        "1", "A", "part of the validity range where the law has an answer", bounds=(0.0, 1.0), fitted=False
    )
    surrogate_of: str = ""

    @property
    def contraction_range(self) -> tuple[float, float]:
        return (self.surface.min_contraction, self.surface.max_contraction)

    def force(self, pressure: Value, contraction: Value) -> Value:
        return self.surface.force(pressure, contraction)


def as_force_law(law: Characteristic, validity_range: ValidityRange, *, degree: int = 9) -> PolynomialSurrogate:
    """A traceable force law in place of `law` on a validity range: least squares of total degree `degree` on a dense grid.

    The errors are measured on a second grid between the points of the first. Where `law` has no answer there is
    nothing to fit, and an AirmuscleWarning says how much of the validity range that is. Raises NoSolution where nothing, or
    less than the polynomial needs, has an answer.
    """
    count = 4 * (degree + 1)
    pressure, contraction = _grid(validity_range, np.cos(np.pi * (np.arange(count) + 0.5) / count))
    force = _force_or_nan(law, pressure, contraction)
    known = np.isfinite(force)
    if known.sum() < 2 * len(exponents(degree)):
        raise SolveError(
            f"as_force_law: {type(law).__name__} has an answer at {known.sum()} of {known.size} points of the validity range, too "
            f"few for degree {degree}. Choose a validity range where the law holds."
        )
    x, q = _scale(validity_range, pressure[known], contraction[known])
    powers = np.stack([x**i * q**j for i, j in exponents(degree)], axis=1)
    found = np.linalg.lstsq(powers, force[known], rcond=None)[0]
    surface = ContractileSurface(
        tuple(float(a) for a in found),
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
    pressure, contraction = _grid(validity_range, np.linspace(-1.0, 1.0, 4 * surface.degree + 3))
    error = surface.force(pressure, contraction) - _force_or_nan(law, pressure, contraction)
    known = np.isfinite(error)
    if not known.all():
        warnings.warn(
            f"{type(law).__name__} has no answer on {1 - known.mean():.0%} of the validity range; there its stand-in goes on as a "
            "polynomial does, and means nothing.",
            AirmuscleWarning,
            stacklevel=3,
        )
    greatest, rms = np.abs(error[known]).max(), np.sqrt(np.mean(error[known] ** 2))
    return PolynomialSurrogate(surface, float(greatest), float(rms), float(known.mean()), type(law).__name__)


def _grid(validity_range: ValidityRange, places: Array) -> tuple[Array, Array]:
    """Pressures [Pa] and contractions [1] of all pairs of places in -1..1, as two vectors."""
    q, x = (v.reshape(-1) for v in np.meshgrid(places, places, indexing="ij"))
    (p_low, p_high), (c_low, c_high) = validity_range.pressure, validity_range.contraction
    pressure = np.clip(p_low + (q + 1) / 2 * (p_high - p_low), p_low, p_high)
    return pressure, np.clip(c_low + (x + 1) / 2 * (c_high - c_low), c_low, c_high)


def _scale(validity_range: ValidityRange, pressure: Array, contraction: Array) -> tuple[Array, Array]:
    (p_low, p_high), (c_low, c_high) = validity_range.pressure, validity_range.contraction
    return 2 * (contraction - c_low) / (c_high - c_low) - 1, 2 * (pressure - p_low) / (p_high - p_low) - 1


def _force_or_nan(law: Characteristic, pressure: Array, contraction: Array) -> Array:
    """The law's forces [N] at N points; NaN where it has none. Halves the points until those are found."""
    try:
        found: Any = np.asarray(law.force(pressure, contraction), dtype=float)
    except PhysicsError:
        if pressure.size == 1:
            return np.array([np.nan])
        half = pressure.size // 2
        parts = (_force_or_nan(law, pressure[s], contraction[s]) for s in (slice(None, half), slice(half, None)))
        return np.concatenate(list(parts))
    return np.broadcast_to(found, pressure.shape)
