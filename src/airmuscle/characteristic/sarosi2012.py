"""Sarosi 2012: six coefficients for the force of a fluidic muscle."""

from __future__ import annotations

from typing import ClassVar

from ..core import ops
from ..core.declaration import model, parameter
from ..core.ops import Value
from ..core.reference import Reference
from .base import ForceLaw

SAROSI_2012 = Reference(
    "sarosi-2012",
    "Sarosi, J.",
    "New approximation algorithm for the force of fluidic muscles",
    "7th IEEE International Symposium on Applied Computational Intelligence and Informatics",
    2012,
    note="with its author's later papers to 2017; formula and coefficients second hand",
)


@model
class Sarosi2012(ForceLaw):
    """F = (a_1 p + a_2) exp(a_3 eps) + a_4 eps p + a_5 p + a_6.

    p gauge pressure, eps contraction. The papers print the coefficients for p in bar and eps in per cent; a
    library file carries them with these units (`"-0.342 1/%"`) and they are converted as it is read. Fitted where
    the muscle pulls: at low pressure the law goes below zero, so wrap it in Clamped.
    """

    references: ClassVar[tuple[Reference, ...]] = (SAROSI_2012,)
    linear_in: ClassVar[tuple[str, ...]] = ("a1", "a2", "a4", "a5", "a6")

    a1: float = parameter("N/Pa", "a_1", "growth of the exponential part with pressure")
    a2: float = parameter("N", "a_2", "exponential part without pressure")
    a3: float = parameter("1", "a_3", "decay of the exponential part with contraction", bounds=(-1e3, 0.0))
    a4: float = parameter("N/Pa", "a_4", "growth with contraction times pressure")
    a5: float = parameter("N/Pa", "a_5", "growth with pressure")
    a6: float = parameter("N", "a_6", "force without pressure at large contraction")

    def force(self, pressure: Value, contraction: Value) -> Value:
        decaying = (self.a1 * pressure + self.a2) * ops.exp(self.a3 * contraction)
        return decaying + self.a4 * contraction * pressure + self.a5 * pressure + self.a6
