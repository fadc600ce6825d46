"""The table [command.controller] of a scenario: what closes a loop, how often it looks, and what it is to follow.

[command]
hold = [["0 s", 1]]                         inputs that the controller does not command, as without one
[command.controller]
model = "PID"                               a controller and its parameters, in any unit that fits where it stands
measured = "pressure"                       a state or output of the plant
commanded = "fill"                          an input; or { model = "Split", positive = "fill", negative = "discharge" }
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

from ..command import Command
from ..controller import RELATIVE, Controller, relative_unit
from ..declare import parameters
from ..errors import ParameterError, suggestion
from ..loop import Loop
from ..plant import Plant
from ..recorded import units_of
from ..variables import Input
from .build import build
from .command_table import command_from, drivers_from
from .models import model_class, model_names
from .place import Place, checked, finite, number, said_at

KEYS = ("period", "setpoint")
"""Keys of the table that are no parameters of the controller."""


def units_around(plant: Plant, start: Mapping[str, float]) -> dict[str, str]:
    """The units of everything that a run of a plant has in columns; '' where none is known."""
    return units_of(plant, list(plant.outputs(start, dict.fromkeys(plant.inputs, 0.0))))


def loop_from(table: Mapping[str, Any], plant: Plant, units: Mapping[str, str], place: Place) -> Loop:
    """The loop that the table [command] with a controller describes; `units` are those of `units_around`.

    Raises ParameterError, UnitError, UnknownName, FileError or ColumnError.
    """
    at, given = place.inside("controller"), table["controller"]
    if not isinstance(given, Mapping):
        raise ParameterError(f'{at} is {given!r}; write model = "PID", its parameters, period and setpoint under it.')
    controller = _controller({k: v for k, v in given.items() if k not in KEYS}, plant, units, at)
    for key, example in (("period", 'period = "10 ms"'), ("setpoint", f"[{at.table}.setpoint]")):
        if key not in given:
            raise ParameterError(f"{at}: '{key}' is missing; write {example}.")
    beside = {key: value for key, value in table.items() if key not in ("controller", "drivers")}
    period = finite(given["period"], "s", f"{at}, period")
    setpoint = _setpoint(given["setpoint"], controller, units, at.inside("setpoint"))
    others = command_from(beside, plant.commands, place)
    drivers = drivers_from(table.get("drivers", {}), plant.inputs, place.inside("drivers"))
    with said_at(at):
        loop = Loop(controller, period, setpoint, others, drivers)
        loop.refuse_misfit([name for name in units if name not in plant.inputs], plant.inputs)
    return loop


def _controller(
    table: Mapping[str, Any], plant: Plant, units: Mapping[str, str], place: Place
) -> Controller:  # fmt: skip
    """The controller; its numbers in units that follow from what it measures and commands become SI here."""
    if isinstance(table.get("model"), str):
        cls = model_class(table["model"], f"{place}, model")
        if not issubclass(cls, Controller):
            known = [n for n in model_names() if issubclass(model_class(n, ""), Controller)]
            raise ParameterError(f"{place}: {cls.__name__} is no controller; there are {', '.join(known)}.")
        y, u = _units_beside(table, plant, units, place)
        relative = {p.name: p for p in parameters(cls) if p.unit in RELATIVE and p.name in table}
        table = dict(table)
        for name, p in relative.items():
            unit, about = relative_unit(p.unit, y, u), f" ({p.symbol}, {p.meaning})"
            table[name] = number(table[name], unit, f"{place}, {name}", about)
    found: Controller = checked(build(table, place), Controller, place)
    return found


def _units_beside(
    table: Mapping[str, Any], plant: Plant, units: Mapping[str, str], place: Place
) -> tuple[str, str]:  # fmt: skip
    """The units of the measured column and of the commanded input; "1" where none is known."""
    measured, commanded = table.get("measured"), table.get("commanded")
    sides = [i for key, i in commanded.items() if key != "model"] if isinstance(commanded, Mapping) else [commanded]
    inputs = [i for i in sides if isinstance(i, str)]
    columns = [name for name in units if name not in plant.inputs]
    of_measured = ("measured", "column", [measured], columns)
    for key, kind, given, known in (of_measured, ("commanded", "input", inputs, plant.inputs)):
        for name in given:
            if isinstance(name, str) and name not in known:
                raise ParameterError(
                    f"{place}, {key}: the plant has no {kind} '{name}'; there are {', '.join(known) or 'none'}."
                    f"{suggestion(name, known)}"
                )
    different = {units[name] for name in inputs}
    if len(different) > 1:
        raise ParameterError(f"{place}, commanded: {' and '.join(inputs)} have different units; name two of one kind.")
    return units.get(measured, "") if isinstance(measured, str) else "", "".join(different)


def _setpoint(given: Any, controller: Controller, units: Mapping[str, str], place: Place) -> Command:
    names: Sequence[str] = controller.setpoints
    if not isinstance(given, Mapping):
        raise ParameterError(f'{place} is {given!r}; write {names[0]} = [["0 s", ...]] under it.')
    if "drivers" in given:
        raise ParameterError(f"{place}: a set point has no drivers; write [command.drivers] for those of the inputs.")
    followed = [Input(name, units.get(name) or "1", -math.inf, math.inf) for name in names]
    return command_from(given, followed, place, "the controller has no set point")


def numbers_of(
    table: Mapping[str, Any], loop: Loop, units: Mapping[str, str]
) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Where in the table [command.controller] numbers stand or may stand, and the unit of each, for studies."""
    y, u = units.get(loop.controller.columns[0]) or "1", units.get(loop.controller.inputs[0]) or "1"
    for p in parameters(loop.controller):
        yield (p.name,), relative_unit(p.unit, y, u)
    yield ("period",), "s"
    for name, rows in table["setpoint"].items():
        for i in range(len(rows)) if isinstance(rows, list) else ():
            yield ("setpoint", name, i, 0), "s"
            yield ("setpoint", name, i, 1), units.get(name) or "1"
