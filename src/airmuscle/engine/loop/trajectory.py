"""Trajectory: a prescribed motion along a spline, as the accelerations that drive a prescribed mechanism."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...core.errors import ParameterError
from .inputs import SampledSignal

ACCELERATION = "prescribed_acceleration"
"""The input of `PrescribedMotion`."""


class Trajectory(NamedTuple):
    """The input signal that drives a motion, and its initial position [m] and speed [m/s].

    `simulate(plant, motion.input, duration=..., initial_state=plant.state_at(pressure=..., **motion.initial_state))`;
    with other inputs, `SampledSignal({**motion.input.points, "fill": ...})`.
    """

    input: SampledSignal
    initial_state: dict[str, float]


def spline_trajectory(times: npt.ArrayLike, positions: npt.ArrayLike, *, from_rest: bool = True) -> Trajectory:
    """The motion along the cubic spline through positions (N,) [m] at times (N,) [s], for `PrescribedMotion`.

    The second derivative of a cubic spline is linear between its points, and so is an input: the motion is followed
    exactly. With `from_rest` it begins and ends at rest; otherwise the first two and the last two intervals are one
    cubic each, which needs four points. Begin the run at times[0]. Raises ParameterError for fewer than two points,
    points that are not finite, or times that do not rise.
    """
    try:
        t, y = np.asarray(times, dtype=float), np.asarray(positions, dtype=float)
    except (TypeError, ValueError):
        raise ParameterError(
            f"spline_trajectory: {times!r} and {positions!r} are not times [s] and positions [m]."
        ) from None
    needed = 2 if from_rest else 4
    if t.ndim != 1 or t.shape != y.shape or t.size < needed:
        raise ParameterError(
            f"spline_trajectory: give at least {needed} times and as many positions; they are {t.shape} and {y.shape}."
        )
    if not (np.isfinite(t).all() and np.isfinite(y).all()):
        raise ParameterError("spline_trajectory: times and positions must be finite.")
    if not (np.diff(t) > 0).all():
        i = int(np.argmax(np.diff(t) <= 0))
        raise ParameterError(f"spline_trajectory: times must rise; {t[i]:g} s is followed by {t[i + 1]:g} s.")
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(t, y, bc_type="clamped" if from_rest else "not-a-knot")
    points = tuple((float(a), float(b)) for a, b in zip(t, spline(t, 2), strict=True))
    initial_state = {"position": float(y[0]), "speed": float(spline(t[0], 1))}
    return Trajectory(SampledSignal({ACCELERATION: points}), initial_state)
