"""Plant of Hošovský et al.: printed values, values measured elsewhere, and chosen values."""

import dataclasses
import functools
from collections.abc import Iterator
from typing import Any

import airmuscle as am

from ..core import CHOSEN, published
from ..files.library import load_data
from ..report.formatting import format_number, format_quantity, typographic

PAPER = "hosovsky"
FORCE_MAPS = ("dmsp-20-300", "festo-tool-dmsp-20")
"""Data of the contractile surface, which the paper does not print: a measured force map and the
sizing-tool table.
"""

MATRIX = am.Valve(2.6167e-9, 0.433)
"""MATRIX EMX821.104C224: b = 0.433 and the digits of C are printed; the exponent e-9 is lost in our
copy.
"""
REFERENCE_PRESSURE = 100e3
"""Pressure P0 of the reference atmosphere of ISO 8778 [Pa]."""
VOLUME_FLOW_RATIO = REFERENCE_PRESSURE / (
    am.physics.GAS_CONSTANT * am.physics.REFERENCE_TEMPERATURE * am.physics.REFERENCE_DENSITY
)
"""Ratio P0/(R T0 rho0) of the pressure rates by the volume flow of equation (11) and by the mass
flow of ISO 6358 [1].

The density rho0 of ISO 8778 is that of humid air and R that of dry air, so that R T0 rho0 = 99 716
Pa."""
MATRIX_BY_VOLUME = dataclasses.replace(MATRIX, conductance=MATRIX.conductance * VOLUME_FLOW_RATIO)
"""The valve as equation (11) takes its volume flow: as air whose density is P0/(R T0)."""
SUPPLY_PRESSURE = 650e3 - 101_325.0
"""The step of 650 kPa, assumed to be absolute (inferred from the sensor range of 0 to 0.6 MPa);
gauge [Pa].
"""
RELEASED_MASS = 30.0
"""Load of the quick release [kg], printed."""
SCHEDULE = am.Schedule({"fill": ((5.0, 1.0), (15.0, 0.0)), "discharge": ((19.0, 1.0), (25.0, 0.0))})
"""Schedule of Fig. 3, printed: the fill valve opens at 5 s and closes at 15 s, the discharge valve
at 19 s and 25 s.
"""
DURATION = 25.0
"""Duration of the experiment of Fig. 3 [s]."""
FILLING = (5.0, 15.0)
DISCHARGING = (19.0, 25.0)
"""Beginning and end of both phases of Fig. 3 [s]."""

MATRIX_CATALOGUE = published("matrix-821")


@dataclasses.dataclass(frozen=True)
class Choice:
    """A parameter that the paper does not print: value, range for the verdicts, unit, meaning and
    source.
    """

    value: float
    low: float
    high: float
    unit: str
    meaning: str
    source: str = CHOSEN


@dataclasses.dataclass(frozen=True)
class UnpublishedParameters:
    """All parameters of the simulated figures that the paper does not print."""

    load: Choice = Choice(10.0, 2.0, 20.0, "kg", "load during fill and discharge")
    stiffness: Choice = Choice(
        1000.0, 0.0, 4000.0, "N/m", "parallel spring, constant as in the paper"
    )
    damping: Choice = Choice(200.0, 100.0, 400.0, "N s/m", "damper, constant as in the paper")
    length: Choice = Choice(
        0.300, 0.200, 0.400, "m", "resting length", "measured specimen; range chosen"
    )
    braid_angle: Choice = Choice(
        0.42616,
        0.38,
        0.50,
        "rad",
        "braid angle, for the volume",
        "Martens and Boblan 2017; range chosen",
    )
    low_pressure: Choice = Choice(
        200e3, 150e3, 250e3, "Pa", "lower initial gauge pressure of the release"
    )
    high_pressure: Choice = Choice(
        400e3, 350e3, 500e3, "Pa", "higher initial gauge pressure of the release"
    )

    def with_value(self, name: str, value: float) -> "UnpublishedParameters":
        """Return the parameters with another value of one of them."""
        return dataclasses.replace(
            self, **{name: dataclasses.replace(getattr(self, name), value=value)}
        )


def chosen_values(parameters: Any) -> dict[str, Choice]:
    """Return the chosen values of a dataclass by their names."""
    return {field.name: getattr(parameters, field.name) for field in dataclasses.fields(parameters)}


def chosen_rows(parameters: Any) -> Iterator[tuple[str, str, str]]:
    """Return (meaning, value with unit and range, source) of every chosen value of a dataclass for
    the report.
    """
    for each in chosen_values(parameters).values():
        low, high = (typographic(format_number(end)) for end in (each.low, each.high))
        yield (
            each.meaning,
            f"{format_quantity(each.value, each.unit)} (range {low} to {high})",
            each.source,
        )


@functools.cache
def surface_fit(data: str = FORCE_MAPS[0]) -> am.Fit:
    """Return the fit of the 21 coefficients to a force map of the library; rows clamped at zero
    force are censored.
    """
    return am.fit(am.characteristic.ContractileSurface.blank(5, max_force=1e5), load_data(data))


def surface(data: str = FORCE_MAPS[0]) -> am.characteristic.ContractileSurface:
    """Return the fitted surface, limited to 0 to 1200 N by the force compensator of the paper."""
    fitted = surface_fit(data).model
    assert isinstance(fitted, am.characteristic.ContractileSurface)
    return dataclasses.replace(fitted, max_force=1200.0)


def muscle(parameters: UnpublishedParameters, data: str = FORCE_MAPS[0]) -> am.Muscle:
    """Return the Hill muscle of equation (1)."""
    braid = am.geometry.Braid(0.010, parameters.braid_angle.value, parameters.length.value)
    spring = am.LinearSpring(parameters.stiffness.value)
    damper = am.LinearDamper(parameters.damping.value)
    return am.Muscle(surface(data), braid, spring, damper)


def plant(
    parameters: UnpublishedParameters,
    mechanism: am.Mechanism,
    *,
    gas: am.physics.Gas = am.Isothermal(),
    valve: am.physics.Orifice = MATRIX,
    tube: am.physics.TubeModel | None = None,
    data: str = FORCE_MAPS[0],
    **elements: Any,
) -> am.Plant:
    """Return the plant of the paper, isothermal and without a line; `elements` replace spring, wall
    or series.
    """
    valves = am.FillDischarge(am.Supply(SUPPLY_PRESSURE), valve, valve)
    actuator = dataclasses.replace(muscle(parameters, data), **elements)
    circuit = valves if tube is None else am.physics.WithTubes(valves, tube)
    return am.Plant(actuator, circuit, mechanism, gas, am.Ambient())


def hanging_load(parameters: UnpublishedParameters) -> am.HangingMass:
    """Return the load during fill and discharge."""
    return am.HangingMass(parameters.load.value)


def latched_load() -> am.WithLatch:
    """Return the latched load of the quick release."""
    return am.WithLatch(am.HangingMass(RELEASED_MASS))
