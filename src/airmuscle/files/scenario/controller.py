"""Table [input.controller] of a scenario: controller, sample time and set point of a closed loop;
docs/guides/control.md.

Laws inside laws, sensors and models of the plant are tables at any depth. Numbers are SI or texts
with a unit that fits the signals of the law in whose table they are. Muscles and mechanism of a
static inverse are those of the plant unless the table gives others, in the form of [plant].
"""

import dataclasses
import functools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ...core import Input, Parameter, ParameterError, abridged, is_known_unit, parameters
from ...core.annotation_parts import alternatives, arguments_of, origin, type_hints
from ...engine.loop import ControlLoop, check_input_names, check_present
from ...engine.loop.controller import (
    RELATIVE,
    Controller,
    SignalRelated,
    named_signal_units,
    parameter_units,
    unit_of,
)
from ...physics import Mechanism, Muscle, Plant
from ...recording.columns import column_units
from ..library import (
    PLANT_READER,
    Location,
    custom_field,
    located_errors,
    read_parameter,
    read_table,
)
from ..library.build import build
from .values import Number, build_input_signal, read_drivers


def build_law(
    table: Any, plant: Plant, units: Mapping[str, str], location: Location, sample_time: float
) -> Controller:
    """The controller of a table, with the laws inside it; `units` are those of the signals of the
    plant by name. The table is read twice: the first time without its numbers, to find the signals
    that determine their units.
    """

    def built(known: Mapping[str, str] | None) -> Controller:
        reader = dataclasses.replace(PLANT_READER, signals=PlantSignals(plant, sample_time, known))
        controller: Controller = reader.build(table, location, kind=Controller)
        return controller

    outline = built(None)
    with located_errors(location):
        check_present(outline, [name for name in units if name not in plant.inputs], plant.inputs)
        named = named_signal_units(outline)
    return built({**named, **{name: unit or named.get(name, "") for name, unit in units.items()}})


@dataclasses.dataclass(frozen=True)
class PlantSignals:
    """Signals of a plant with their units; without units, of the models that depend on them no
    numbers are read.
    """

    plant: Plant
    sample_time: float
    units: Mapping[str, str] | None

    def concerns(self, cls: type[Any]) -> bool:
        """Whether a class has numbers in units of signals, or muscles or a mechanism, which are
        those of the plant.
        """
        hints = type_hints(cls).values()
        return issubclass(cls, SignalRelated) or any(
            _has(h, kind) for h in hints for kind in (Muscle, Mechanism)
        )

    def parts(self, cls: type[Any], hints: Mapping[str, Any]) -> dict[str, Any]:
        """Muscles and mechanism of the plant, itself and the sample time, for the fields that need
        them.
        """
        plant_parts = {
            tuple[Muscle, ...]: self.plant.muscles,
            Mechanism: self.plant.mechanism,
            Plant: self.plant,
        }
        return {name: plant_parts.get(hints[name], self.sample_time) for name in plant_fields(cls)}

    def make(
        self,
        cls: type[Any],
        parts: Mapping[str, Any],
        numbers: Mapping[str, Any],
        location: Location,
    ) -> Any:
        """The model of a class; its numbers are read in the units of the signals that its parts
        name.
        """
        outline = object.__new__(cls)  # not validated: numbers are defaults or 0
        for field in dataclasses.fields(cls):
            default = 0.0 if field.default is dataclasses.MISSING else field.default
            object.__setattr__(outline, field.name, parts.get(field.name, default))
        if self.units is None:
            return outline
        hints = type_hints(cls)
        declared = {p.name: p for p in parameters(cls)}
        read = {
            n: self._number(v, declared[n], hints[n], outline, location) for n, v in numbers.items()
        }
        with located_errors(location):
            return cls(**parts, **read)

    def _number(
        self, value: Any, declared: Parameter, hint: Any, outline: Any, location: Location
    ) -> Any:
        """A declared parameter in SI units, read in the units of the signals of its law."""
        units = self.units or {}
        if isinstance(outline, Controller) and declared.unit in RELATIVE:
            names = outline.inputs
            if len({units.get(name) for name in names}) > 1:
                named = " and ".join(names)
                raise ParameterError(
                    f"{location}: {named} have different units; choose inputs of the same unit."
                )
        if not isinstance(value, list) or origin(hint) is not tuple:
            return _read(
                value, declared, self._unit(value, declared, 0, outline, location), hint, location
            )
        return tuple(
            _read(
                item,
                dataclasses.replace(declared, name=f"{declared.name}[{i}]"),
                self._unit(item, declared, i, outline, location),
                float,
                location,
            )
            for i, item in enumerate(value)
        )

    def _unit(
        self, value: Any, declared: Parameter, index: int, outline: Any, location: Location
    ) -> str:
        """The unit of a parameter; "1" for a number without a unit where that of a signal is not
        known.
        """
        try:
            with located_errors(location):
                return unit_of(outline, declared, index, self.units or {})
        except KeyError as error:
            if isinstance(value, str):
                raise ParameterError(
                    f"{location.at(declared.name)} is {abridged(value)}; the unit of the signal"
                    f" {error} is not known, because it is no column or input of the plant. Correct"
                    " the name, or give a number in SI units."
                ) from None
            return "1"


def _read(value: Any, declared: Parameter, unit: str, hint: Any, location: Location) -> Any:
    """A number or a column of a file; a unit that depends on no signal is no unit of a text."""
    if isinstance(value, str) and not is_known_unit(unit):
        raise ParameterError(
            f"{location.at(declared.name)} is {abridged(value)}; it must be a number in SI units,"
            f" without a unit ({declared.symbol}, {declared.meaning})."
        )
    return read_parameter(value, dataclasses.replace(declared, unit=unit), hint, location)


def plant_fields(cls: type[Any]) -> tuple[str, ...]:
    """The fields of a model that are those of the plant where a table does not give them."""
    hints = type_hints(cls)
    known = (tuple[Muscle, ...], Mechanism, Plant)
    if not {tuple[Muscle, ...], Plant} & set(hints.values()):
        return ()
    return tuple(
        f.name for f in dataclasses.fields(cls) if hints[f.name] in known or f.name == "sample_time"
    )


def _has(hint: Any, kind: type[Any]) -> bool:
    for option in alternatives(hint):
        if option is kind or any(_has(part, kind) for part in arguments_of(option)):
            return True
    return False


@dataclasses.dataclass(frozen=True)
class LoopTable:
    """Keys of the table of a controller that are not its parameters."""

    sample_time: float = custom_field(
        Number("s", positive=True), 'sample time, such as sample_time = "10 ms"'
    )
    setpoint: Mapping[str, Any] = custom_field(
        functools.partial(
            read_table, remedy=' of set points, such as pressure = [["0 s", "1 bar"]]'
        ),
        "set point, the table [input.controller.setpoint]",
    )


LOOP_KEYS = tuple(field.name for field in dataclasses.fields(LoopTable))


def signal_units(plant: Plant, start: Mapping[str, float]) -> dict[str, str]:
    """Units of the states, outputs and inputs of a plant, in the order of the columns of a run; ''
    if unknown.
    """
    outputs = list(plant.outputs(start, dict.fromkeys(plant.inputs, 0.0)))
    units = column_units(plant, outputs)
    return {
        name: units[name] for name in (*(s.name for s in plant.states), *outputs, *plant.inputs)
    }


def build_control_loop(
    table: Mapping[str, Any], plant: Plant, units: Mapping[str, str], location: Location
) -> ControlLoop:
    """The control loop of a table [input] with a controller; `units` are those of
    `signal_units`.
    """
    inner = location.inside("controller")
    remedy = '. Write model = "PID", its parameters, sample_time and setpoint'
    controller_table = read_table(table["controller"], plant, inner, f"{remedy} in it")
    law_table = {key: value for key, value in controller_table.items() if key not in LOOP_KEYS}
    stated = {key: value for key, value in controller_table.items() if key in LOOP_KEYS}
    keys: LoopTable = build(stated, inner, kind=LoopTable)
    controller = build_law(law_table, plant, units, inner, keys.sample_time)
    place = inner.inside("setpoint")
    if "drivers" in keys.setpoint:
        raise ParameterError(
            f"{place}: a set point has no drivers; write [input.drivers] for those of the inputs."
        )
    known = {
        **named_signal_units(controller),
        **{name: unit for name, unit in units.items() if unit},
    }
    setpoints = [
        Input(name, known.get(name) or "1", -math.inf, math.inf) for name in controller.setpoints
    ]
    setpoint = build_input_signal(
        keys.setpoint, setpoints, place, "the controller has no set point"
    )
    other_inputs = {
        key: value for key, value in table.items() if key not in ("controller", "drivers")
    }
    other_signal = build_input_signal(other_inputs, plant.input_variables, location)
    drivers = read_drivers(table.get("drivers", {}), plant, location.at("drivers"))
    with located_errors(location.inside("drivers")):
        check_input_names(list(drivers), plant.inputs)
    with located_errors(inner):
        loop = ControlLoop(controller, keys.sample_time, setpoint, other_signal, drivers)
        loop.check_columns([name for name in units if name not in plant.inputs], plant.inputs)
    return loop


def controller_number_paths(
    table: Mapping[str, Any], loop: ControlLoop, units: Mapping[str, str]
) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Key paths of all numbers that the table [input.controller] may contain, with their units, for
    studies.
    """
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
    """Whether a table contains a table or a list under these keys; a number of a muscle that is
    named has none.
    """
    for key in keys:
        known = isinstance(table, Mapping) and key in table
        if not known and not (
            isinstance(table, list) and isinstance(key, int) and key < len(table)
        ):
            return False
        table = table[key]
    return isinstance(table, Mapping | list)
