"""Initial state of a run or a record: gauge pressures of the muscles, and values of other states by
name.

initial_state = { pressure = "2 bar" }                                   equilibrium with all
    muscles at this pressure
initial_state = { "left.pressure" = "1 bar", "right.pressure" = "3 bar" }   equilibrium with each at
    its own
initial_state = { pressure = "2 bar", angle = "5 deg" }                  a state at rest that need
    not be an equilibrium
"""

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from ...bench.dynamics import InitialConditions
from ...core import EquilibriumError, HintedText, ParameterError
from ...physics import Coordinate, Plant
from ...physics.equilibrium import nearest_equilibrium
from ...recording import Recording
from ..library.files import Location, check_keys, located_errors, read_finite_number, read_table

PRESSURE = "pressure"
"""Key of the gauge pressure of all muscles whose own pressure is not stated."""
FIRST_ROWS = 3
"""Number of first rows whose median is the default initial value of a record (chosen)."""
LOOSE = 1e-3
"""Part of its nominal value by which a coordinate is moved to see whether anything holds it
(chosen).
"""
read_initial_table = functools.partial(
    read_table, remedy='. Write initial_state = { pressure = "0 bar" }'
)
"""Reader of the table `initial_state`, which `build_initial_state` reads."""
START_REMEDY = (
    ' In [run], initial_state = { pressure = "2 bar" } is the equilibrium at another pressure, and '
    '{ position = "0 mm" } a state at rest that need not be one; a load that rests on a stop is a '
    "mechanism within WithEndStops."
)
"""What to do where a scenario begins in an equilibrium that does not exist."""


def pressure_names(plant: Plant) -> tuple[str, ...]:
    """Names of the gauge pressures of the muscles."""
    return tuple(f"{prefix}{PRESSURE}" for prefix in plant.prefixes)


def read_initial_values(
    table: Mapping[str, Any], plant: Plant, location: Location
) -> tuple[dict[str, float], dict[str, float]]:
    """The stated gauge pressures of the muscles [Pa], and the values of other states [SI], by
    name.
    """
    names = pressure_names(plant)
    units = {PRESSURE: "Pa", **dict.fromkeys(names, "Pa")}
    units |= {s.name: s.unit for s in plant.states if not s.name.endswith("air_mass")}
    check_keys(table, tuple(units), location)
    values = {
        key: read_finite_number(value, units[key], f"{location}, {key}")
        for key, value in table.items()
    }
    pressures = dict.fromkeys(names, values[PRESSURE]) if PRESSURE in values else {}
    pressures |= {name: values[name] for name in names if name in values}
    return pressures, {
        name: value for name, value in values.items() if name not in (PRESSURE, *names)
    }


def build_initial_state(
    table: Mapping[str, Any], plant: Plant, location: Location, equilibrium: dict[str, float] | None
) -> dict[str, float]:
    """The initial state of a run; `equilibrium` replaces the computed one. Raises ParameterError or
    UnitError.
    """
    all_states = {state.name: state.unit for state in plant.states}
    if set(table) == set(all_states):
        return {
            name: read_finite_number(table[name], unit, f"{location}, {name}")
            for name, unit in all_states.items()
        }
    stated, values = read_initial_values(table, plant, location)
    pressures = _complete(stated or dict.fromkeys(pressure_names(plant), 0.0), plant, location)
    with located_errors(location):
        if values:
            return plant.state_at(pressure=pressures, **values)
        try:
            return (
                nearest_equilibrium(plant, pressure=tuple(pressures))
                if equilibrium is None
                else equilibrium
            )
        except EquilibriumError as error:
            raise EquilibriumError(HintedText(error.message, START_REMEDY)) from None


def build_initial_conditions(
    table: Mapping[str, Any], plant: Plant, recording: Recording, location: Location
) -> InitialConditions:
    """The initial conditions of a record: what the table states, else the first rows of the
    recorded pressures.

    A lone muscle without a recorded pressure begins at ambient pressure.
    Without a stated value of another state it is the equilibrium at these pressures; where there is
    none, or slack muscles leave the plant at rest in any position, the recorded coordinates of the
    first rows. Raises ParameterError, UnitError or EquilibriumError with the location.
    """
    stated, values = read_initial_values(table, plant, location)
    ambient = {PRESSURE: 0.0} if len(plant.muscles) == 1 else {}
    pressures = _complete(
        {**ambient, **recorded_pressures(plant, recording), **stated}, plant, location
    )
    names = [c.name for c in plant.mechanism.coordinates]
    with located_errors(location):
        if values:
            return InitialConditions.at_coordinates(plant, pressures, **values)
        try:
            at_rest = InitialConditions.at_rest(plant, pressures)
            if (loose := _loose_coordinate(plant, pressures, at_rest.guess)) is None:
                return at_rest
            raise EquilibriumError(
                f"at these pressures every {loose.name} near {at_rest.guess[loose.name]:.3g}"
                f" {loose.unit} is an equilibrium: no muscle pulls. Record the {loose.name}, or"
                " state it in initial_state."
            )
        except EquilibriumError:
            if not all(name in recording for name in names):
                raise
            measured = {name: first_value(recording, name) for name in names}
            return InitialConditions.at_coordinates(plant, pressures, **measured)


def _loose_coordinate(
    plant: Plant, pressures: list[float], state: Mapping[str, float]
) -> Coordinate | None:
    """A coordinate of which no acceleration depends in either direction; None if there is none."""
    coordinates = plant.mechanism.coordinates
    still = dict.fromkeys(plant.inputs, 0.0)
    for c in coordinates:
        moved = [
            {
                coordinate.name: state[coordinate.name] + part * c.nominal * (coordinate is c)
                for coordinate in coordinates
            }
            for part in (-LOOSE, 0.0, LOOSE)
        ]
        rates = [plant.rates(plant.state_at(pressure=pressures, **place), still) for place in moved]
        if all(
            rate[coordinate.speed] == rates[0][coordinate.speed]
            for rate in rates
            for coordinate in coordinates
        ):
            return c
    return None


def first_value(recording: Recording, name: str) -> float:
    """The median of the first finite rows of a column [SI]. Raises ParameterError where there is
    none.
    """
    finite = recording[name][np.isfinite(recording[name])]
    if not finite.size:
        raise ParameterError(
            f"{recording.origin}: the column {name} has no value; state it in initial_state."
        )
    return float(np.median(finite[:FIRST_ROWS]))


def recorded_pressures(plant: Plant, recording: Recording) -> dict[str, float]:
    """The initial pressures [Pa] of the muscles whose pressure, or that of their tube, is
    recorded.
    """
    columns = [name for name in recording if name.rpartition(".")[2] == PRESSURE]
    pressures = {}
    for prefix in plant.prefixes:
        muscle = f"{prefix}{PRESSURE}"
        if muscle_columns := [name for name in columns if name.startswith(prefix)]:
            pressures[muscle] = first_value(
                recording, muscle if muscle in muscle_columns else muscle_columns[0]
            )
    return pressures


def _complete(pressures: Mapping[str, float], plant: Plant, location: Location) -> list[float]:
    """The pressures in the order of the muscles. Raises ParameterError for one that is missing."""
    missing = [name for name in pressure_names(plant) if name not in pressures]
    if missing:
        raise ParameterError(
            f"{location}: the initial value of {', '.join(missing)} is neither stated nor recorded."
            " Write "
            f'"{missing[0]}" = "1 bar" in initial_state.'
        )
    return [pressures[name] for name in pressure_names(plant)]
