"""Prescribed motion: a drive moves the muscle, as in a tensile testing machine."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ...core.declaration import model
from ...core.ops import Value
from ...core.variables import Input
from .base import Coordinate, Mechanism


@model
class PrescribedMotion(Mechanism):
    """Prescribed motion: y'' = a(t), independent of the muscle forces; the drive absorbs the power F y'.

    y position relative to that at the resting length of the muscle, a the input. Input signals may be piecewise linear,
    so that y follows a cubic spline exactly: `airmuscle.engine.spline_trajectory` returns the acceleration
    signal and the initial state.
    """

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (Coordinate("position", "speed", "m", 0.01, 0.1),)

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("prescribed_acceleration", "m/s^2", -1e5, 1e5, "acceleration prescribed by the drive"),)

    def contractions(self, q: Mapping[str, Value], resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        return tuple(q["position"] / length for length in resting_lengths)

    def generalised_forces(
        self, q: Mapping[str, Value], tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> dict[str, Value]:
        return {"position": sum(tensions, 0.0)}

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        return {"position": inputs["prescribed_acceleration"]}

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], forces: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        return forces["position"] * v["speed"]
