"""Parallel springs: elastic elements in parallel with the contractile element."""

from __future__ import annotations

import abc

from ...core.declaration import model, parameter
from ...core.ops import Value


class Spring(abc.ABC):
    """Parallel spring that opposes contraction (interface)."""

    @abc.abstractmethod
    def force(self, pressure: Value, contraction: Value, resting_length: Value) -> Value:
        """Spring force [N] against contraction at gauge pressure [Pa], contraction and resting length [m]."""


@model
class LinearSpring(Spring):
    """Linear spring: F_PP = k y with y = eps L0, the constant stiffness of Hošovský et al."""

    stiffness: float = parameter("N/m", "k_PP", "stiffness of the parallel spring", bounds=(0.0, 1e7))

    def force(self, pressure: Value, contraction: Value, resting_length: Value) -> Value:
        return self.stiffness * contraction * resting_length


@model
class CubicSpring(Spring):
    """Cubic spring: F_PP = k y (1 + h eps^2) with y = eps L0; the stiffness depends on contraction."""

    stiffness: float = parameter("N/m", "k_PP", "stiffness at the resting length", bounds=(0.0, 1e7))
    hardening: float = parameter("1", "h", "hardening coefficient of the squared contraction", bounds=(-10.0, 1e4))

    def force(self, pressure: Value, contraction: Value, resting_length: Value) -> Value:
        return self.stiffness * contraction * resting_length * (1.0 + self.hardening * contraction**2)
