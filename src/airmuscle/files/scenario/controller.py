"""Table [input.controller] of a scenario: controller, sample time and set point of a closed loop.

[input]
hold = [["0 s", 1]]                         inputs that the controller does not command, as in an open loop
[input.controller]
model = "PID"                               a controller and its parameters, in any unit that fits its signals
measured = "pressure"                       controlled variable: a state or output of the plant
commanded = "fill"                          an input; or { model = "SplitRange", positive = "fill", negative = "vent" }
gain = "0.4 1/bar"
integral_time = "300 ms"
sample_time = "5 ms"
[input.controller.setpoint]               input signal of the set point: rows, model, file, columns, period
pressure = [["0 s", "1 bar"], ["2 s", "3 bar"]]
[input.drivers]                           as in an open loop

Laws inside a law, such as those of a Cascade, are read by law_table.py.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...core.errors import ParameterError
from ...core.system import Input
from ...engine.loop.control_loop import ControlLoop
from ...engine.loop.controller import Controller, named_signal_units, parameter_units
from ...engine.loop.inputs import InputSignal
from ...engine.state import column_units
from ...physics.plant.plant import Plant
from ..library.location import Location, located_errors, read_finite_number
from .inputs import build_drivers, build_input_signal
from .law_table import build_law

LOOP_KEYS = ("sample_time", "setpoint")
"""Keys of the table that are not parameters of the controller."""


def signal_units(plant: Plant, start: Mapping[str, float]) -> dict[str, str]:
    """Units of the states, outputs and inputs of a plant, in the order of the columns of a run; '' if unknown."""
    outputs = list(plant.outputs(start, dict.fromkeys(plant.inputs, 0.0)))
    units = column_units(plant, outputs)
    return {name: units[name] for name in (*(s.name for s in plant.states), *outputs, *plant.inputs)}


def build_control_loop(
    table: Mapping[str, Any], plant: Plant, units: Mapping[str, str], location: Location
) -> ControlLoop:
    """The control loop of a table [input] with a controller; `units` are those of `signal_units`.

    Raises ParameterError, UnitError, UnknownNameError, FileError or ColumnError with the location.
    """
    inner, controller_table = location.inside("controller"), table["controller"]
    if not isinstance(controller_table, Mapping):
        raise ParameterError(
            f'{inner} is {controller_table!r}; it must be a table. Write model = "PID", its parameters, '
            "sample_time and setpoint in it."
        )
    parameter_table = {key: value for key, value in controller_table.items() if key not in LOOP_KEYS}
    controller = build_law(parameter_table, plant, units, inner)
    for key, example in (("sample_time", 'sample_time = "10 ms"'), ("setpoint", f"[{inner.table}.setpoint]")):
        if key not in controller_table:
            raise ParameterError(f"{inner}: '{key}' is missing; write {example}.")
    other_inputs = {key: value for key, value in table.items() if key not in ("controller", "drivers")}
    sample_time = read_finite_number(controller_table["sample_time"], "s", f"{inner}, sample_time")
    setpoint = _build_setpoint(controller_table["setpoint"], controller, units, inner.inside("setpoint"))
    other_signal = build_input_signal(other_inputs, plant.input_variables, location)
    drivers = build_drivers(table.get("drivers", {}), plant.inputs, location.inside("drivers"))
    with located_errors(inner):
        loop = ControlLoop(controller, sample_time, setpoint, other_signal, drivers)
        loop.check_columns([name for name in units if name not in plant.inputs], plant.inputs)
    return loop


def _build_setpoint(table: Any, controller: Controller, units: Mapping[str, str], location: Location) -> InputSignal:
    names: Sequence[str] = controller.setpoints
    if not isinstance(table, Mapping):
        raise ParameterError(f'{location} is {table!r}; it must be a table. Write {names[0]} = [["0 s", ...]] in it.')
    if "drivers" in table:
        raise ParameterError(f"{location}: a set point has no drivers; write [input.drivers] for those of the inputs.")
    known = {**named_signal_units(controller), **{name: unit for name, unit in units.items() if unit}}
    setpoints = [Input(name, known.get(name) or "1", -math.inf, math.inf) for name in names]
    return build_input_signal(table, setpoints, location, "the controller has no set point")


def controller_number_paths(
    table: Mapping[str, Any], loop: ControlLoop, units: Mapping[str, str]
) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Key paths of all numbers that the table [input.controller] may contain, with their units, for studies."""
    for path, unit in parameter_units(loop.controller, units).items():
        keys = path_keys(path)
        if _has_table(table, keys[:-1]):
            yield keys, unit
    yield ("sample_time",), "s"
    known = {**named_signal_units(loop.controller), **units}
    for name, rows in table["setpoint"].items():
        for i in range(len(rows)) if isinstance(rows, list) else ():
            yield ("setpoint", name, i, 0), "s"
            yield ("setpoint", name, i, 1), known.get(name) or "1"


def path_keys(path: str) -> tuple[str | int, ...]:
    """The keys of a parameter path: `laws[0].gain` is laws, 0, gain."""
    return tuple(int(part) if part.isdecimal() else part for part in re.findall(r"[^.\[\]]+", path))


def _has_table(table: Any, keys: Sequence[str | int]) -> bool:
    """Whether a table contains a table or a list under these keys; a number of a muscle that is named has none."""
    for key in keys:
        known = isinstance(table, Mapping) and key in table
        if not known and not (isinstance(table, list) and isinstance(key, int) and key < len(table)):
            return False
        table = table[key]
    return isinstance(table, Mapping | list)
