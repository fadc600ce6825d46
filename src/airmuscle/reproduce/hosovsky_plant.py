"""The plant of the third paper: what is printed, what is measured elsewhere, and what had to be chosen."""

from __future__ import annotations

import dataclasses
import functools

from ..characteristic.contractile_surface import ContractileSurface
from ..core.reference import CHOSEN, Reference
from ..geometry.braid import Braid
from ..identify import Fit, fit
from ..library import catalogue
from ..mechanism import HangingMass, Held, Mechanism
from ..muscle import LinearDamper, LinearSpring, Muscle, RigidWall, Spring, Wall
from ..plant.plant import Plant
from ..pneumatics import FillDischarge, Orifice, Supply, TubeModel, Valve, WithTubes
from ..pneumatics.gas import Ambient, Gas, Isothermal

PAPER = "hosovsky"
FORCE_MAPS = ("dmsp-20-300", "festo-tool-dmsp-20")
"""Where the contractile surface comes from, as the paper does not print it: measured, and second the tool table."""

MATRIX = Valve(2.6167e-9, 0.433)
"""MATRIX EMX821.104C224: b = 0.433 and the digits of C are printed; the exponent e-9 is lost in our copy."""
SUPPLY_PRESSURE = 650e3 - 101_325.0
"""The 650 kPa step, taken as absolute (inferred from the sensor's range of 0..0.6 MPa); gauge [Pa]."""
RELEASED_MASS = 30.0
"""Load of the quick release [kg], printed."""

MATRIX_CATALOGUE = Reference(
    "matrix-821",
    "MATRIX",
    "Solenoid valves series 820",
    "as quoted by Hosovsky et al.",
    note="EMX821.104C224, 3-position 2-way on/off with closed centre; C = 2.6167e-9 m3/(s Pa), b = 0.433",
)


@dataclasses.dataclass(frozen=True)
class ChosenValue:
    """A number that the paper does not print: what was taken, its range for the verdicts, and why."""

    value: float
    low: float
    high: float
    unit: str
    meaning: str
    source: str = CHOSEN


@dataclasses.dataclass(frozen=True)
class UnpublishedParameters:
    """Every number behind the figures of this paper that it does not print."""

    load: ChosenValue = ChosenValue(10.0, 2.0, 20.0, "kg", "load in fill and discharge")
    stiffness: ChosenValue = ChosenValue(1000.0, 0.0, 4000.0, "N/m", "parallel spring, constant as in the paper")
    damping: ChosenValue = ChosenValue(200.0, 100.0, 400.0, "N s/m", "damper, constant as in the paper")
    length: ChosenValue = ChosenValue(
        0.300, 0.200, 0.400, "m", "resting length", "of the measured specimen; the range is chosen"
    )
    braid_angle: ChosenValue = ChosenValue(
        0.42616, 0.38, 0.50, "rad", "braid angle of the volume", "Martens and Boblan 2017; the range is chosen"
    )
    low_pressure: ChosenValue = ChosenValue(200e3, 150e3, 250e3, "Pa", "lower initial pressure of the release, gauge")
    high_pressure: ChosenValue = ChosenValue(400e3, 350e3, 500e3, "Pa", "higher initial pressure of the release, gauge")

    def with_value(self, name: str, value: float) -> UnpublishedParameters:
        """The numbers with one of them at another value."""
        return dataclasses.replace(self, **{name: dataclasses.replace(getattr(self, name), value=value)})

    def range_ends(self) -> tuple[tuple[str, float], ...]:
        """Each number at both ends of its range, one at a time."""
        ranges = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        return tuple((name, end) for name, n in ranges.items() for end in (n.low, n.high))

    def as_rows(self) -> tuple[tuple[str, str, str], ...]:
        """What, value with range and unit, source: as the report lists them."""
        ranges = [getattr(self, field.name) for field in dataclasses.fields(self)]
        return tuple((n.meaning, f"{n.value:g} {n.unit} (range {n.low:g} to {n.high:g})", n.source) for n in ranges)


@functools.cache
def surface_fit(data: str = FORCE_MAPS[0]) -> Fit:
    """The 21 coefficients fitted to a force map of the library; rows clamped at zero force are censored."""
    return fit(ContractileSurface.blank(5, max_force=1e5), catalogue.load_data(data))


def surface(data: str = FORCE_MAPS[0]) -> ContractileSurface:
    """The fitted surface under the force compensator of the paper, 0..1200 N."""
    found = surface_fit(data).model
    assert isinstance(found, ContractileSurface)
    return dataclasses.replace(found, max_force=1200.0)


def muscle(numbers: UnpublishedParameters, data: str = FORCE_MAPS[0], spring: Spring | None = None) -> Muscle:
    """The Hill muscle of equation (1)."""
    braid = Braid(0.010, numbers.braid_angle.value, numbers.length.value)
    return Muscle(
        surface(data), braid, spring or LinearSpring(numbers.stiffness.value), LinearDamper(numbers.damping.value)
    )


def plant(
    numbers: UnpublishedParameters,
    mechanism: Mechanism,
    *,
    gas: Gas | None = None,
    spring: Spring | None = None,
    wall: Wall | None = None,
    valve: Orifice = MATRIX,
    tube: TubeModel | None = None,
    data: str = FORCE_MAPS[0],
) -> Plant:
    """Muscle, two valves with closed centre, load and gas; isothermal, no line, a rigid wall as in the paper."""
    valves = FillDischarge(Supply(SUPPLY_PRESSURE), valve, valve)
    fed = dataclasses.replace(muscle(numbers, data, spring), wall=wall or RigidWall())
    circuit = valves if tube is None else WithTubes(valves, tube)
    return Plant(fed, circuit, mechanism, gas or Isothermal(), Ambient())


def hanging_load(numbers: UnpublishedParameters) -> HangingMass:
    """The load of the fill and discharge."""
    return HangingMass(numbers.load.value)


def latched_load() -> Held:
    """The load of the quick release behind its latch."""
    return Held(HangingMass(RELEASED_MASS))
