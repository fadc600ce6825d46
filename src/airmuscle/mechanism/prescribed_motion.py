"""A motion that a drive forces upon the muscle, as a tensile testing machine does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from ..core.declaration import model
from ..core.ops import Value
from ..core.variables import Input
from .base import Coordinate, Mechanism


@model
class PrescribedMotion(Mechanism):
    """y'' = a(t), whatever the muscles pull; the drive takes up the work F y'.

    y position from where the muscle has its resting length, a the input. Inputs are linear between instants, so that
    y can follow any cubic spline exactly: `airmuscle.control.trajectory.follow` gives its accelerations and its start.
    """

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return (Coordinate("position", "speed", "m", 0.01, 0.1),)

    @property
    def inputs(self) -> tuple[Input, ...]:
        return (Input("prescribed_acceleration", "m/s^2", -1e5, 1e5, "acceleration that the drive forces"),)

    def contractions(self, q: Mapping[str, Value], resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        return tuple(q["position"] / length for length in resting_lengths)

    def generalised_forces(
        self, q: Mapping[str, Value], tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> dict[str, Value]:
        return {"position": sum(tensions, 0.0)}

    def acceleration(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Mapping[str, Value]:
        return {"position": inputs["prescribed_acceleration"]}

    def dissipated_power(
        self, q: Mapping[str, Value], v: Mapping[str, Value], pulls: Mapping[str, Value], inputs: Mapping[str, Value]
    ) -> Value:
        return pulls["position"] * v["speed"]
