"""External load: another program carries the load; shortenings of the muscles are inputs, forces are outputs."""

from __future__ import annotations

from collections.abc import Sequence

from ...core.declaration import model, parameter
from ...core.errors import ParameterError
from ...core.ops import Value, Values
from ...core.system import Input
from .base import Coordinate, Mechanism

SHORTENING, SHORTENING_SPEED = "shortening", "shortening_speed"
"""Names of the inputs of one muscle."""


@model
class ExternalLoad(Mechanism):
    """Port to a load in another simulator: eps = s/L0 with the input s = L0 - L, and shortening speed v, an input too.

    A plant with this load has the causality of an actuator: shortening and its speed in, tension out; gas, valves,
    tubes, friction and series springs are inside. The speed that the caller gives must be the derivative of the
    shortening. The shortenings are coordinates outside the plant, on which the tensions act: the power F v that the
    load receives is part of the power that leaves the mechanism.
    `muscles` are the names before the inputs (`left.shortening`), none for a single muscle. `shortenings` are those at
    which a state is described without inputs, such as the initial state.
    """

    muscles: tuple[str, ...] = ()
    shortenings: tuple[float, ...] = parameter(
        "m", "s_i", "shortening of each muscle where no input is given", bounds=(-1e3, 1e3), fitted=False, default=()
    )

    def check(self) -> None:
        if len(self.shortenings) not in (0, self.muscle_count):
            raise ParameterError(
                f"ExternalLoad: {len(self.shortenings)} shortenings are given for {self.muscle_count} muscles; give "
                "one for each muscle, or none for their resting lengths."
            )

    @property
    def coordinates(self) -> tuple[Coordinate, ...]:
        return ()

    @property
    def muscle_count(self) -> int:
        return max(len(self.muscles), 1)

    @property
    def _prefixes(self) -> tuple[str, ...]:
        return tuple(f"{name}." for name in self.muscles) or ("",)

    @property
    def inputs(self) -> tuple[Input, ...]:
        return tuple(
            variable
            for prefix in self._prefixes
            for variable in (
                Input(f"{prefix}{SHORTENING}", "m", -1e3, 1e3, "shortening from the resting length"),
                Input(f"{prefix}{SHORTENING_SPEED}", "m/s", -1e3, 1e3, "derivative of the shortening"),
            )
        )

    def contractions(self, q: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        given = self.shortenings or (0.0,) * len(resting_lengths)
        return tuple(
            q.get(f"{prefix}{SHORTENING}", default) / length
            for prefix, default, length in zip(self._prefixes, given, resting_lengths, strict=True)
        )

    def contraction_speeds(self, q: Values, v: Values, resting_lengths: Sequence[Value]) -> tuple[Value, ...]:
        return tuple(v.get(f"{prefix}{SHORTENING_SPEED}", 0.0) for prefix in self._prefixes)

    def generalised_forces(
        self, q: Values, tensions: Sequence[Value], resting_lengths: Sequence[Value]
    ) -> dict[str, Value]:
        """Tension [N] of each muscle, by the name of its shortening."""
        return {f"{prefix}{SHORTENING}": tension for prefix, tension in zip(self._prefixes, tensions, strict=True)}

    def acceleration(self, q: Values, v: Values, forces: Values, inputs: Values) -> Values:
        return {}

    def dissipated_power(self, q: Values, v: Values, forces: Values, inputs: Values) -> Value:
        """Power [W] that the load outside receives: the sum of tension times shortening speed."""
        speeds = self.contraction_speeds({}, inputs, ())
        pulls = (forces[f"{prefix}{SHORTENING}"] for prefix in self._prefixes)
        return sum((pull * speed for pull, speed in zip(pulls, speeds, strict=True)), 0.0)
