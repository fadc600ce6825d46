"""A muscle after Hill: contractile element, parallel spring and damper between two fittings, and its volume."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar, NamedTuple

from ..characteristic.base import Characteristic, ForceLaw
from ..characteristic.contractile_surface import HOSOVSKY_HILL
from ..characteristic.validity_range import ValidityRange
from ..characteristic.virtual_work import VirtualWork
from ..core import autodiff, ops
from ..core.declaration import model
from ..core.errors import ParameterError
from ..core.ops import Value
from ..core.reference import Reference
from ..core.variables import StateVariable
from ..friction.base import Friction, NoFriction
from ..geometry.base import Geometry
from .creep import CreepElements
from .damper import Damper, LinearDamper
from .series import RigidSeries, Series, SeriesSpring
from .series_equilibrium import settled_inside
from .spring import LinearSpring, Spring
from .stop import NoStop, Stop
from .wall import RigidWall, Wall

RELAXED: Mapping[str, Value] = MappingProxyType({})
"""States of a muscle that are not named stand at 0."""
INNER = "inner_contraction"
"""The state of a muscle with a compliant series element: contraction of its contractile part."""


class MuscleForce(NamedTuple):
    """What a muscle does at one moment: tension, friction [N], and the speed of its contractile part [m/s]."""

    tension: Value
    friction: Value
    speed: Value


@model
class Muscle:
    """Two ports, pneumatic (p, V) and mechanical (F, v), after Hill.

        F = max(0, F_KE(p, eps) - F_PP(p, eps) - F_TL(p, eps, v) - F_R - F_C) - F_S

    F_KE contractile characteristic, F_PP parallel spring, F_TL damper, F_R friction, F_C creeping elements, F_S end
    stop. A muscle pulls; only its end stop pushes. With a series spring of stretch s all of that acts inside it, and
    the contraction eps' of the contractile part is a state: F_SE(s) = F(p, eps', v') without the max, as what is inside
    may push itself apart; damper and stop turn what is left of the force into the speed v' = L0 eps''.
    Reference: Hosovsky et al., equation (1), which has contractile element, spring and damper; the others are off
    unless given.
    """

    references: ClassVar[tuple[Reference, ...]] = (HOSOVSKY_HILL,)

    contractile: ForceLaw
    geometry: Geometry
    spring: Spring = LinearSpring(0.0)
    damper: Damper = LinearDamper(0.0)
    friction: Friction = NoFriction()
    name: str = "muscle"
    validity_range: ValidityRange | None = None
    """Where its numbers were measured, if that is known: a run says when and how far it left it."""
    wall: Wall = RigidWall()
    series: Series = RigidSeries()
    stop: Stop = NoStop()
    creep: CreepElements = CreepElements()

    @classmethod
    def ideal(cls, geometry: Geometry, name: str = "muscle") -> Muscle:
        """A muscle whose tension follows from its volume by virtual work, so that it neither makes nor loses energy."""
        return cls(VirtualWork(geometry), geometry, name=name)

    def check(self) -> None:
        kinds = {"contractile": Characteristic, "geometry": Geometry, "spring": Spring, "damper": Damper, "wall": Wall,
                 "friction": Friction, "series": Series, "stop": Stop, "creep": CreepElements}  # fmt: skip
        for field, kind in kinds.items():
            part = getattr(self, field)
            if not isinstance(part, kind):
                raise ParameterError(f"Muscle: its {field} must be a {kind.__name__}; it is {part!r}.")
        if not isinstance(self.name, str) or not self.name:
            raise ParameterError(f"Muscle: its name is {self.name!r}; it must be a word, as 'left'.")
        if not isinstance(self.validity_range, ValidityRange | None):
            raise ParameterError(f"Muscle: its validity range must be a Box, or None; it is {self.validity_range!r}.")
        if isinstance(self.series, SeriesSpring):
            self._check_series_elements()

    def _check_series_elements(self) -> None:
        for pressure in (-1e5, 0.0, 1e6):  # every damper is linear in pressure, or made of lines
            if not min(self.damper.coefficients(pressure, 0.0)) > 0.0:
                raise ParameterError(
                    f"{self.name}: a series spring needs a damper greater than 0 beside the contractile element, which "
                    f"gives its speed; at {pressure / 1e3:g} kPa gauge that of {self.damper} is not."
                )
        if not self.friction.rate_independent:
            raise ParameterError(
                f"{self.name}: beside a series spring friction must not depend on speed; {self.friction} does. "
                "Use Dahl, MaxwellSlip, BoucWen or PrandtlIshlinskii."
            )

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """Bristles of its friction, creeping springs, wall, contraction of its contractile part."""
        inner = StateVariable(INNER, "1", 0.05, "contraction of the contractile part")
        compliant = (inner,) if isinstance(self.series, SeriesSpring) else ()
        return (*self.friction.states, *self.creep.states, *self.wall.states, *compliant)

    def settled(self, pressure: Value, contraction: Value) -> dict[str, Value]:
        """Its states at rest at a gauge pressure [Pa] and contraction [1], as if it had never moved."""
        found: dict[str, Value] = {state.name: 0.0 for state in (*self.friction.states, *self.creep.states)}
        found |= self.wall.settled(pressure)
        if isinstance(self.series, SeriesSpring):
            found[INNER] = settled_inside(self, pressure, contraction)
        return found

    def internal_imbalance(self, pressure: Value, inner_contraction: Value, contraction: Value) -> Value:
        """Pull of the contractile part at standstill less that of its series spring [N], which falls with the first's
        contraction [1]; 0 at rest."""
        assert isinstance(self.series, SeriesSpring)
        stretch = (inner_contraction - contraction) * self.geometry.resting_length
        return self.static_force(pressure, inner_contraction) - self.series.force(stretch)

    def inner_contraction(self, contraction: Value, state: Mapping[str, Value] = RELAXED) -> Value:
        """Contraction [1] of the contractile part, where the fittings stand at `contraction`."""
        return state[INNER] if isinstance(self.series, SeriesSpring) else contraction

    def volume(self, inner_contraction: Value, state: Mapping[str, Value] = RELAXED) -> Value:
        """Volume [m3] at a contraction [1] of the contractile part."""
        enclosed = self.geometry.volume(inner_contraction)
        return enclosed + self.wall.volume(state) if self.wall.states else enclosed

    def pull(
        self, pressure: Value, inner_contraction: Value, contraction: Value, speed: Value,
        state: Mapping[str, Value] = RELAXED,
    ) -> MuscleForce:  # fmt: skip
        """What it does at gauge pressure [Pa], contraction [1] inside and at the fittings, speed [m/s] of these."""
        if not isinstance(self.series, SeriesSpring):
            friction = self.friction_force(speed, state)
            return MuscleForce(self.tension(pressure, contraction, speed, state), friction, speed)
        tension = self.series.force((inner_contraction - contraction) * self.geometry.resting_length)
        left = self.unclamped_tension(pressure, inner_contraction, 0.0, state) - tension
        inside = self.damper.speed(pressure, inner_contraction, left)
        if not isinstance(self.stop, NoStop):
            # The contact never pulls: of the speeds with and without it the lesser is the one at which it does not.
            still, growth = self.stop.parts(inner_contraction, self.geometry.resting_length)
            inside = ops.minimum(inside, self.damper.speed(pressure, inner_contraction, left - still, growth))
        return MuscleForce(tension, self.friction_force(inside, state), inside)

    def rates(self, state: Mapping[str, Value], pressure: Value, inner_speed: Value) -> dict[str, Value]:
        """The time derivatives of its states at gauge pressure [Pa] and speed [m/s] of its contractile part."""
        rates = self.friction.rates(self._bristles(state), inner_speed)
        rates |= self.creep.rates(state, inner_speed)
        rates |= self.wall.rates(state, pressure)
        if isinstance(self.series, SeriesSpring):
            rates[INNER] = inner_speed / self.geometry.resting_length
        return rates

    def tension(
        self, pressure: Value, contraction: Value, speed: Value = 0.0, state: Mapping[str, Value] = RELAXED
    ) -> Value:
        """Pull on the load [N] at gauge pressure [Pa], contraction [1], speed of contraction [m/s], rigid in series."""
        taut = ops.maximum(self.unclamped_tension(pressure, contraction, speed, state), 0.0)
        if isinstance(self.stop, NoStop):
            return taut
        return taut - self.stop.force(contraction, speed, self.geometry.resting_length)

    def unclamped_tension(
        self, pressure: Value, contraction: Value, speed: Value = 0.0, state: Mapping[str, Value] = RELAXED
    ) -> Value:
        """The sum of the elements' forces [N]; where it is negative the muscle hangs slack."""
        total = (
            self.contractile.force(pressure, contraction)
            - self.spring.force(pressure, contraction, self.geometry.resting_length)
            - self.damper.force(pressure, contraction, speed)
            - self.friction_force(speed, state)
        )
        return total - self.creep.force({**self._still(), **state}) if self.creep.states else total

    def static_force(self, pressure: Value, contraction: Value) -> Value:
        """The sum of the elements' forces [N] at standstill, end stop and all, with everything else relaxed."""
        elements = self.unclamped_tension(pressure, contraction)
        return elements - self.stop.force(contraction, 0.0, self.geometry.resting_length)

    def friction_force(self, speed: Value, state: Mapping[str, Value] = RELAXED) -> Value:
        """Force of the friction against contraction [N]."""
        return self.friction.force(self._bristles(state), speed)

    def _bristles(self, state: Mapping[str, Value]) -> dict[str, Value]:
        return {s.name: state.get(s.name, 0.0) for s in self.friction.states}

    def _still(self) -> dict[str, Value]:
        return {s.name: 0.0 for s in self.creep.states}

    def stiffness(self, pressure: Value, contraction: Value) -> Value:
        """-dF/deps at constant pressure [N], exact where the muscle is taut; divide by the resting length for N/m.

        That of the contractile part with spring and end stop: a series spring makes the muscle softer.

        With shut valves the pressure rises as the muscle is pulled, and it is stiffer: module `stiffness`. Friction is
        left out: its bristles add theirs until they slide.
        """
        return -autodiff.derivative(self, "static_force", pressure, contraction, wrt=1)
