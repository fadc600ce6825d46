"""The static surface that binds gauge pressure p [Pa], contraction eps [1] and tension F [N].

A paper gives it solved for one of the three. A law implements its own direction; the classes here give the other
two by a safeguarded root search, and exact slopes by the implicit function theorem. Where several answers exist
it is the one reached from rest: the smallest contraction, pressure or force at which the muscle balances.
"""

from __future__ import annotations

import abc
from typing import ClassVar, NamedTuple

from ..core import autodiff
from ..core.ops import Value
from ..core.reference import Reference
from .solve import find_first_root

MIN_PRESSURE = 1e-300
"""Stands for a pressure of zero [Pa] where a force is divided by it: no load then has an answer."""


class Slopes(NamedTuple):
    """How the tension changes at a point of the surface."""

    by_pressure: Value
    """dF/dp at constant contraction [N/Pa]."""
    by_contraction: Value
    """dF/deps at constant pressure [N]; its negative is the stiffness per unit of contraction."""


class Characteristic(abc.ABC):
    """Gauge pressure [Pa], contraction [1] and tension [N] of a muscle at rest; pulling is positive."""

    references: ClassVar[tuple[Reference, ...]] = ()
    traceable: ClassVar[bool] = True
    """Whether the law is closed-form over `ops`; otherwise it enters a plant through `as_force_law`."""

    @property
    def pressure_range(self) -> tuple[float, float]:
        """Gauge pressures [Pa] that an answer may have."""
        return (0.0, 1.0e6)

    @property
    def force_range(self) -> tuple[float, float]:
        """Tensions [N] that an answer may have."""
        return (0.0, 1.0e4)

    @property
    def contraction_range(self) -> tuple[float, float]:
        """Contractions [1] that an answer may have; a geometric law narrows it."""
        return (-0.05, 0.6)

    @abc.abstractmethod
    def force(self, pressure: Value, contraction: Value) -> Value:
        """Tension [N] at gauge pressure [Pa] and contraction [1]; arrays broadcast. Raises NoSolution."""

    @abc.abstractmethod
    def contraction(self, pressure: Value, force: Value) -> Value:
        """Contraction [1] at gauge pressure [Pa] under a tension [N]; arrays broadcast. Raises NoSolution."""

    @abc.abstractmethod
    def pressure(self, contraction: Value, force: Value) -> Value:
        """Gauge pressure [Pa] that holds a tension [N] at a contraction [1]; arrays broadcast. Raises NoSolution."""

    @abc.abstractmethod
    def slopes(self, pressure: Value, contraction: Value) -> Slopes:
        """Exact partial derivatives of the tension at gauge pressure [Pa] and contraction [1]."""

    def stiffness(self, pressure: Value, contraction: Value) -> Value:
        """-dF/deps at constant pressure [N]; divide by the resting length for N/m."""
        return -self.slopes(pressure, contraction).by_contraction

    def _no_contraction_message(self, pressure: float, force: float) -> str:
        start, end = self.contraction_range
        return (
            f"{type(self).__name__}: no contraction between {start:.1%} and {end:.1%} balances {force:.6g} N at "
            f"{pressure / 1e3:.6g} kPa. "
        )

    def _no_pressure_message(self, contraction: float, force: float) -> str:
        start, end = (p / 1e3 for p in self.pressure_range)
        return (
            f"{type(self).__name__}: no gauge pressure between {start:.6g} and {end:.6g} kPa gives {force:.6g} N at "
            f"a contraction of {contraction:.2%}. "
        )

    def _no_force_message(self, pressure: float, contraction: float) -> str:
        start, end = self.force_range
        return (
            f"{type(self).__name__}: no force between {start:.6g} and {end:.6g} N holds a contraction of "
            f"{contraction:.2%} at {pressure / 1e3:.6g} kPa. "
        )


class ForceLaw(Characteristic):
    """A law given as F(p, eps)."""

    def unclamped_force(self, pressure: Value, contraction: Value) -> Value:
        """The tension [N] before the law holds it within a range: what a fit determines from measured points."""
        return self.force(pressure, contraction)

    def contraction(self, pressure: Value, force: Value) -> Value:
        def unbalance(contraction: Value, p: Value, load: Value) -> Value:
            return load - self.force(p, contraction)

        def message(p: float, load: float, low: float, high: float) -> str:
            return self._no_contraction_message(p, load) + _describe_force_limits(load - high, load - low)

        return find_first_root(unbalance, self.contraction_range, (pressure, force), message)

    def pressure(self, contraction: Value, force: Value) -> Value:
        def excess(pressure: Value, c: Value, load: Value) -> Value:
            return self.force(pressure, c) - load

        def message(c: float, load: float, low: float, high: float) -> str:
            return self._no_pressure_message(c, load) + _describe_force_limits(low + load, high + load)

        return find_first_root(excess, self.pressure_range, (contraction, force), message)

    def slopes(self, pressure: Value, contraction: Value) -> Slopes:
        return Slopes(
            autodiff.derivative(self, "force", pressure, contraction, wrt=0),
            autodiff.derivative(self, "force", pressure, contraction, wrt=1),
        )

    def _contraction_limits_message(self, pressure: float, force: float) -> str:
        """For a law solved in closed form, whose tension falls steadily from one end of its reach to the other."""
        ends = (float(self.force(pressure, end)) for end in self.contraction_range)
        return self._no_contraction_message(pressure, force) + _describe_force_limits(*sorted(ends))

    def _pressure_limits_message(self, contraction: float, force: float) -> str:
        ends = (float(self.force(end, contraction)) for end in self.pressure_range)
        return self._no_pressure_message(contraction, force) + _describe_force_limits(*sorted(ends))


def _describe_force_limits(low: float, high: float) -> str:
    return f"Between these the muscle pulls {low:.6g} to {high:.6g} N there."


class ContractionLaw(Characteristic):
    """A law given as eps(p, F)."""

    def force(self, pressure: Value, contraction: Value) -> Value:
        def shortfall(force: Value, p: Value, c: Value) -> Value:
            return c - self.contraction(p, force)

        def message(p: float, c: float, low: float, high: float) -> str:
            possible = f"Between these it contracts by {c - high:.2%} to {c - low:.2%} at this pressure."
            return self._no_force_message(p, c) + possible

        return find_first_root(shortfall, self.force_range, (pressure, contraction), message)

    def pressure(self, contraction: Value, force: Value) -> Value:
        def excess(pressure: Value, c: Value, load: Value) -> Value:
            return self.contraction(pressure, load) - c

        def message(c: float, load: float, low: float, high: float) -> str:
            possible = f"Between these it contracts by {low + c:.2%} to {high + c:.2%} under this load."
            return self._no_pressure_message(c, load) + possible

        return find_first_root(excess, self.pressure_range, (contraction, force), message)

    def slopes(self, pressure: Value, contraction: Value) -> Slopes:
        force = self.force(pressure, contraction)
        by_pressure = autodiff.derivative(self, "contraction", pressure, force, wrt=0)
        by_force = autodiff.derivative(self, "contraction", pressure, force, wrt=1)
        return Slopes(-by_pressure / by_force, 1.0 / by_force)


class PressureLaw(Characteristic):
    """A law given as p(eps, F)."""

    def force(self, pressure: Value, contraction: Value) -> Value:
        def excess(force: Value, p: Value, c: Value) -> Value:
            return self.pressure(c, force) - p

        def message(p: float, c: float, low: float, high: float) -> str:
            possible = f"Between these it needs {(low + p) / 1e3:.6g} to {(high + p) / 1e3:.6g} kPa there."
            return self._no_force_message(p, c) + possible

        return find_first_root(excess, self.force_range, (pressure, contraction), message)

    def contraction(self, pressure: Value, force: Value) -> Value:
        def excess(contraction: Value, p: Value, load: Value) -> Value:
            return self.pressure(contraction, load) - p

        def message(p: float, load: float, low: float, high: float) -> str:
            possible = f"Between these it needs {(low + p) / 1e3:.6g} to {(high + p) / 1e3:.6g} kPa under this load."
            return self._no_contraction_message(p, load) + possible

        return find_first_root(excess, self.contraction_range, (pressure, force), message)

    def slopes(self, pressure: Value, contraction: Value) -> Slopes:
        force = self.force(pressure, contraction)
        by_contraction = autodiff.derivative(self, "pressure", contraction, force, wrt=0)
        by_force = autodiff.derivative(self, "pressure", contraction, force, wrt=1)
        return Slopes(1.0 / by_force, -by_contraction / by_force)
