"""Characteristic (interface): static relation between gauge pressure p [Pa], contraction eps [1]
and tension F [N].

A paper gives the relation solved for one of the three quantities. A model implements this
direction; the classes here compute the other two by a bracketed root search, and exact slopes by
the implicit function theorem. If there are several solutions, the one reached from rest is
returned: the smallest contraction, pressure or force in equilibrium.
"""

import abc
import inspect
from collections.abc import Callable, Iterable
from typing import Any, ClassVar, Self

from ....core import (
    INFINITY,
    IdentificationError,
    Reference,
    Value,
    autodiff,
    model,
    ops,
    parameter,
)
from ....core.declaration import forwarded
from ..quantity_arguments import QuantityMethods, Units
from .beyond_range import SEARCHED_CONTRACTIONS
from .calls import Slopes, in_range
from .data_scales import MeasuredPoints
from .modes import formula_alone
from .solve import check_solution, describe_range, solve_direction, warn_above_whole_length

MIN_PRESSURE = 1e-300
"""Replaces a pressure of zero [Pa] as a divisor; no load then has a solution."""


class Characteristic(QuantityMethods, abc.ABC):
    """Static relation between gauge pressure [Pa], contraction [1] and tension [N]; pulling is
    positive.

    Arguments are numbers, arrays or lists in SI units, or texts with a unit: `force("3 bar", "10
    %")`.
    """

    references: ClassVar[tuple[Reference, ...]] = ()
    traceable: ClassVar[bool] = True
    """Whether the model is in closed form over `ops`; otherwise a plant uses it through
    `as_force_law`.
    """
    refuses_beyond: ClassVar[bool] = False
    """Whether the methods of the law refuse points beyond its range themselves."""
    redundant: ClassVar[tuple[str, ...]] = ()
    """Parameters that a fit keeps at those of `guess`, because they only scale other parameters."""
    argument_units: ClassVar[Units] = {
        "force": ("Pa", "1"),
        "contraction": ("Pa", "N"),
        "pressure": ("1", "N"),
        "slopes": ("Pa", "1"),
        "stiffness": ("Pa", "1"),
    }
    check_ratio = staticmethod(warn_above_whole_length)

    def __init_subclass__(cls, **options: Any) -> None:
        for name in ("force", "contraction", "pressure", "slopes"):
            method = cls.__dict__.get(name)
            if inspect.isfunction(method) and not getattr(method, "__isabstractmethod__", False):
                setattr(cls, name, in_range(name, method))
        super().__init_subclass__(**options)

    @classmethod
    def guess(cls, data: MeasuredPoints) -> Self:
        """The law with initial parameters for a fit to measured points: recordings, or their
        `DataScales`.

        A law that defines it is compared with the others. Raises IdentificationError where they do
        not follow from the data.
        """
        raise IdentificationError(
            f"{cls.__name__} is not started from data; give its initial parameters.",
            cause="it needs initial parameters",
        )

    @classmethod
    def variants(
        cls, data: MeasuredPoints, surface: "Callable[[int], ForceLaw]"
    ) -> "dict[str, Characteristic]":
        """The initial laws of this class that are compared, by name: that of `guess`, or several
        structures.

        surface  a surface of a total degree with coefficients of zero, for laws that contain
                 another one

        Empty for a law without `guess`. Raises IdentificationError as `guess`.
        """
        own = getattr(cls.guess, "__func__", None) is not getattr(
            Characteristic.guess, "__func__", None
        )
        return {cls.__name__: cls.guess(data)} if own else {}

    @property
    def pressure_range(self) -> tuple[float, float]:
        """Minimum and maximum gauge pressure [Pa] of a solution."""
        return (0.0, 1.0e6)

    @property
    def force_range(self) -> tuple[float, float]:
        """Minimum and maximum tension [N] of a solution."""
        return (0.0, 1.0e4)

    @property
    def contraction_range(self) -> tuple[float, float]:
        """Minimum and maximum contraction [1] of a solution; geometric models restrict it."""
        return SEARCHED_CONTRACTIONS

    @property
    def begins_at_straight_fibres(self) -> bool:
        """Whether the range begins with straight fibres, whose force is infinite."""
        return False

    @property
    def has_limits(self) -> bool:
        """Whether limits are applied to the force, as which `unclamped_force` differs from it."""
        return type(self).unclamped_force is not Characteristic.unclamped_force

    @property
    def formula_range(self) -> tuple[Value, Value]:
        """Minimum and maximum contraction [1] of the formula in a muscle without a validity range;
        the parameters may be symbols.
        """
        return self.contraction_range

    @abc.abstractmethod
    def force(self, pressure: Value, contraction: Value) -> Value:
        """Tension [N] at gauge pressure [Pa] and contraction [1]; arrays broadcast. Raises
        SolveError.
        """

    def unclamped_force(self, pressure: Value, contraction: Value) -> Value:
        """Tension [N] before any limit is applied, the formula also beyond the range; fits
        evaluate the residuals with it.
        """
        with formula_alone():
            return self.force(pressure, contraction)

    @abc.abstractmethod
    def contraction(self, pressure: Value, force: Value) -> Value:
        """Contraction [1] at gauge pressure [Pa] and tension [N]; arrays broadcast. Raises
        SolveError.
        """

    @abc.abstractmethod
    def pressure(self, contraction: Value, force: Value) -> Value:
        """Gauge pressure [Pa] at contraction [1] and tension [N]; arrays broadcast. Raises
        SolveError.
        """

    @abc.abstractmethod
    def slopes(self, pressure: Value, contraction: Value) -> Slopes:
        """Exact partial derivatives of the tension at gauge pressure [Pa] and contraction [1];
        arrays broadcast.
        """

    def stiffness(self, pressure: Value, contraction: Value) -> Value:
        """Stiffness -dF/deps [N] at constant pressure; divide by the resting length for [N/m]."""
        return 0.0 - self.slopes(pressure, contraction).by_contraction  # not -0 for a slack muscle

    def _no_contraction_message(self, pressure: float, force: float) -> str:
        low, high = self.contraction_range
        limits = describe_range(100 * low, 100 * high, "%")
        return (
            f"{type(self).__name__}: no contraction in the range {limits} is in equilibrium with"
            f" {force:.4g} N at {pressure / 1e3:.4g} kPa. "
        )

    def _no_pressure_message(self, contraction: float, force: float) -> str:
        low, high = self.pressure_range
        limits = describe_range(low / 1e3, high / 1e3, "kPa")
        return (
            f"{type(self).__name__}: no gauge pressure in the range {limits} gives {force:.4g} N at"
            f" a contraction of {100 * contraction:.4g} %. "
        )

    def _no_force_message(self, pressure: float, contraction: float) -> str:
        limits = describe_range(*self.force_range, "N")
        return (
            f"{type(self).__name__}: no force in the range {limits} gives a contraction of"
            f" {100 * contraction:.4g} % at {pressure / 1e3:.4g} kPa. "
        )


class ForceLaw(Characteristic):
    """Characteristic given as F(p, eps)."""

    def contraction(self, pressure: Value, force: Value) -> Value:
        return solve_direction(
            lambda contraction, p, _: self.force(p, contraction),
            self.contraction_range,
            (pressure, force),
            1,
            self._no_contraction_message,
            "Available force",
            "N",
            falling=True,
        )

    def pressure(self, contraction: Value, force: Value) -> Value:
        return solve_direction(
            lambda pressure, c, _: self.force(pressure, c),
            self.pressure_range,
            (contraction, force),
            1,
            self._no_pressure_message,
            "Available force",
            "N",
        )

    def slopes(self, pressure: Value, contraction: Value) -> Slopes:
        return Slopes(
            autodiff.derivative(self, "force", pressure, contraction, wrt=0),
            autodiff.derivative(self, "force", pressure, contraction, wrt=1),
        )


class AreaLaw(ForceLaw):
    """Force proportional to the pressure: F = p A(eps) (base class)."""

    @abc.abstractmethod
    def effective_area(self, contraction: Value) -> Value:
        """Effective area F/p [m2] at a contraction [1], the area of an equivalent piston."""

    def force(self, pressure: Value, contraction: Value) -> Value:
        return pressure * self.effective_area(contraction)

    def pressure(self, contraction: Value, force: Value) -> Value:
        solution = force / self.effective_area(contraction)
        return check_solution(
            solution, self.pressure_range, (contraction, force), self._pressure_limits_message
        )

    def _contraction_limits_message(self, pressure: float, force: float) -> str:
        """Message for a tension that decreases monotonically over the contraction range."""
        ends = (self.force(pressure, end) for end in self.contraction_range)
        return self._no_contraction_message(pressure, force) + _describe_force_limits(ends)

    def _pressure_limits_message(self, contraction: float, force: float) -> str:
        ends = (self.force(end, contraction) for end in self.pressure_range)
        return self._no_pressure_message(contraction, force) + _describe_force_limits(ends)


def _describe_force_limits(ends: Iterable[Value]) -> str:
    low, high = sorted(map(float, ends))
    return f"Available force: {describe_range(low, high, 'N')}."


class ContractionLaw(Characteristic):
    """Characteristic given as eps(p, F)."""

    def force(self, pressure: Value, contraction: Value) -> Value:
        return solve_direction(
            lambda force, p, _: self.contraction(p, force),
            self.force_range,
            (pressure, contraction),
            1,
            self._no_force_message,
            "Available contraction at this pressure",
            "%",
            falling=True,
        )

    def pressure(self, contraction: Value, force: Value) -> Value:
        return solve_direction(
            lambda pressure, _, load: self.contraction(pressure, load),
            self.pressure_range,
            (contraction, force),
            0,
            self._no_pressure_message,
            "Available contraction at this load",
            "%",
        )

    def slopes(self, pressure: Value, contraction: Value) -> Slopes:
        force = self.force(pressure, contraction)
        by_pressure = autodiff.derivative(self, "contraction", pressure, force, wrt=0)
        by_force = autodiff.derivative(self, "contraction", pressure, force, wrt=1)
        return Slopes(_ratio(-by_pressure, by_force), _ratio(1.0, by_force))


class PressureLaw(Characteristic):
    """Characteristic given as p(eps, F)."""

    def force(self, pressure: Value, contraction: Value) -> Value:
        return solve_direction(
            lambda force, _, c: self.pressure(c, force),
            self.force_range,
            (pressure, contraction),
            0,
            self._no_force_message,
            "Required pressure at this contraction",
            "kPa",
        )

    def contraction(self, pressure: Value, force: Value) -> Value:
        return solve_direction(
            lambda contraction, _, load: self.pressure(contraction, load),
            self.contraction_range,
            (pressure, force),
            0,
            self._no_contraction_message,
            "Required pressure at this load",
            "kPa",
        )

    def slopes(self, pressure: Value, contraction: Value) -> Slopes:
        force = self.force(pressure, contraction)
        by_contraction = autodiff.derivative(self, "pressure", contraction, force, wrt=0)
        by_force = autodiff.derivative(self, "pressure", contraction, force, wrt=1)
        return Slopes(_ratio(1.0, by_force), _ratio(-by_contraction, by_force))


def _ratio(a: Value, b: Value) -> Value:
    """a/b, of numbers as of arrays: infinite where b is 0, as the slopes of straight fibres are."""
    return a * INFINITY if isinstance(b, float) and b == 0.0 else a / b


@model
class Clamped(ForceLaw):
    """Limited force: F = min(max(F_inner, F_min), F_max).

    A muscle pulls and never pushes; the upper limit is that of the force compensator or of the
    catalogue.
    """

    inner: ForceLaw
    min_force: float = parameter(
        "N", "F_min", "lower limit of the force", fitted=False, default=0.0
    )
    max_force: float = parameter(
        "N", "F_max", "upper limit of the force", fitted=False, default=1.0e5
    )

    contraction_range = forwarded("inner.contraction_range")
    unclamped_force = forwarded("inner.unclamped_force")

    def force(self, pressure: Value, contraction: Value) -> Value:
        return ops.clip(self.inner.force(pressure, contraction), self.min_force, self.max_force)
