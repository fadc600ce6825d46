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

import dataclasses
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...core.annotation import abridged
from ...core.errors import ParameterError
from ...core.system import Input
from ...engine.loop.control_loop import ControlLoop
from ...engine.loop.controller import Controller, named_signal_units, parameter_units
from ...engine.loop.inputs import InputSignal, check_input_names
from ...engine.state import column_units
from ...physics.plant.plant import Plant
from ..library.build import build
from ..library.fields import custom_field
from ..library.location import Location, located_errors
from .inputs import build_input_signal, read_drivers
from .law_table import build_law
from .values import Number


def _read_setpoint(value: Any, plant: Any, where: Location) -> Mapping[str, Any]:
    """The table of the set points, which `build_control_loop` reads."""
    if not isinstance(value, Mapping):
        example = 'pressure = [["0 s", "1 bar"]]'
        raise ParameterError(f"{where} is {abridged(value)}; it must be a table of set points, such as {example}.")
    return value


@dataclasses.dataclass(frozen=True)
class LoopTable:
    """Keys of the table of a controller that are not its parameters."""

    sample_time: float = custom_field(Number("s", positive=True), 'sample time, such as sample_time = "10 ms"')
    setpoint: Mapping[str, Any] = custom_field(_read_setpoint, "set point, the table [input.controller.setpoint]")


LOOP_KEYS = tuple(field.name for field in dataclasses.fields(LoopTable))


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
            f'{inner} is {abridged(controller_table)}; it must be a table. Write model = "PID", its parameters, '
            "sample_time and setpoint in it."
        )
    own = {key: value for key, value in controller_table.items() if key not in LOOP_KEYS}
    controller = build_law(own, plant, units, inner)
    stated = {key: value for key, value in controller_table.items() if key in LOOP_KEYS}
    keys: LoopTable = build(stated, inner, kind=LoopTable)
    setpoint = _build_setpoint(keys.setpoint, controller, units, inner.inside("setpoint"))
    other_inputs = {key: value for key, value in table.items() if key not in ("controller", "drivers")}
    other_signal = build_input_signal(other_inputs, plant.input_variables, location)
    drivers = read_drivers(table.get("drivers", {}), plant, location.at("drivers"))
    with located_errors(location.inside("drivers")):
        check_input_names(list(drivers), plant.inputs)
    with located_errors(inner):
        loop = ControlLoop(controller, keys.sample_time, setpoint, other_signal, drivers)
        loop.check_columns([name for name in units if name not in plant.inputs], plant.inputs)
    return loop


def _build_setpoint(
    table: Mapping[str, Any], controller: Controller, units: Mapping[str, str], location: Location
) -> InputSignal:
    if "drivers" in table:
        raise ParameterError(f"{location}: a set point has no drivers; write [input.drivers] for those of the inputs.")
    known = {**named_signal_units(controller), **{name: unit for name, unit in units.items() if unit}}
    setpoints = [Input(name, known.get(name) or "1", -math.inf, math.inf) for name in controller.setpoints]
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
