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
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ..control.control_loop import ControlLoop, check_present
from ..control.controller import RELATIVE, Controller, relative_unit
from ..control.inputs import InputSignal
from ..core.declaration import Parameter, parameters
from ..core.errors import ParameterError
from ..core.variables import Input
from ..library.build import build
from ..library.location import Location, check_type, located_errors, read_finite_number, read_number
from ..library.models import model_class, model_names
from ..plant.plant import Plant
from ..plant.units import column_units
from .inputs import build_drivers, build_input_signal

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
    controller = _build_controller(parameter_table, plant.inputs, units, inner)
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


def _build_controller(
    table: Mapping[str, Any], inputs: Sequence[str], units: Mapping[str, str], location: Location
) -> Controller:
    """The controller. It is built twice: the first time to find the signals that determine the units of its gains."""
    relative: dict[str, Parameter] = {}
    if isinstance(table.get("model"), str):
        cls = model_class(table["model"], f"{location}, model")
        if not issubclass(cls, Controller):
            known = [n for n in model_names() if issubclass(model_class(n, ""), Controller)]
            raise ParameterError(f"{location}: {cls.__name__} is not a controller; there are {', '.join(known)}.")
        relative = {p.name: p for p in parameters(cls) if p.unit in RELATIVE and p.name in table}
    draft: Controller = check_type(build({**table, **dict.fromkeys(relative, 1.0)}, location), Controller, location)
    with located_errors(location):
        check_present(draft, [name for name in units if name not in inputs], inputs)
    if relative and len({units[name] for name in draft.inputs}) > 1:
        raise ParameterError(
            f"{location}: {' and '.join(draft.inputs)} have different units; choose inputs of the same unit."
        )
    numbers = {
        name: read_number(table[name], _unit(p, draft, units), f"{location}, {name}", f" ({p.symbol}, {p.meaning})")
        for name, p in relative.items()
    }
    controller: Controller = build({**table, **numbers}, location)
    return controller


def _unit(declared: Parameter, controller: Controller, units: Mapping[str, str]) -> str:
    """Unit of a controller parameter for its signals; "1" replaces an unknown unit of a signal."""
    measured, commanded = (units.get(names[0]) or "1" for names in (controller.measured_columns, controller.inputs))
    return relative_unit(declared.unit, measured, commanded)


def _build_setpoint(table: Any, controller: Controller, units: Mapping[str, str], location: Location) -> InputSignal:
    names: Sequence[str] = controller.setpoints
    if not isinstance(table, Mapping):
        raise ParameterError(f'{location} is {table!r}; it must be a table. Write {names[0]} = [["0 s", ...]] in it.')
    if "drivers" in table:
        raise ParameterError(f"{location}: a set point has no drivers; write [input.drivers] for those of the inputs.")
    setpoints = [Input(name, units.get(name) or "1", -math.inf, math.inf) for name in names]
    return build_input_signal(table, setpoints, location, "the controller has no set point")


def controller_number_paths(
    table: Mapping[str, Any], loop: ControlLoop, units: Mapping[str, str]
) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Key paths of all numbers that the table [input.controller] may contain, with their units, for studies."""
    for p in parameters(loop.controller):
        yield (p.name,), _unit(p, loop.controller, units)
    yield ("sample_time",), "s"
    for name, rows in table["setpoint"].items():
        for i in range(len(rows)) if isinstance(rows, list) else ():
            yield ("setpoint", name, i, 0), "s"
            yield ("setpoint", name, i, 1), units.get(name) or "1"
