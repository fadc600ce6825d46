"""Requirements of a sizing (lift, gripper, joint), conditions of operation, and choices of muscles
that meet them.
"""

import abc
import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, ClassVar, Self

import numpy as np

from ...core import STANDARD_GRAVITY, Array, ParameterError, ShortRepr, model, parameter
from ...files.library.entry import Entry
from ...physics.pneumatics.gas import (
    GAS_CONSTANT,
    REFERENCE_DENSITY,
    Ambient,
    Isothermal,
    absolute_pressure,
)
from .static_muscle import EndPoint, StaticMuscle, product_of

MAX_COUNT = 20
"""Maximum number of muscles in parallel that is tried (chosen)."""
PATH_POINTS = 33
"""Points of a stroke at which the load is compared with the muscle (chosen)."""


class PullRequirement(abc.ABC):
    """Requirement of muscles that pull a load in parallel (interface): travel of the muscles, and
    the load on all of them together, linear in their displacement.
    """

    @property
    @abc.abstractmethod
    def travel(self) -> float:
        """Travel of the muscles [m]."""

    @property
    @abc.abstractmethod
    def moving_mass(self) -> float:
        """Mass [kg] that moves with the muscles; 0 where it is not stated."""

    @abc.abstractmethod
    def load(self, displacement: Any) -> Any:
        """Force on the muscles at rest [N] at their displacement [m] from the start; arrays as
        well.
        """

    @abc.abstractmethod
    def loads(self, displacement: Array, cycle_time: float) -> tuple[Array, Array]:
        """Least and greatest force on the muscles [N] at displacements [m], at rest or moving with
        a cycle time [s].
        """

    @abc.abstractmethod
    def reduced(self, load: float = 1.0, travel: float = 1.0) -> Self:
        """The requirement with a fraction of the load and of the travel."""

    @abc.abstractmethod
    def describe(self) -> str:
        """The requirement as text."""

    def check(self) -> None:
        """Raise ParameterError unless the load pulls at both ends."""
        for position, place in ((0.0, "start"), (self.travel, "end")):
            if not self.load(position) > 0.0:
                raise ParameterError(
                    f"{type(self).__name__}: the load at the {place} of the stroke is"
                    f" {self.load(position):.4g} N; it must be greater than 0, because a muscle"
                    " only pulls. Give a mass, a force, or a spring with a preload."
                )

    @property
    def path(self) -> tuple[Array, Array]:
        """Displacements [m] of the muscles and loads at rest [N] along the travel, (PATH_POINTS,)
        each.
        """
        displacement = np.linspace(0.0, self.travel, PATH_POINTS)
        return displacement, np.broadcast_to(self.load(displacement), displacement.shape)

    @property
    def stiffness_at_muscle(self) -> float:
        """Growth of the load per displacement of the muscles [N/m]."""
        return float(self.load(self.travel) - self.load(0.0)) / self.travel

    @property
    def work(self) -> float:
        """Work against the load over the travel [J]."""
        return float(0.5 * (self.load(0.0) + self.load(self.travel)) * self.travel)


@model
class LiftRequirement(PullRequirement):
    """Lift: muscles in parallel move a load over a stroke, directly or by a lever; F(s) = m g + F_0
    + k s at a displacement s of the load from the start.

    m mass, F_0 constant force, k stiffness of a spring that is relaxed at the start, i lever ratio:
    motion of the load over that of the muscles, which is 1 without a lever. The muscles travel S/i
    and carry i F(s): the arms are at right angles to the forces (chosen). The load must pull at
    both ends. The mass adds the force of a harmonic motion over the stroke with the cycle time, i m
    (S/2 - s) (2 pi/T)^2.
    """

    from_file: ClassVar[bool] = False

    stroke: float = parameter("m", "S", "stroke", bounds=(1e-4, 10.0))
    mass: float = parameter("kg", "m", "mass of the load", bounds=(0.0, 1e5), default=0.0)
    force: float = parameter(
        "N", "F_0", "constant force of the load", bounds=(0.0, 1e6), default=0.0
    )
    stiffness: float = parameter(
        "N/m", "k", "stiffness of a spring", bounds=(-1e7, 1e7), default=0.0
    )
    lever: float = parameter(
        "1", "i", "motion of the load over motion of the muscles", bounds=(0.02, 50.0), default=1.0
    )

    @property
    def travel(self) -> float:
        return self.stroke / self.lever

    @property
    def moving_mass(self) -> float:
        return self.mass * self.lever**2

    def load(self, displacement: Any) -> Any:
        at_load = self.lever * displacement
        return self.lever * (self.mass * STANDARD_GRAVITY + self.force + self.stiffness * at_load)

    def loads(self, displacement: Array, cycle_time: float) -> tuple[Array, Array]:
        held = self.load(displacement)
        acceleration = (0.5 * self.travel - displacement) * (2 * math.pi / cycle_time) ** 2
        moving = held + self.moving_mass * acceleration
        return np.minimum(held, moving), np.maximum(held, moving)

    def reduced(self, load: float = 1.0, travel: float = 1.0) -> "LiftRequirement":
        return replace(
            self,
            mass=load * self.mass,
            force=load * self.force,
            stiffness=load * self.stiffness / travel,
            stroke=travel * self.stroke,
        )

    def describe(self) -> str:
        first = self.load(0.0) / self.lever
        last = self.load(self.travel) / self.lever
        load = f"{first:.4g} to {last:.4g} N"
        if math.isclose(first, last):
            load = f"{first:.4g} N"
        if self.mass:
            load = f"{self.mass:.4g} kg ({load})"
        motion = f"{load} over {1e3 * self.stroke:.4g} mm"
        return motion if self.lever == 1.0 else f"{motion} by a lever of {self.lever:.4g}"


OPENING_SHARE = 0.1
"""Force of the spring that opens a gripper, without a stated one, relative to the force on the
muscles of the gripping fingers (chosen)."""


@model
class GripperRequirement(PullRequirement):
    """Gripper: muscles in parallel close fingers against a spring that opens them, and grip with a
    force at any position of their travel.

        F(x) = F_o + i n G x/x_S at rest (an elastic object),   F_o <= F <= F_o + i n G at every x

    G grip force of each of n fingers, i lever ratio: motion of a finger over that of the muscles,
    F_o force of the opening spring on the muscles, x their displacement, x_S = S/i their travel.
    The mass of the fingers is left out (chosen).
    """

    from_file: ClassVar[bool] = False

    opening: float = parameter("m", "S", "travel of each finger", bounds=(1e-4, 1.0))
    grip: float = parameter("N", "G", "grip force of each finger", bounds=(0.1, 1e5))
    fingers: float = parameter("1", "n", "number of fingers", bounds=(1.0, 20.0), default=2.0)
    lever: float = parameter(
        "1", "i", "motion of a finger over motion of the muscles", bounds=(0.02, 50.0), default=1.0
    )
    opening_force: float = parameter(
        "N",
        "F_o",
        "force of the opening spring on the muscles; 0 is a tenth of that of the fingers",
        bounds=(0.0, 1e6),
        default=0.0,
    )

    @property
    def travel(self) -> float:
        return self.opening / self.lever

    @property
    def moving_mass(self) -> float:
        return 0.0

    @property
    def grip_at_muscle(self) -> float:
        """Force of all gripping fingers on the muscles [N]."""
        return self.lever * self.fingers * self.grip

    @property
    def spring(self) -> float:
        """Force of the opening spring on the muscles [N]."""
        return self.opening_force or OPENING_SHARE * self.grip_at_muscle

    def load(self, displacement: Any) -> Any:
        return self.spring + self.grip_at_muscle * displacement / self.travel

    def loads(self, displacement: Array, cycle_time: float) -> tuple[Array, Array]:
        least = np.full(np.shape(displacement), self.spring)
        return least, least + self.grip_at_muscle

    def reduced(self, load: float = 1.0, travel: float = 1.0) -> "GripperRequirement":
        return replace(
            self,
            grip=load * self.grip,
            opening_force=load * self.opening_force,
            opening=travel * self.opening,
        )

    def describe(self) -> str:
        lever = "" if self.lever == 1.0 else f" by a lever of {self.lever:.4g}"
        return (
            f"a grip of {self.grip:.4g} N at each of {self.fingers:.4g} fingers over"
            f" {1e3 * self.opening:.4g} mm{lever}"
        )


@model
class JointRequirement:
    """Joint: two equal groups of muscles turn a joint over an angle, symmetric about its middle, on
    equal pulleys.

    The torque may act in either direction, also at the ends of the range. The inertia adds the
    torque of a harmonic motion over the range with the cycle time, J (Theta/2) (2 pi/T)^2, at the
    ends.
    """

    from_file: ClassVar[bool] = False

    angle: float = parameter("rad", "Theta", "range of the angle", bounds=(1e-3, 2 * math.pi))
    torque: float = parameter("N m", "M", "torque of the load", bounds=(0.0, 1e5), default=0.0)
    inertia: float = parameter(
        "kg m^2", "J", "moment of inertia about the joint axis", bounds=(0.0, 1e4), default=0.0
    )

    def check(self) -> None:
        if not self.torque > 0.0:
            raise ParameterError(
                "JointRequirement: the torque of the load is 0 N m; it must be greater than 0: with"
                " it the joint holds the ends of its range. Give the maximum torque of weight,"
                " friction or disturbance."
            )

    def acceleration_torque(self, cycle_time: float) -> float:
        """Torque that accelerates the inertia at the ends of a harmonic motion with this cycle time
        [s]; in N m.
        """
        return self.inertia * 0.5 * self.angle * (2 * math.pi / cycle_time) ** 2

    @property
    def work(self) -> float:
        """Work against the torque in a cycle, once over the range in each direction [J]."""
        return 2.0 * self.torque * self.angle

    def reduced(self, load: float = 1.0, travel: float = 1.0) -> "JointRequirement":
        """The requirement with a fraction of torque and inertia, and of the angle."""
        return replace(
            self, torque=load * self.torque, inertia=load * self.inertia, angle=travel * self.angle
        )

    def describe(self) -> str:
        """Torque and angle as text."""
        return f"{self.torque:.4g} N m over {math.degrees(self.angle):.4g} degrees"


@model
class SizingConditions:
    """Conditions of operation of a sizing: supply, safety factor, cycle time and limits of size.

    The muscle holds the safety factor times the load at the working range of pressure, and within
    its permitted force. The defaults are chosen. A safety factor of at least 1.05 keeps a pressure
    difference for the flow into the muscle.
    """

    from_file: ClassVar[bool] = False

    supply: float = parameter(
        "Pa", "p_s", "supply pressure (gauge)", bounds=(1e4, 2e6), plausible=1e3
    )
    safety_factor: float = parameter(
        "1", "S_F", "factor on the load that the muscle must hold", bounds=(1.05, 20.0), default=1.5
    )
    cycle_time: float = parameter(
        "s", "T", "time of a cycle, there and back", bounds=(0.02, 1e4), default=2.0
    )
    max_length: float = parameter(
        "m", "L_max", "maximum nominal length", bounds=(1e-3, 20.0), default=20.0
    )
    max_diameter: float = parameter(
        "m", "D_max", "maximum outer diameter", bounds=(1e-3, 1.0), default=1.0
    )
    min_pressure: float = parameter(
        "Pa",
        "p_min",
        "minimum working pressure; discharge to 0 takes an infinite time",
        bounds=(0.0, 1e6),
        default=1e4,
    )
    max_count: int = 3
    """Maximum number of muscles in parallel; with a joint, on each side."""
    min_count: int = 1
    """Least number of muscles in parallel."""
    ambient: Ambient = Ambient()

    def check(self) -> None:
        for name, least in (("min_count", 1), ("max_count", self.min_count)):
            count = getattr(self, name)
            if isinstance(count, bool) or not least <= count <= MAX_COUNT:
                raise ParameterError(
                    f"SizingConditions: {name} is {count!r}; allowed range: {least} to {MAX_COUNT}."
                )
        if not self.min_pressure < self.supply:
            raise ParameterError(
                f"SizingConditions: min_pressure is {self.min_pressure:g} Pa; it must be less than"
                f" the supply pressure, {self.supply:g} Pa."
            )


Requirement = LiftRequirement | GripperRequirement | JointRequirement


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class MuscleDesign(ShortRepr):
    """Design of one requirement: end points of a muscle, pulley radius and force reserve.

    extended    end point at which the muscle is long: start of the lift, stretched muscle of the
                joint
    contracted  end point at which the muscle is short
    reserve     least capacity divided by the need, minus 1, along the stroke of a lift and at the
                ends of the range of a joint; at least the safety factor minus 1
    radius      pulley radius [m] of a joint; None for a lift
    radii       minimum and maximum pulley radius [m] of a muscle that is a tenth longer; None for a
                lift
    """

    extended: EndPoint
    contracted: EndPoint
    reserve: float
    radius: float | None = None
    radii: tuple[float, float] | None = None


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class MuscleChoice(ShortRepr):
    """A muscle type that meets a requirement, at its shortest length.

    muscle           the entry at this length and its working range
    length           nominal length [m]
    count            number of muscles in parallel; with a joint, on each side
    geometry_source  where the geometry is from, which gives volume and diameter; empty without one
    """

    muscle: StaticMuscle
    length: float
    count: int
    design: MuscleDesign
    requirement: Requirement
    conditions: SizingConditions
    geometry_source: str = ""

    @property
    def entry(self) -> Entry:
        """The library entry, scaled to the length."""
        return self.muscle.entry

    @property
    def total_count(self) -> int:
        """Number of all muscles."""
        return self.count * (2 if isinstance(self.requirement, JointRequirement) else 1)

    @property
    def product(self) -> str:
        """The product, or the name of the entry where none is stated."""
        return product_of(self.entry)

    @property
    def size(self) -> str:
        """Number, product and length as text."""
        return f"{self.total_count} x {self.product}, {1e3 * self.length:.4g} mm"

    @property
    def by_law(self) -> str:
        """The law as text, where the name of the product is another."""
        return "" if self.product == self.entry.name else f" by the law {self.entry.name}"

    @property
    def air(self) -> float | None:
        """Mass of the air [kg] that all muscles take in a cycle; None without a geometry.

        The magnitude of the difference of m = p V/(R T) between both end points, at ambient
        temperature, without tubes.
        """
        masses = []
        ambient = self.conditions.ambient
        for point in (self.design.contracted, self.design.extended):
            volume = self.muscle.volume(point.pressure, point.contraction)
            if volume is None:
                return None
            masses.append(
                Isothermal().air_mass(absolute_pressure(point.pressure, ambient), volume, ambient)
            )
        return self.total_count * abs(float(masses[0]) - float(masses[1]))

    @property
    def reference_volume(self) -> float | None:
        """Volume of the air of a cycle [m3] at the reference atmosphere of ISO 8778; None without a
        geometry.
        """
        return None if self.air is None else self.air / REFERENCE_DENSITY

    @property
    def air_energy(self) -> float | None:
        """Available energy [J] of the air of a cycle at the supply pressure p_s, m R T
        ln(p_s/p_amb) for isothermal expansion; None without a geometry."""
        if self.air is None:
            return None
        ambient = self.conditions.ambient
        ratio = absolute_pressure(self.conditions.supply, ambient) / ambient.pressure
        return self.air * GAS_CONSTANT * ambient.temperature * math.log(ratio)

    @property
    def efficiency(self) -> float | None:
        """Work against the load divided by the available energy of the air [1]; None without a
        geometry.
        """
        return None if not self.air_energy else self.requirement.work / self.air_energy

    @property
    def diameter(self) -> float | None:
        """Maximum outer diameter at the contracted end point [m], without the wall; None without a
        geometry.
        """
        return self.muscle.diameter(self.design.contracted.contraction)

    @property
    def area(self) -> float | None:
        """Mounting area [m2]: number of muscles times outer diameter at the contracted end times
        nominal length, all muscles side by side; None without a geometry.
        """
        return None if self.diameter is None else self.total_count * self.diameter * self.length


SortKey = Callable[[MuscleChoice], float | None]
"""Criterion of a ranking: the smaller the better; a choice without a value is last."""


def by_area(choice: MuscleChoice) -> float | None:
    """Mounting area [m2]."""
    return choice.area


def by_air(choice: MuscleChoice) -> float | None:
    """Air of a cycle [kg]."""
    return choice.air


def by_length(choice: MuscleChoice) -> float:
    """Nominal length [m]."""
    return choice.length


def by_count(choice: MuscleChoice) -> int:
    """Number of all muscles."""
    return choice.total_count


def by_diameter(choice: MuscleChoice) -> float | None:
    """Maximum outer diameter [m]."""
    return choice.diameter


def by_reserve(choice: MuscleChoice) -> float:
    """Force reserve, largest first."""
    return -choice.design.reserve


SORT_KEYS: Mapping[str, SortKey] = MappingProxyType(
    {
        "area": by_area,
        "air": by_air,
        "length": by_length,
        "count": by_count,
        "reserve": by_reserve,
        "diameter": by_diameter,
    }
)
"""The criteria by their names."""


CRITERIA: Mapping[SortKey, str] = MappingProxyType(
    {
        by_area: "the least mounting area, number x outer diameter x nominal length",
        by_air: "the least air of a cycle",
        by_length: "the shortest nominal length",
        by_count: "the fewest muscles",
        by_reserve: "the greatest force reserve",
        by_diameter: "the smallest outer diameter",
    }
)
"""What is said of the first choice by each criterion."""
EQUAL = 1e-6
"""Relative difference of a criterion up to which two choices are equal (chosen): the resolution
of the lengths."""


def rank(choices: list[MuscleChoice], sort: SortKey) -> tuple[MuscleChoice, ...]:
    """The choices by a criterion, equal ones by number of muscles, then by length and name. Raises
    ParameterError.
    """
    if not callable(sort):
        raise ParameterError(
            f"sort is {sort!r}; it must be a function of a choice, such as by_area or by_length."
        )
    values = [sort(choice) for choice in choices]
    levels = [math.inf if value is None else float(value) for value in values]
    rows = sorted(range(len(choices)), key=levels.__getitem__)
    ranks = {}
    level = -math.inf
    for row in rows:
        if not math.isclose(levels[row], level, rel_tol=EQUAL):
            level = levels[row]
        ranks[row] = level

    def order(row: int) -> tuple[float, int, float, str]:
        choice = choices[row]
        return ranks[row], choice.count, choice.length, choice.entry.name

    return tuple(choices[row] for row in sorted(rows, key=order))
