"""The table [command.controller] of a scenario: what closes a loop, how often it looks, and what it is to follow.

[command]
hold = [["0 s", 1]]                         inputs that the controller does not command, as without one
[command.controller]
model = "PID"                               a controller and its parameters, in any unit that fits where it stands
measured = "pressure"                       a state or output of the plant
commanded = "fill"                          an input; or { model = "SplitRange", positive = "fill", negative = "discharge" }
gain = "0.4 1/bar"
integral_time = "300 ms"
period = "5 ms"                             from one sample to the next
[command.controller.setpoint]               a command of its own: rows, model, file, columns, period
pressure = [["0 s", "1 bar"], ["2 s", "3 bar"]]
[command.drivers]                           as without a controller
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
from ..library.location import Location, check_type, read_finite_number, located_errors, read_number
from ..library.models import model_class, model_names
from ..plant.columns import units_of
from ..plant.plant import Plant
from .inputs import build_input_signal, build_drivers

LOOP_KEYS = ("period", "setpoint")
"""Keys of the table that are no parameters of the controller."""


def signal_units(plant: Plant, start: Mapping[str, float]) -> dict[str, str]:
    """The units of the states, outputs and inputs that a run of a plant has in columns; '' where none is known."""
    outputs = list(plant.outputs(start, dict.fromkeys(plant.inputs, 0.0)))
    units = units_of(plant, outputs)
    return {name: units[name] for name in (*(s.name for s in plant.states), *outputs, *plant.inputs)}


def build_control_loop(
    table: Mapping[str, Any], plant: Plant, units: Mapping[str, str], place: Location
) -> ControlLoop:
    """The loop that the table [command] with a controller describes; `units` are those of `units_around`.

    Raises ParameterError, UnitError, UnknownName, FileError or ColumnError.
    """
    at, given = place.inside("controller"), table["controller"]
    if not isinstance(given, Mapping):
        raise ParameterError(f'{at} is {given!r}; write model = "PID", its parameters, period and setpoint under it.')
    controller = _controller({k: v for k, v in given.items() if k not in LOOP_KEYS}, plant.inputs, units, at)
    for key, example in (("period", 'period = "10 ms"'), ("setpoint", f"[{at.table}.setpoint]")):
        if key not in given:
            raise ParameterError(f"{at}: '{key}' is missing; write {example}.")
    beside = {key: value for key, value in table.items() if key not in ("controller", "drivers")}
    period = read_finite_number(given["period"], "s", f"{at}, period")
    setpoint = _setpoint(given["setpoint"], controller, units, at.inside("setpoint"))
    others = build_input_signal(beside, plant.commands, place)
    drivers = build_drivers(table.get("drivers", {}), plant.inputs, place.inside("drivers"))
    with located_errors(at):
        loop = ControlLoop(controller, period, setpoint, others, drivers)
        loop.check_columns([name for name in units if name not in plant.inputs], plant.inputs)
    return loop


def _controller(
    table: Mapping[str, Any], inputs: Sequence[str], units: Mapping[str, str], place: Location
) -> Controller:
    """The controller. Built twice: what it measures and commands says in which units its other numbers are."""
    relative: dict[str, Parameter] = {}
    if isinstance(table.get("model"), str):
        cls = model_class(table["model"], f"{place}, model")
        if not issubclass(cls, Controller):
            known = [n for n in model_names() if issubclass(model_class(n, ""), Controller)]
            raise ParameterError(f"{place}: {cls.__name__} is no controller; there are {', '.join(known)}.")
        relative = {p.name: p for p in parameters(cls) if p.unit in RELATIVE and p.name in table}
    draft: Controller = check_type(build({**table, **dict.fromkeys(relative, 1.0)}, place), Controller, place)
    with located_errors(place):
        check_present(draft, [name for name in units if name not in inputs], inputs)
    if relative and len({units[name] for name in draft.inputs}) > 1:
        raise ParameterError(f"{place}: {' and '.join(draft.inputs)} have different units; name inputs of one kind.")
    numbers = {
        name: read_number(table[name], _unit(p, draft, units), f"{place}, {name}", f" ({p.symbol}, {p.meaning})")
        for name, p in relative.items()
    }
    found: Controller = build({**table, **numbers}, place)
    return found


def _unit(declared: Parameter, controller: Controller, units: Mapping[str, str]) -> str:
    """The unit of a controller's parameter where it stands; "1" takes the place of one that is not known."""
    y, u = (units.get(names[0]) or "1" for names in (controller.measured_columns, controller.inputs))
    return relative_unit(declared.unit, y, u)


def _setpoint(given: Any, controller: Controller, units: Mapping[str, str], place: Location) -> InputSignal:
    names: Sequence[str] = controller.setpoints
    if not isinstance(given, Mapping):
        raise ParameterError(f'{place} is {given!r}; write {names[0]} = [["0 s", ...]] under it.')
    if "drivers" in given:
        raise ParameterError(f"{place}: a set point has no drivers; write [command.drivers] for those of the inputs.")
    followed = [Input(name, units.get(name) or "1", -math.inf, math.inf) for name in names]
    return build_input_signal(given, followed, place, "the controller has no set point")


def controller_number_paths(
    table: Mapping[str, Any], loop: ControlLoop, units: Mapping[str, str]
) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Where in the table [command.controller] numbers stand or may stand, and the unit of each, for studies."""
    for p in parameters(loop.controller):
        yield (p.name,), _unit(p, loop.controller, units)
    yield ("period",), "s"
    for name, rows in table["setpoint"].items():
        for i in range(len(rows)) if isinstance(rows, list) else ():
            yield ("setpoint", name, i, 0), "s"
            yield ("setpoint", name, i, 1), units.get(name) or "1"
