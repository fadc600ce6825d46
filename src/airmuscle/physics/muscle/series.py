"""Series elements, and the equilibrium of the contractile element behind a spring."""

import abc
from collections.abc import Callable

import numpy as np

from ...core import Array, Value, model, ops, parameter


class SeriesElement:
    """Element in series with the contractile element (base class)."""


@model
class RigidSeriesElement(SeriesElement):
    """Rigid connection: contractile element and muscle have the same contraction, as in Hošovský et
    al.
    """


class ElasticSeriesElement(SeriesElement, abc.ABC):
    """Elastic series element (interface): a tension-only spring, at least as stiff as at zero
    stretch.
    """

    stiffness: float

    @abc.abstractmethod
    def force(self, stretch: Value) -> Value:
        """Tension [N] at a stretch [m]."""

    @abc.abstractmethod
    def tangent_stiffness(self, stretch: Value) -> Value:
        """Derivative of the tension with respect to a positive stretch [N/m]."""


@model
class SeriesSpring(ElasticSeriesElement):
    """Tension-only spring: F = k max(s, 0) with stretch s, for compliant fittings, ropes or
    sensors.
    """

    stiffness: float = parameter(
        "N/m", "k_SE", "stiffness of the series element", bounds=(1.0, 1e9)
    )

    def force(self, stretch: Value) -> Value:
        return self.stiffness * ops.maximum(stretch, 0.0)

    def tangent_stiffness(self, stretch: Value) -> Value:
        return self.stiffness


@model
class CubicSeriesSpring(ElasticSeriesElement):
    """Tension-only cubic spring: F = k s (1 + (s/s_h)^2), s = max(stretch, 0): its stiffness grows
    with the stretch.

    s_h is the stretch at which the force is twice that of the linear spring. The series element of
    the Hill model is nonlinear in Fig. 1 of Hošovský et al.; the paper prints no law, so the cubic
    one is chosen.
    """

    stiffness: float = parameter(
        "N/m", "k_SE", "stiffness of the series element at zero stretch", bounds=(1.0, 1e9)
    )
    hardening_stretch: float = parameter(
        "m",
        "s_h",
        "stretch at which the force is twice that of a linear spring",
        bounds=(1e-6, 10.0),
    )

    def force(self, stretch: Value) -> Value:
        positive = ops.maximum(stretch, 0.0)
        return self.stiffness * positive * (1.0 + (positive / self.hardening_stretch) ** 2)

    def tangent_stiffness(self, stretch: Value) -> Value:
        return self.stiffness * (1.0 + 3.0 * (stretch / self.hardening_stretch) ** 2)


CONTRACTION_TOLERANCE = 1e-15
"""Contractions that differ by less are equal (chosen, a few rounding errors)."""
MAX_ITERATIONS = 200
Imbalance = Callable[[Value, Value, Value], tuple[Value, Value]]
"""Force imbalance [N] and its derivative with respect to the inner contraction [N], as a function
of gauge pressure [Pa], inner contraction and contraction of the muscle. Where the derivative is
NaN, the solution is bisected."""


def solve_inner_contraction(
    imbalance: Imbalance,
    compliance_force: Value,
    limits: tuple[Value, Value],
    pressure: Value,
    contraction: Value,
) -> Value:
    """Inner contraction at which the force of the contractile element equals that of the series
    spring.

    `compliance_force` [N] is the spring's stiffness times the resting length, `limits` are the
    contraction limits of the geometry, `pressure` is gauge [Pa], `contraction` that of the muscle
    between its fittings. Arrays broadcast, also those of the parameters. The imbalance decreases
    over the bracket, so the solution is unique. Where the contractile element pushes and the spring
    is slack, the solution is the largest inner contraction without a push.
    """
    min_contraction, max_contraction = limits
    pull, _ = imbalance(pressure, contraction, contraction)
    start = contraction + np.zeros(np.shape(pull))
    stretched = np.minimum(
        start + np.maximum(pull, 0.0) / compliance_force, np.maximum(max_contraction, start)
    )
    low = np.where(np.less(pull, 0.0), np.minimum(min_contraction, start), start)
    high = np.where(np.less(pull, 0.0), start, stretched)
    solution = find_largest_nonnegative(
        lambda inner: imbalance(pressure, inner, contraction), low, high, start
    )
    return solution if solution.ndim else float(solution)


def find_largest_nonnegative(
    function: Callable[[Array], tuple[Value, Value]], low: Array, high: Array, start: Array
) -> Array:
    """The largest x in [low, high] at which a decreasing function is not negative; element-wise,
    shape (N,) or ().

    `function` returns value and derivative. Newton's method from `start`, safeguarded by bisection:
    the bracket is halved where a Newton step would leave it or is longer than half the previous
    step.
    """
    x = start
    previous = high - low
    solution = start
    searching = np.ones(np.shape(start), dtype=bool)
    for _ in range(MAX_ITERATIONS):
        value, slope = function(x)
        low = np.where(np.greater_equal(value, 0.0), x, low)
        high = np.where(np.greater_equal(value, 0.0), high, x)
        with np.errstate(all="ignore"):
            step = -np.divide(
                value, slope
            )  # NaN where the function is constant at zero: bisect to its upper end
        newton = (x + step >= low) & (x + step <= high)
        close = newton & (np.abs(step) <= CONTRACTION_TOLERANCE)
        middle = 0.5 * (low + high)
        ahead = np.where(
            close | (newton & (2.0 * np.abs(step) <= np.abs(previous))), x + step, middle
        )
        previous = ahead - x
        x = ahead
        solution = np.where(searching, x, solution)
        searching &= ~close & (high - low > CONTRACTION_TOLERANCE)
        if not searching.any():
            break
    return solution
