"""Force of a law in any form: force laws directly, contraction and pressure laws by inversion on a grid of forces."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..characteristic.base import ContractionLaw, ForceLaw
from ..core.arrays import Array
from ..core.errors import IdentificationError, SolveError
from ..core.hints import HintedText

FORCE_GRID_POINTS = 801
"""Grid points between zero and the maximum force; the law is interpolated linearly between them."""


def evaluate_force(law: Any, pressure: Array, contraction: Array, max_force: float) -> Array:
    """Forces [N] at N points, shape (N,), defined at every point so that all laws are compared on the same rows.

    `max_force` [N] limits the force of laws that give contraction or pressure. Where such a law needs a higher
    pressure at zero load than is applied, the muscle is slack and the force is 0.
    """
    with np.errstate(all="ignore"):
        if isinstance(law, ForceLaw):
            force = np.asarray(law.force(pressure, contraction), dtype=float) + np.zeros(pressure.size)
        else:
            force = _invert_on_grid(law, pressure, contraction, max_force)
    return np.asarray(np.nan_to_num(force, nan=0.0, posinf=max_force, neginf=-max_force))


def slack_rows(law: Any, pressure: Array, contraction: Array) -> npt.NDArray[np.bool_]:
    """Mask (N,) of the points at which a law that is solved for the force is slack: it has no root, even at zero load.

    Always False for force laws. Raises IdentificationError where the law gives no force at a point without being slack.
    """
    nowhere = np.zeros(pressure.size, dtype=bool)
    if isinstance(law, ForceLaw) or _solve_error(law, pressure, contraction) is None:
        return nowhere
    slack = np.asarray(_deficit(law, pressure, contraction, np.zeros(pressure.size)) > 0)
    error = _solve_error(law, pressure[~slack], contraction[~slack])
    if error is not None:
        raise IdentificationError(HintedText("It gives no force at a measured point. ", error.message))
    return slack


def _solve_error(law: Any, pressure: Array, contraction: Array) -> SolveError | None:
    try:
        law.force(pressure, contraction)
    except SolveError as error:
        return error
    return None


def _deficit(law: Any, pressure: Array, contraction: Array, force: Array) -> Array:
    """Negative where the muscle pulls more than the force: the contraction or the pressure that it lacks."""
    if isinstance(law, ContractionLaw):
        return np.asarray(contraction - law.contraction(pressure, force))
    return np.asarray(law.pressure(contraction, force) - pressure)


def _invert_on_grid(law: Any, pressure: Array, contraction: Array, max_force: float) -> Array:
    forces = np.linspace(0.0, max_force, FORCE_GRID_POINTS)
    deficit = _deficit(law, pressure[:, None], contraction[:, None], forces)
    crossed = np.asarray(deficit >= 0)
    first = np.where(crossed.any(axis=1), crossed.argmax(axis=1), FORCE_GRID_POINTS - 1)
    rows = np.arange(pressure.size)
    previous = np.maximum(first - 1, 0)
    high, low = deficit[rows, first], deficit[rows, previous]
    with np.errstate(all="ignore"):
        fraction = np.where((first > 0) & crossed.any(axis=1), -low / (high - low), 1.0)
    return np.asarray(np.where(first == 0, 0.0, forces[previous] + fraction * (forces[first] - forces[previous])))
