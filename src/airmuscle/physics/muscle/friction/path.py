"""Friction forces along a displacement path, row by row, exact for linear motion between rows;
scales of loops.

This file works on numbers only, for `Friction.force_along`; it is never traced, so it may use
NumPy.
"""

import bisect
import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any, Self

import numpy as np

from ....core import Array, IdentificationError

CURVE_NODES = 4801
CURVE_END = 24.0
"""Nodes of the loading curve of `relative_deflection`, and its end -ln((1 - w)/2), where 1 - w is
8e-11 (chosen).
"""
MIN_FRICTION = 1e-3
"""Least initial amplitude of a friction [N] (chosen)."""


@dataclasses.dataclass(frozen=True)
class LoopScales:
    """Scales of a hysteresis loop, by which a friction law scales its initial parameters; all
    SI.
    """

    stroke: float
    """Range of the displacement [m]."""
    amplitude: float
    """Standard deviation of the force without the static curve [N]."""
    elements: int
    """Number of elements of a law of several."""

    @classmethod
    def of(cls, displacement: Any, force: Any, elements: int = 8) -> Self:
        """The scales of a displacement [m] and the forces [N] along it.

        elements  number of elements of a law of several

        Raises IdentificationError for a constant displacement.
        """
        stroke = float(np.ptp(displacement))
        if not stroke > 0:
            raise IdentificationError(
                "the displacement of the friction is constant, so it cannot be identified. Give a"
                " run with both branches, for example contracting and extending."
            )
        return cls(stroke, max(float(np.std(force)), MIN_FRICTION), elements)

    @property
    def stiffness(self) -> float:
        """Initial stiffness [N/m]: the amplitude within a tenth of the stroke (chosen)."""
        return 10 * self.amplitude / self.stroke

    @property
    def element_limits(self) -> tuple[float, ...]:
        """Limits of the elements [m], from a hundredth of the stroke to 0.7 of it (chosen)."""
        return tuple(self.stroke * np.geomspace(0.01, 0.7, self.elements))

    @property
    def element_stiffnesses(self) -> tuple[float, ...]:
        """Equal stiffnesses of the elements [N/m]."""
        return (self.amplitude / self.elements / self.stroke,) * self.elements


def _increments(displacement: Any) -> Array:
    """Increments along a path, zero in the first row."""
    path = np.asarray(displacement, dtype=float)
    return np.diff(path, prepend=path[:1])


def compute_speed(displacement: Any, time: Any) -> Array:
    """Mean speed [m/s] on the interval before every row; 0 in the first row and for intervals of
    zero duration.
    """
    increments = _increments(displacement)
    durations = _increments(time)
    return np.divide(increments, durations, out=np.zeros_like(increments), where=durations > 0)


def deflection(displacement: Any, sliding_length: Any) -> Array:
    """Deflection z [m] along a path x that starts at z = 0, with dz/dx = 1 - z
    sgn(dx)/sliding_length; shape (N,).

    `sliding_length` [m] is one value for the whole path, or one per row for the interval before it.
    """
    increments = _increments(displacement)
    decay = np.exp(-np.abs(increments) / sliding_length).tolist()
    limits = (np.sign(increments) * sliding_length).tolist()
    deflections = []
    z = 0.0
    for factor, limit in zip(decay, limits, strict=True):
        z = limit + (z - limit) * factor if limit else z
        deflections.append(z)
    return np.array(deflections)


def stop_operators(displacement: Any, limits: Sequence[float]) -> Array:
    """Stop operators with these limits r [m] along a path: each follows x within -r..r; shape (N,
    limits).

    The results of the last paths are kept, because a fit evaluates the same path many times; they
    are read-only.
    """
    increments = _increments(displacement)
    return _stop_operators(increments.tobytes(), tuple(float(limit) for limit in limits))


@functools.lru_cache(maxsize=8)
def _stop_operators(increments: bytes, limits: tuple[float, ...]) -> Array:
    steps = np.frombuffer(increments, dtype=float).tolist()
    outputs = np.empty((len(steps), len(limits)))
    for column, limit in enumerate(limits):
        states = []
        state = 0.0
        for step in steps:
            state = max(min(state + step, limit), -limit)
            states.append(state)
        outputs[:, column] = states
    outputs.setflags(write=False)
    return outputs


def relative_deflection(
    rate: Callable[[Any, Any], Any], displacement: Any, sliding_length: float
) -> Array:
    """w along a path x that starts at w = 0, with dw/dx = rate(w, +-1)/sliding_length and |w| < 1;
    shape (N,).

    The model must be odd, rate(w, -1) = -rate(-w, 1). All motion then follows one loading curve
    w(xi), and a reversal continues on it from -w. The curve is integrated from dxi = dw/rate(w, 1)
    and interpolated, with an error of 1e-6 for the sharpest transitions and 1e-8 for usual ones.
    """
    increments = _increments(displacement) / sliding_length
    if not increments.size:
        return increments
    curve = _LoadingCurve(rate)
    positions = np.zeros(increments.size)
    directions = np.ones(increments.size)
    distances = np.abs(increments)
    xi = curve.position(0.0)
    direction = 1.0
    for interval, sign in _monotone_intervals(increments):
        if sign != direction:
            xi = curve.position(-curve.deflection(xi))
            direction = sign
        positions[interval] = xi + np.cumsum(distances[interval])
        directions[interval] = direction
        xi = float(positions[interval.stop - 1])
    return np.asarray(directions * curve.deflections(positions))


def _monotone_intervals(increments: Array) -> list[tuple[slice, float]]:
    """Split a path at its turning points into intervals with their signs; rests belong to the
    preceding interval.
    """
    signs = np.sign(increments)
    moving = np.flatnonzero(signs)
    turns = moving[1:][np.diff(signs[moving]) != 0].tolist()
    ends = [0, *turns, increments.size]
    first = float(signs[moving[0]]) if moving.size else 1.0
    return [
        (slice(a, b), first if k % 2 == 0 else -first)
        for k, (a, b) in enumerate(itertools.pairwise(ends))
    ]


class _LoadingCurve:
    """The curve w(xi) from w = -1 at xi = 0 towards w = 1, and its inverse.

    The curve parameter is s = -ln((1 - w)/2), with equidistant nodes, which also resolves the slow
    approach to 1. Single points, of which a noisy path has one at every reversal, are evaluated
    without NumPy.
    """

    def __init__(self, rate: Callable[[Any, Any], Any]) -> None:
        from scipy.interpolate import CubicHermiteSpline

        s = np.linspace(0.0, CURVE_END, CURVE_NODES)
        s[np.searchsorted(s, math.log(2.0))] = math.log(
            2.0
        )  # a node at w = 0, where powers of |w| have a kink
        points, weights = np.polynomial.legendre.leggauss(5)
        half = np.diff(s) / 2.0
        inner = s[:-1, None] + half[:, None] * (1.0 + points)
        xi = np.concatenate([[0.0], np.cumsum((_curve_derivative(rate, inner) @ weights) * half)])
        slopes = _curve_derivative(rate, s)
        self._end = float(xi[-1])
        self._s_of_xi, xi_of_s = (
            CubicHermiteSpline(xi, s, 1.0 / slopes),
            CubicHermiteSpline(s, xi, slopes),
        )
        self._parameter, self._position = (
            _point_evaluation(self._s_of_xi),
            _point_evaluation(xi_of_s),
        )

    def deflections(self, positions: Array) -> Array:
        """w at positions xi, shape (N,)."""
        return np.asarray(1.0 - 2.0 * np.exp(-self._s_of_xi(np.minimum(positions, self._end))))

    def deflection(self, position: float) -> float:
        """w at one position xi."""
        return 1.0 - 2.0 * math.exp(-self._parameter(min(position, self._end)))

    def position(self, w: float) -> float:
        """The position xi of a deflection w."""
        return self._position(min(-math.log(max((1.0 - w) / 2.0, math.exp(-CURVE_END))), CURVE_END))


def _point_evaluation(spline: Any) -> Callable[[float], float]:
    """A function that evaluates a cubic spline at one point, as the spline itself does at many."""
    nodes = spline.x.tolist()
    coefficients = spline.c
    last = len(nodes) - 2

    def evaluate(point: float) -> float:
        interval = min(max(bisect.bisect_right(nodes, point) - 1, 0), last)
        cubic, square, slope, value = coefficients[:, interval].tolist()
        t = point - nodes[interval]
        return float(value + slope * t + square * (t * t) + cubic * (t * t * t))

    return evaluate


def _curve_derivative(rate: Callable[[Any, Any], Any], s: Array) -> Array:
    """dxi/ds on the loading curve."""
    w = 1.0 - 2.0 * np.exp(-s)
    return np.asarray((1.0 - w) / rate(w, 1.0))
