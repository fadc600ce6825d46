"""Hill-type muscle: contractile element, parallel spring and damper, series element, and enclosed
volume.
"""

import dataclasses
import functools
import textwrap
import warnings
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple

from ...core import (
    Reference,
    StateVariable,
    Value,
    Values,
    autodiff,
    contraction_text,
    model,
    ops,
    quantity_text,
)
from ...core.errors import AirmuscleWarning, ParameterError
from ...recording.notebook import Card, NotebookDisplay
from .characteristic import HOSOVSKY_HILL, Characteristic, Clamped, ForceLaw, VirtualWork
from .characteristic.beyond_range import ForceRange, extended_force, unlimited_force
from .characteristic.calls import excesses, with_stated_range
from .characteristic.validity_range import ValidityRange, validity_range_of
from .friction.base import Friction, NoFriction
from .geometry.base import LENGTH_TOLERANCE, Geometry
from .isobars import plot_isobars
from .passive_elements import (
    CreepElements,
    Damper,
    LinearDamper,
    LinearSpring,
    NoStop,
    RigidWall,
    Spring,
    Stop,
    Wall,
)
from .quantity_arguments import QuantityMethods, Units
from .ratings import Ratings
from .series import ElasticSeriesElement, RigidSeriesElement, SeriesElement, solve_inner_contraction

RELAXED: Values = MappingProxyType({})
"""Relaxed state of a muscle: every state that is not given is 0."""
INNER_CONTRACTION = "inner_contraction"
"""Name of the state of a muscle with a series spring: the contraction of its contractile
element.
"""
USUAL_PRESTRETCH = 0.03
"""Elongation of a muscle without pressure [1] that is usual where its maker states none: the least
of Festo's DMSP muscles (catalogue, as in `festo-dmsp-10`)."""


class MuscleForce(NamedTuple):
    """Tension [N], friction force [N] and shortening speed of the contractile element [m/s] at one
    instant.
    """

    tension: Value
    friction: Value
    inner_speed: Value


@model
class Muscle(QuantityMethods, NotebookDisplay):
    """Hill-type muscle with a pneumatic port (p, V) and a mechanical port (F, v).

        F = max(0, F_KE(p, eps) - F_PP(p, eps) - F_TL(p, eps, v) - F_R - F_C) - F_S

    F_KE force law of the contractile element, F_PP parallel spring, F_TL damper, F_R friction, F_C
    creep elements, F_S end stop. A muscle only pulls; only its end stop can push. With a series
    spring of stretch s, all these elements act behind the spring, and the contraction eps' of the
    contractile element is a state: F_SE(s) = F(p, eps', v') without the max, because the inner
    elements may push against each other. Damper and end stop then determine the speed v' = L0
    deps'/dt from the force imbalance. Reference: Hošovský et al., equation (1), with contractile
    element, spring and damper; all other elements are optional and off by default.
    """

    references: ClassVar[tuple[Reference, ...]] = (HOSOVSKY_HILL,)
    argument_units: ClassVar[Units] = {
        "tension": ("Pa", "1", "m/s"),
        "static_force": ("Pa", "1"),
        "stiffness": ("Pa", "1"),
    }
    accepted: ClassVar[Mapping[str, type]] = MappingProxyType({"contractile": Characteristic})
    """Types of fields in Python; a muscle in a plant, and so one of a file, needs the annotated
    one.
    """

    contractile: ForceLaw
    geometry: Geometry
    spring: Spring = LinearSpring(0.0)
    damper: Damper = LinearDamper(0.0)
    friction: Friction = NoFriction()
    name: str = "muscle"
    validity_range: ValidityRange | None = None
    """Range in which the parameters were identified, if known; a simulation reports when and how
    far it is left.
    """
    wall: Wall = RigidWall()
    series: SeriesElement = RigidSeriesElement()
    stop: Stop = NoStop()
    creep: CreepElements = CreepElements()
    ratings: Ratings | None = None
    """Values that the maker permits, if known; a simulation reports when and how far they are
    exceeded.
    """

    @classmethod
    def ideal(cls, geometry: Geometry, name: str = "muscle") -> "Muscle":
        """An energy-conserving muscle: its tension follows from its volume by the principle of
        virtual work.
        """
        return cls(VirtualWork(geometry), geometry, name=name)

    def plot(self, pressures: Any = None, *, ax: Any = None) -> Any:
        """Plot the tension of the contractile element over the contraction at gauge pressures [Pa],
        or at round ones.

        `ax` is a Matplotlib Axes and is returned; without it a new figure is returned. Raises
        ParameterError.
        """
        title = f"{self.name}: {type(self.contractile).__name__}"
        return plot_isobars(
            self.contractile, title, self.validity_range, pressures=pressures, ax=ax
        )

    def _card(self) -> Card:
        rows = [
            ("component", "value"),
            ("contractile element", type(self.contractile).__name__),
            ("geometry", type(self.geometry).__name__),
            ("resting length", quantity_text(self.geometry.resting_length, "m", "mm")),
        ]
        if (known := validity_range_of(self.contractile, self.validity_range)) is not None:
            rows.append(
                (
                    "valid gauge pressure",
                    " to ".join(quantity_text(p, "Pa", "kPa") for p in known.pressure),
                )
            )
            rows.append(
                ("valid contraction", " to ".join(map(contraction_text, known.contraction)))
            )
        for name in ("spring", "damper", "friction", "wall", "series", "stop", "creep"):
            if (part := getattr(self, name)) != getattr(Muscle, name):
                rows.append((name, textwrap.shorten(str(part), 100, placeholder=" …")))
        return Card("Muscle" if self.name == "muscle" else f"Muscle {self.name}", rows, self.plot)

    def check(self) -> None:
        permitted = None if self.ratings is None else self.ratings.max_force
        stated = with_stated_range(self.contractile, self.validity_range, permitted)
        object.__setattr__(self, "contractile", stated)
        if not self.name:
            raise ParameterError("Muscle: name is ''; it must be a non-empty text, such as 'left'.")
        if isinstance(self.series, ElasticSeriesElement):
            self._check_series_elements()
        law: Any = self.contractile
        while isinstance(law, Clamped):
            law = law.inner
        own = getattr(law, "resting_length", None)
        length = self.geometry.resting_length
        if own is not None and abs(own - length) > LENGTH_TOLERANCE:
            warnings.warn(
                f"{self.name}: {type(law).__name__} is the law of a muscle of {1e3 * own:.6g} mm,"
                f" but the resting length of {type(self.geometry).__name__} is {1e3 * length:.6g}"
                " mm. The force would be that of another length; give both the same resting"
                " length.",
                AirmuscleWarning,
                stacklevel=5,
            )

    def _check_series_elements(self) -> None:
        for pressure in (-1e5, 0.0, 1e6):  # every damper is linear or piecewise linear in pressure
            if not min(self.damper.coefficients(pressure, 0.0)) > 0.0:
                raise ParameterError(
                    f"{self.name}: with a series spring, the damping coefficient must be greater"
                    " than 0, because it determines the speed of the contractile element; at"
                    f" {pressure / 1e3:g} kPa gauge that of {self.damper} is not."
                )
        if not self.friction.rate_independent:
            raise ParameterError(
                f"{self.name}: with a series spring, the friction must be rate-independent;"
                f" {self.friction} is not. Use Dahl, MaxwellSlip, BoucWen or PrandtlIshlinskii."
            )

    @property
    def states(self) -> tuple[StateVariable, ...]:
        """State variables: friction bristles, creep elements, wall, contraction of the contractile
        element.
        """
        inner = StateVariable(
            INNER_CONTRACTION, "1", 0.05, "contraction of the contractile element"
        )
        compliant = (inner,) if isinstance(self.series, ElasticSeriesElement) else ()
        return (*self.friction.states, *self.creep.states, *self.wall.states, *compliant)

    def steady_state(self, pressure: Value, contraction: Value) -> dict[str, Value]:
        """Steady state at a gauge pressure [Pa] and a contraction, with relaxed friction and creep
        elements.
        """
        state: dict[str, Value] = {
            variable.name: 0.0 for variable in (*self.friction.states, *self.creep.states)
        }
        state |= self.wall.steady_state(pressure)
        if isinstance(self.series, ElasticSeriesElement):
            length = self.geometry.resting_length
            limits = self.geometry.contraction_range
            state[INNER_CONTRACTION] = solve_inner_contraction(
                (
                    autodiff.value_and_derivative(self, "internal_imbalance", 3, wrt=1)
                    if self.contractile.traceable and self.geometry.traceable
                    else lambda *at: (self.internal_imbalance(*at), float("nan"))
                ),
                self.series.stiffness * length,
                limits,
                pressure,
                contraction,
            )
        return state

    def internal_imbalance(
        self, pressure: Value, inner_contraction: Value, contraction: Value
    ) -> Value:
        """Static force of the contractile element minus that of the series spring [N]; 0 in the
        steady state.

        It decreases with the inner contraction.
        """
        assert isinstance(self.series, ElasticSeriesElement)
        stretch = (inner_contraction - contraction) * self.geometry.resting_length
        return self.static_force(pressure, inner_contraction) - self.series.force(stretch)

    def inner_contraction(self, contraction: Value, state: Values = RELAXED) -> Value:
        """Contraction of the contractile element for a contraction of the muscle between its
        fittings.
        """
        return (
            state[INNER_CONTRACTION]
            if isinstance(self.series, ElasticSeriesElement)
            else contraction
        )

    def volume(self, inner_contraction: Value, state: Values = RELAXED) -> Value:
        """Enclosed volume [m3] at a contraction of the contractile element."""
        enclosed = self.geometry.volume(inner_contraction)
        return enclosed + self.wall.volume(state) if self.wall.states else enclosed

    def compute_force(
        self,
        pressure: Value,
        inner_contraction: Value,
        contraction: Value,
        speed: Value,
        state: Values = RELAXED,
    ) -> MuscleForce:
        """Tension, friction and inner speed at a gauge pressure [Pa] and a speed of shortening
        [m/s].

        `inner_contraction` is that of the contractile element; `contraction` and `speed` are those
        of the muscle between its fittings.
        """
        if not isinstance(self.series, ElasticSeriesElement):
            friction = self.friction_force(pressure, speed, state)
            return MuscleForce(self.tension(pressure, contraction, speed, state), friction, speed)
        tension = self.series.force(
            (inner_contraction - contraction) * self.geometry.resting_length
        )
        imbalance = self.unclamped_tension(pressure, inner_contraction, 0.0, state) - tension
        inner_speed = self.damper.speed(pressure, inner_contraction, imbalance)
        if not isinstance(self.stop, NoStop):
            # The contact never pulls: the smaller of the speeds without and with the contact
            # satisfies this condition.
            static_force, damping = self.stop.static_force_and_damping(
                inner_contraction, self.geometry.resting_length
            )
            stopped_speed = self.damper.speed(
                pressure, inner_contraction, imbalance - static_force, damping
            )
            inner_speed = ops.minimum(inner_speed, stopped_speed)
        return MuscleForce(tension, self.friction_force(pressure, inner_speed, state), inner_speed)

    def rates(self, state: Values, pressure: Value, inner_speed: Value) -> dict[str, Value]:
        """Time derivatives of the states at a gauge pressure [Pa] and an inner speed of shortening
        [m/s].
        """
        rates = self.friction.rates(self._bristle_state(state), inner_speed)
        rates |= self.creep.rates(state, inner_speed)
        rates |= self.wall.rates(state, pressure)
        if isinstance(self.series, ElasticSeriesElement):
            rates[INNER_CONTRACTION] = inner_speed / self.geometry.resting_length
        return rates

    def tension(
        self, pressure: Value, contraction: Value, speed: Value = 0.0, state: Values = RELAXED
    ) -> Value:
        """Tension [N] at gauge pressure [Pa], contraction and speed of shortening [m/s], without a
        series spring.
        """
        taut = ops.maximum(self.unclamped_tension(pressure, contraction, speed, state), 0.0)
        if isinstance(self.stop, NoStop):
            return taut
        return taut - self.stop.force(contraction, speed, self.geometry.resting_length)

    def unclamped_tension(
        self, pressure: Value, contraction: Value, speed: Value = 0.0, state: Values = RELAXED
    ) -> Value:
        """Sum of the forces of all elements but the end stop [N]; where it is negative, the muscle
        is slack.
        """
        total = (
            self.contractile_force(pressure, contraction)
            - self.spring.force(pressure, contraction, self.geometry.resting_length)
            - self.damper.force(pressure, contraction, speed)
            - self.friction_force(pressure, speed, state)
        )
        relaxed = {s.name: 0.0 for s in self.creep.states}
        return total - self.creep.force({**relaxed, **state}) if relaxed else total

    def contractile_force(self, pressure: Value, contraction: Value) -> Value:
        """Force of the contractile element [N] at a gauge pressure [Pa] and a contraction; outside
        its range that of a stretched sleeve or of a slack muscle, and limited (`extended_force`).
        """
        return extended_force(self.contractile, self._force_range, pressure, contraction)

    @functools.cached_property
    def _force_range(self) -> ForceRange:
        permitted = None if self.ratings is None else self.ratings.max_force
        return ForceRange.of(self.contractile, self.validity_range, permitted)

    def range_excess(self, pressure: float, contraction: float) -> str:
        """Text on how far a gauge pressure [Pa] and a contraction of the contractile element are
        outside its range; empty inside."""
        return "; ".join(excesses(self._force_range, pressure, contraction))

    def excess_at_rest(self, contraction: float) -> str:
        """Text on how far a contraction of the contractile element without pressure is outside its
        range, below which the pretension that the maker permits is usual; empty inside."""
        prestretch: Value = USUAL_PRESTRETCH
        if self.ratings is not None and "max_prestretch" in self.ratings.stated:
            prestretch = self.ratings.max_prestretch
        limits = dataclasses.replace(
            self._force_range,
            min_contraction=min(self._force_range.min_contraction, -prestretch),
            pressure=None,
        )
        return "; ".join(excesses(limits, 0.0, contraction))

    def static_force(self, pressure: Value, contraction: Value) -> Value:
        """Sum of the forces of all elements and the end stop [N] at zero speed, friction and creep
        relaxed.
        """
        elements = self.unclamped_tension(pressure, contraction)
        return elements - self.stop.force(contraction, 0.0, self.geometry.resting_length)

    def unlimited_static_force(self, pressure: Value, contraction: Value) -> Value:
        """`static_force` before the limits of the contractile element are applied, negative where
        the muscle is slack: what inverses and the statics of joints solve for a pressure [N].
        """
        length = self.geometry.resting_length
        contractile = unlimited_force(self.contractile, self._force_range, pressure, contraction)
        elements = contractile - self.spring.force(pressure, contraction, length)
        return elements - self.stop.force(contraction, 0.0, length)

    def friction_force(self, pressure: Value, speed: Value, state: Values = RELAXED) -> Value:
        """Friction force against shortening [N] at a gauge pressure [Pa] and a speed of shortening
        [m/s].
        """
        return self.friction.pressure_factor(pressure) * self.friction.force(
            self._bristle_state(state), speed
        )

    def _bristle_state(self, state: Values) -> dict[str, Value]:
        return {s.name: state.get(s.name, 0.0) for s in self.friction.states}

    def stiffness(self, pressure: Value, contraction: Value) -> Value:
        """Static stiffness -dF/deps at constant pressure [N]; divide by the resting length for N/m.

        Exact where the muscle is taut. Stiffness of the contractile element with spring and end
        stop; a series spring reduces that of the muscle, and friction, which increases it until the
        bristles slide, is not included. With closed valves the pressure changes and the stiffness
        is larger: see `airmuscle.physics.stiffness`.
        """
        return 0.0 - autodiff.derivative(
            self, "static_force", pressure, contraction, wrt=1
        )  # not -0 where slack
