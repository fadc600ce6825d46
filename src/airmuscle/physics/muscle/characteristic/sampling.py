"""Samples of a law for a fit of another one: finite, plausible, and approximated by the result."""

import numpy as np  # noqa: TID251  (samples are numbers)

from ....core import Array, SolveError
from .base import Characteristic
from .beyond_range import STRAIGHT_FIBRES
from .modes import values_or_nan
from .validity_range import FORCE_BOUNDS, ValidityRange

BOUNDED_FROM = 0.01
"""Contraction [1] from which a range of straight fibres is proposed (chosen)."""
MAX_UNEXPLAINED = 0.5
"""Rms error of an approximation, relative to the standard deviation of the force, above which it
approximates nothing (chosen)."""
_ROUNDING = 1e-9
"""Rms error relative to the greatest force that is rounding, of a constant force (chosen)."""


def sample_force(
    owner: str, law: Characteristic, limits: ValidityRange, pressure: Array, contraction: Array
) -> Array:
    """Forces of a law [N] at points (N,) of a validity range; NaN where it has no solution.

    Raises SolveError, with a range to use, where the force is infinite or above 1 MN.
    """
    low, high = limits.contraction
    if law.begins_at_straight_fibres and low < STRAIGHT_FIBRES < BOUNDED_FROM < high:
        _refuse(owner, law, (limits.min_pressure, max(low, 0.0)), (BOUNDED_FROM, high))
    force = values_or_nan(law.force, pressure, contraction)
    unbounded = np.abs(force) > FORCE_BOUNDS[1]
    if unbounded.any():
        first = int(np.argmax(unbounded))
        column = np.isin(contraction, contraction[unbounded])
        rest = contraction[~column]
        bounds = (float(rest.min()), float(rest.max())) if rest.size else None
        _refuse(owner, law, (pressure[first], contraction[first]), bounds)
    return force


def _refuse(
    owner: str,
    law: Characteristic,
    point: tuple[float, float],
    bounds: tuple[float, float] | None,
) -> None:
    pressure, contraction = point
    remedy = "Choose a validity range without this point."
    if bounds is not None:
        remedy = (
            "Choose a validity range without this point, such as contractions from"
            f" {100 * bounds[0]:.4g} % to {100 * bounds[1]:.4g} %."
        )
    raise SolveError(
        f"{owner}: the force of {type(law).__name__} is unbounded at a contraction of"
        f" {100 * contraction:.4g} % and {pressure / 1e3:.4g} kPa. {remedy}"
    )


def check_approximates(owner: str, name: str, error: Array, force: Array) -> None:
    """Raise SolveError for an approximation whose rms error is not below half the standard
    deviation of the force [N]; `name` is that of the approximating law."""
    rms = float(np.sqrt(np.mean(error**2)))
    spread = float(np.std(force))
    if not rms <= MAX_UNEXPLAINED * spread + _ROUNDING * float(np.abs(force).max()):
        raise SolveError(
            f"{owner}: {name} does not approximate the law: its rms error is {rms:.4g} N, and the"
            f" standard deviation of the force is {spread:.4g} N. Choose a smaller validity range,"
            " a higher degree or another model."
        )
