"""A motion given by points, as the accelerations that a prescribed mechanism is driven with."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..core.errors import ParameterError
from .inputs import SampledSignal

ACCELERATION = "prescribed_acceleration"
"""The input of `PrescribedMotion`."""


class Trajectory(NamedTuple):
    """The command that drives a motion, and the position [m] and speed [m/s] that it begins with.

    `simulate(plant, motion.command, duration=..., start=plant.state_at(pressure=..., **motion.start))`; with other
    inputs, `Signal({**motion.command.points, "fill": ...})`.
    """

    command: SampledSignal
    start: dict[str, float]


def spline_trajectory(times: npt.ArrayLike, positions: npt.ArrayLike, *, from_rest: bool = True) -> Trajectory:
    """The motion along the cubic spline through positions (N,) [m] at times (N,) [s], for `PrescribedMotion`.

    The second derivative of a cubic spline is linear between its points, and so is an input: the motion is followed
    exactly, the spline's corners being instants. `from_rest` has it begin and end at rest; otherwise the first two and
    the last two pieces are one cubic each, which needs four points. Begin the run at times[0].
    Raises ParameterError for fewer than two points, points that are not finite, or times that do not rise.
    """
    try:
        t, y = np.asarray(times, dtype=float), np.asarray(positions, dtype=float)
    except (TypeError, ValueError):
        raise ParameterError(f"follow: {times!r} and {positions!r} are not times [s] and positions [m].") from None
    least = 2 if from_rest else 4
    if t.ndim != 1 or t.shape != y.shape or t.size < least:
        raise ParameterError(
            f"follow: give at least {least} times and as many positions; they are {t.shape} and {y.shape}."
        )
    if not (np.isfinite(t).all() and np.isfinite(y).all()):
        raise ParameterError("follow: times and positions must be finite.")
    if not (np.diff(t) > 0).all():
        i = int(np.argmax(np.diff(t) <= 0))
        raise ParameterError(f"follow: times must rise; after {t[i]:g} s comes {t[i + 1]:g} s.")
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(t, y, bc_type="clamped" if from_rest else "not-a-knot")
    accelerations = spline(t, 2)
    points = tuple((float(a), float(b)) for a, b in zip(t, accelerations, strict=True))
    return Trajectory(SampledSignal({ACCELERATION: points}), {"position": float(y[0]), "speed": float(spline(t[0], 1))})
