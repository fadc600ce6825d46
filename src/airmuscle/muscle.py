"""A muscle after Hill: contractile element, parallel spring and damper between two fittings, and its volume."""

from __future__ import annotations

import abc
from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from . import ops, trace
from .characteristic.base import ForceLaw
from .characteristic.box import Box
from .characteristic.contractile_surface import HOSOVSKY_HILL
from .characteristic.virtual_work import VirtualWork
from .declare import model, parameter
from .friction.base import Friction, NoFriction
from .geometry.base import Geometry
from .ops import Value
from .reference import Reference

RELAXED: Mapping[str, Value] = MappingProxyType({})
"""Bristles of a friction that are not named stand at 0."""


class Spring(abc.ABC):
    """Parallel spring of a muscle: it pushes back against contraction."""

    @abc.abstractmethod
    def force(self, contraction: Value, resting_length: Value) -> Value:
        """Force [N] against contraction, at a contraction [1] of a muscle of resting length [m]."""


@model
class LinearSpring(Spring):
    """F_PP = k y, with y = eps L0: the constant stiffness of the third paper."""

    stiffness: float = parameter("N/m", "k_PP", "stiffness of the parallel spring", bounds=(0.0, 1e7))

    def force(self, contraction: Value, resting_length: Value) -> Value:
        return self.stiffness * contraction * resting_length


@model
class CubicSpring(Spring):
    """F_PP = k y (1 + h eps^2): a spring whose stiffness depends on contraction."""

    stiffness: float = parameter("N/m", "k_PP", "stiffness at the resting length", bounds=(0.0, 1e7))
    hardening: float = parameter("1", "h", "growth of the force with the squared contraction", bounds=(-10.0, 1e4))

    def force(self, contraction: Value, resting_length: Value) -> Value:
        return self.stiffness * contraction * resting_length * (1.0 + self.hardening * contraction**2)


class Damper(abc.ABC):
    """Damper of a muscle."""

    @abc.abstractmethod
    def force(self, pressure: Value, speed: Value) -> Value:
        """Force [N] against a speed of contraction [m/s] at gauge pressure [Pa]."""


@model
class LinearDamper(Damper):
    """F_TL = b v, with a constant coefficient."""

    damping: float = parameter("N s/m", "b", "damping coefficient", bounds=(0.0, 1e6))

    def force(self, pressure: Value, speed: Value) -> Value:
        return self.damping * speed


@model
class PressureDamper(Damper):
    """F_TL = (b_0 + b_p p) v: a coefficient that grows linearly with gauge pressure."""

    damping: float = parameter("N s/m", "b_0", "damping coefficient at ambient pressure", bounds=(0.0, 1e6))
    growth: float = parameter("N s/(m Pa)", "b_p", "growth of the coefficient with gauge pressure", bounds=(0.0, 1.0))

    def force(self, pressure: Value, speed: Value) -> Value:
        return (self.damping + self.growth * pressure) * speed


@model
class Muscle:
    """Two ports, pneumatic (p, V) and mechanical (F, v), after Hill without the series element.

        F = max(0, F_KE(p, eps) - F_PP(eps) - F_TL(p, v) - F_R)

    F_KE contractile characteristic, F_PP parallel spring, F_TL damper, F_R friction, whose bristles hold what the
    muscle remembers of its path. A muscle pulls and never pushes.
    Reference: Hosovsky et al., equation (1); friction is not part of it, and off unless given.
    """

    references: ClassVar[tuple[Reference, ...]] = (HOSOVSKY_HILL,)

    contractile: ForceLaw
    geometry: Geometry
    spring: Spring = LinearSpring(0.0)
    damper: Damper = LinearDamper(0.0)
    friction: Friction = NoFriction()
    name: str = "muscle"
    box: Box | None = None
    """Where its numbers were measured, if that is known: a run says when and how far it left it."""

    @classmethod
    def ideal(cls, geometry: Geometry, name: str = "muscle") -> Muscle:
        """A muscle whose tension follows from its volume by virtual work, so that it neither makes nor loses energy."""
        return cls(VirtualWork(geometry), geometry, name=name)

    def tension(
        self, pressure: Value, contraction: Value, speed: Value = 0.0, bristles: Mapping[str, Value] = RELAXED
    ) -> Value:
        """Pull on the load [N] at gauge pressure [Pa], contraction [1], speed of contraction [m/s] and bristles."""
        return ops.maximum(self.unslackened(pressure, contraction, speed, bristles), 0.0)

    def unslackened(
        self, pressure: Value, contraction: Value, speed: Value = 0.0, bristles: Mapping[str, Value] = RELAXED
    ) -> Value:
        """The sum of the elements' forces [N]; where it is negative the muscle hangs slack."""
        return (
            self.contractile.force(pressure, contraction)
            - self.spring.force(contraction, self.geometry.resting_length)
            - self.damper.force(pressure, speed)
            - self.friction_force(speed, bristles)
        )

    def friction_force(self, speed: Value, bristles: Mapping[str, Value] = RELAXED) -> Value:
        """Force of the friction against contraction [N]."""
        return self.friction.force({**self.friction.relaxed(), **bristles}, speed)

    def stiffness(self, pressure: Value, contraction: Value) -> Value:
        """-dF/deps at constant pressure [N], exact where the muscle is taut; divide by the resting length for N/m.

        With shut valves the pressure rises as the muscle is pulled, and it is stiffer. Friction is left out: its
        bristles add theirs until they slide.
        """
        return -trace.slope(self, "unslackened", pressure, contraction, wrt=1)
