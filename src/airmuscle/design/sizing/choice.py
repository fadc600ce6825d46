"""Choices of a sizing: length, number, end points, air and energy of a muscle that meets a requirement."""

import dataclasses
import math
import operator
from collections.abc import Callable, Mapping
from types import MappingProxyType

from ...core import ParameterError, ShortRepr
from ...files.library.entry import Entry
from ...physics.pneumatics.gas import GAS_CONSTANT, REFERENCE_DENSITY, Isothermal, absolute_pressure
from .requirement import JointRequirement, LiftRequirement, SizingConditions
from .static_muscle import EndPoint, StaticMuscle

Requirement = LiftRequirement | JointRequirement


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class MuscleDesign(ShortRepr):
    """Design of one requirement: end points of a muscle, pulley radius and force reserve.

    extended    end point at which the muscle is long: start of the lift, stretched muscle of the joint
    contracted  end point at which the muscle is short
    reserve     least capacity divided by the need, minus 1, along the stroke of a lift and at the ends of the range of
                a joint; at least the safety factor minus 1
    radius      pulley radius [m] of a joint; None for a lift
    radii       minimum and maximum pulley radius [m] of a muscle that is a tenth longer; None for a lift
    """

    extended: EndPoint
    contracted: EndPoint
    reserve: float
    radius: float | None = None
    radii: tuple[float, float] | None = None


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class MuscleChoice(ShortRepr):
    """A muscle type that meets a requirement, at its shortest length.

    muscle  the entry at this length and its working range
    length  nominal length [m]
    count   number of muscles in parallel; with a joint, on each side
    """

    muscle: StaticMuscle
    length: float
    count: int
    design: MuscleDesign
    requirement: Requirement
    conditions: SizingConditions

    @property
    def entry(self) -> Entry:
        """The library entry, scaled to the length."""
        return self.muscle.entry

    @property
    def total_count(self) -> int:
        """Number of all muscles."""
        return self.count * (2 if isinstance(self.requirement, JointRequirement) else 1)

    @property
    def size(self) -> str:
        """Number, muscle and length as text."""
        return f"{self.total_count} x {self.entry.name}, {1e3 * self.length:.4g} mm"

    @property
    def air(self) -> float | None:
        """Mass of the air [kg] that all muscles take in a cycle; None without a geometry.

        The magnitude of the difference of m = p V/(R T) between both end points, at ambient temperature, without tubes.
        """
        masses, ambient = [], self.conditions.ambient
        for point in (self.design.contracted, self.design.extended):
            volume = self.muscle.volume(point.pressure, point.contraction)
            if volume is None:
                return None
            masses.append(Isothermal().air_mass(absolute_pressure(point.pressure, ambient), volume, ambient))
        return self.total_count * abs(float(masses[0]) - float(masses[1]))

    @property
    def reference_volume(self) -> float | None:
        """Volume of the air of a cycle [m3] at the reference atmosphere of ISO 8778; None without a geometry."""
        return None if self.air is None else self.air / REFERENCE_DENSITY

    @property
    def air_energy(self) -> float | None:
        """Available energy [J] of the air of a cycle at the supply pressure p_s, m R T ln(p_s/p_amb) for isothermal
        expansion; None without a geometry."""
        if self.air is None:
            return None
        ambient = self.conditions.ambient
        ratio = absolute_pressure(self.conditions.supply, ambient) / ambient.pressure
        return self.air * GAS_CONSTANT * ambient.temperature * math.log(ratio)

    @property
    def efficiency(self) -> float | None:
        """Work against the load divided by the available energy of the air [1]; None without a geometry."""
        return None if not self.air_energy else self.requirement.work / self.air_energy

    @property
    def diameter(self) -> float | None:
        """Maximum outer diameter at the contracted end point [m], without the wall; None without a geometry."""
        return self.muscle.diameter(self.design.contracted.contraction)


@dataclasses.dataclass(frozen=True)
class UnsuitableMuscle:
    """A muscle that does not meet a requirement: the number that was tried, 0 for an unusable law, and the reason."""

    name: str
    count: int
    reason: str


SortKey = Callable[[MuscleChoice], float | None]
"""Criterion of a ranking: the smaller the better; a choice without a value is last."""


by_air: SortKey = operator.attrgetter("air")
"""Air of a cycle [kg]."""
by_length: SortKey = operator.attrgetter("length")
"""Nominal length [m]."""
by_count: SortKey = operator.attrgetter("total_count")
"""Number of all muscles."""
by_diameter: SortKey = operator.attrgetter("diameter")
"""Maximum outer diameter [m]."""


def by_reserve(choice: MuscleChoice) -> float:
    """Force reserve, largest first."""
    return -choice.design.reserve


SORT_KEYS: Mapping[str, SortKey] = MappingProxyType({
    "air": by_air, "length": by_length, "count": by_count, "reserve": by_reserve, "diameter": by_diameter,
})  # fmt: skip
"""The criteria by their names."""


def rank(choices: list[MuscleChoice], sort: SortKey) -> tuple[MuscleChoice, ...]:
    """The choices by a criterion, equal ones by length, then by number and name. Raises ParameterError."""
    if not callable(sort):
        raise ParameterError(f"sort is {sort!r}; it must be a function of a choice, such as by_air or by_length.")

    def order(choice: MuscleChoice) -> tuple[float, float, int, str]:
        value = sort(choice)
        return (math.inf if value is None else value, choice.length, choice.count, choice.entry.name)

    return tuple(sorted(choices, key=order))
