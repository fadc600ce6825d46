"""The tube between a valve and a muscle as volume and resistance, in one piece or many."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ..core import ops
from ..core.declaration import model, parameter
from ..core.errors import ParameterError
from ..core.ops import Value
from ..core.reference import Reference
from ..core.tree import unflatten
from ..core.variables import StateVariable, add_prefix, select_prefix, with_prefix
from .flow import orifice_flow
from .gas import Air, Ambient, Flow, Gas, Isothermal
from .orifice import Orifice
from .tube_model import TubeModel
from .valve import Valve

ECKERSTEN = Reference(
    "eckersten-1975",
    "Eckersten, J.",
    "Simplified flow calculations for pneumatic components",
    "Atlas Copco, Stockholm; after P. Beater, Pneumatic Drives, Springer 2007",
    1975,
    note="conductance and critical ratio of a tube; second hand, held against Darcy's law in the tests",
)
_TEMPLATE_VALVE = Valve(1e-8, 0.3)


@model
class TubeOrifice(Orifice):
    """The flow through a smooth tube, ends and all, as an orifice after ISO 6358.

        C = 0.029 D^2/sqrt(L/D^1.25 + 510),   b = 474 C/D^2

    C in m3/(s Pa); D inner diameter, L length [m]. An empirical formula, in numbers that belong to these units.
    Reference: Eckersten (1975), after Beater (2007).
    """

    references: ClassVar[tuple[Reference, ...]] = (ECKERSTEN,)

    length: float = parameter("m", "L", "length of the tube", bounds=(1e-3, 200.0))
    diameter: float = parameter("m", "D", "inner diameter of the tube", bounds=(5e-4, 0.1))

    @property
    def conductance(self) -> Value:
        """C [m3/(s Pa)]."""
        return 0.029 * self.diameter**2 / ops.sqrt(self.length / self.diameter**1.25 + 510.0)

    @property
    def critical_ratio(self) -> Value:
        """b [1]."""
        return 474.0 * self.conductance / self.diameter**2

    def mass_flow(self, upstream: Value, downstream: Value, opening: Value, temperature: Value) -> Value:
        valve = unflatten(_TEMPLATE_VALVE, (self.conductance, self.critical_ratio, _TEMPLATE_VALVE.laminar_ratio))
        return valve.mass_flow(upstream, downstream, opening, temperature)


@model
class Tube(TubeModel):
    """A volume, and an orifice from it to the muscle; or `pieces` of them one after the other.

    `orifice` is the whole tube's. Each of n pieces has 1/n of the volume and sqrt(n) times the conductance, which is
    exact for the flow law of a tube with friction, q^2 = C^2 (p_1^2 - p_2^2), that is for a critical ratio of 0, and
    near equal pressures for any. It knows no inertia, so a step is felt at once at the other end, if weakly:
    `DistributedTube` shows delay and resonance. The valve is at the volume.
    """

    orifice: Orifice
    volume: float = parameter("m3", "V_t", "volume of the tube", bounds=(1e-9, 1e-2))
    segment_count: int = 1
    gas: Gas = Isothermal()

    @classmethod
    def from_dimensions(cls, length: float, diameter: float, pieces: int = 1, gas: Gas = Isothermal()) -> Tube:
        """The tube of a length and an inner diameter [m]: its volume, and the flow of a `TubeOrifice`."""
        return cls(TubeOrifice(length, diameter), ops.pi / 4.0 * diameter**2 * length, pieces, gas)

    def check(self) -> None:
        check_segment_count("Tube", self.segment_count)

    def states(self, ambient: Ambient) -> tuple[StateVariable, ...]:
        of_piece = self.gas.states(self.volume / self.segment_count, ambient)
        return tuple(state for name in self.prefixes for state in add_prefix(name, of_piece))

    def steady_state(self, air: Air, ambient: Ambient) -> dict[str, Value]:
        content = self.gas.state_at(air.pressure, self.volume / self.segment_count, ambient)
        return {name: value for prefix in self.prefixes for name, value in with_prefix(prefix, content).items()}

    def air_states(self, state: Mapping[str, Value], ambient: Ambient) -> tuple[Air, ...]:
        held = (select_prefix(name, state) for name in self.prefixes)
        return tuple(self.gas.air(content, self.volume / self.segment_count, ambient) for content in held)

    def rates(
        self, state: Mapping[str, Value], airs: tuple[Air, ...], flow: Flow, muscle: Air, ambient: Ambient
    ) -> tuple[dict[str, Value], Flow]:
        rates: dict[str, Value] = {}
        for name, air, after in zip(self.prefixes, airs, (*airs[1:], muscle), strict=True):
            onward = orifice_flow(self.orifice, air, after, self.segment_count**0.5)
            rates |= with_prefix(name, self.gas.rates(select_prefix(name, state), air, flow - onward, 0.0, ambient))
            flow = onward
        return rates, flow


def check_segment_count(owner: str, segment_count: int) -> None:
    """Raise ParameterError unless a tube is cut into 1 to 200 pieces."""
    if isinstance(pieces, bool) or not (isinstance(pieces, int) and 1 <= pieces <= 200):
        raise ParameterError(f"{owner}: segment_count is {segment_count!r}; give a whole number from 1 to 200.")
