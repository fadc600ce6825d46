"""The parallel spring of a muscle."""

from __future__ import annotations

import abc

from ..core.declaration import model, parameter
from ..core.ops import Value


class Spring(abc.ABC):
    """Parallel spring of a muscle: it pushes back against contraction."""

    @abc.abstractmethod
    def force(self, pressure: Value, contraction: Value, resting_length: Value) -> Value:
        """Force [N] against contraction [1], at gauge pressure [Pa], of a muscle of resting length [m]."""


@model
class LinearSpring(Spring):
    """F_PP = k y, with y = eps L0: the constant stiffness of the third paper."""

    stiffness: float = parameter("N/m", "k_PP", "stiffness of the parallel spring", bounds=(0.0, 1e7))

    def force(self, pressure: Value, contraction: Value, resting_length: Value) -> Value:
        return self.stiffness * contraction * resting_length


@model
class CubicSpring(Spring):
    """F_PP = k y (1 + h eps^2): a spring whose stiffness depends on contraction."""

    stiffness: float = parameter("N/m", "k_PP", "stiffness at the resting length", bounds=(0.0, 1e7))
    hardening: float = parameter("1", "h", "growth of the force with the squared contraction", bounds=(-10.0, 1e4))

    def force(self, pressure: Value, contraction: Value, resting_length: Value) -> Value:
        return self.stiffness * contraction * resting_length * (1.0 + self.hardening * contraction**2)
