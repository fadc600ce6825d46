"""A simulation written down as a file: [plant], [command] and [run].

    [plant]
    muscle = "dmsp-20-300"                      a library name or a muscle file; or a table [plant.muscle] with
                                                library = "dmsp-20-300" and what replaces its parts, or all parts
    gas = "Isothermal"                          optional; polytropic otherwise
    [plant.circuit]                             model = "FillDischarge" with supply, fill and discharge
    [plant.mechanism]                           model = "HangingMass", mass = "5 kg"
    [command]
    fill = [["5 s", 1], ["15 s", 0]]            every input of the plant: instants, and the value from then on
    [run]
    duration = "25 s"
    output = "10 ms"                            optional
    start = { pressure = "0 bar" }              optional: rest at this pressure; or a state, position = "10 mm"
    method = { model = "Rodas4", rtol = 1e-8 }  optional

Components are tables with `model` and their parameters; later components need no new grammar.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import units
from ..command import Command
from ..equilibrium import equilibrium
from ..errors import ParameterError, suggestion
from ..method import Method, Rodas4
from ..muscle import Muscle
from ..plant import Plant
from ..recording import Recording
from ..simulate import simulate
from .build import Place, build
from .catalogue import load, parsed
from .models import model_class

_TABLES = ("title", "plant", "command", "run")
_RUN = ("duration", "start_time", "output", "start", "method")


@dataclasses.dataclass(frozen=True)
class Scenario:
    """A plant, what it is commanded, and how long it runs; all numbers SI."""

    title: str
    plant: Plant
    command: Command
    duration: float
    start: dict[str, float]
    start_time: float = 0.0
    output: float | None = None
    method: Method = dataclasses.field(default_factory=Rodas4)

    def simulate(self, *, complete: bool = True) -> Recording:
        """The run as a Recording; see `airmuscle.simulate`."""
        return simulate(
            self.plant,
            self.command,
            duration=self.duration,
            start=self.start,
            start_time=self.start_time,
            method=self.method,
            output=self.output,
            complete=complete,
        )


def load_scenario(path: str | Path) -> Scenario:
    """The scenario in a file. Raises FileError, ParameterError, UnitError or UnknownName, saying where."""
    file = Path(path)
    tables = parsed(file)
    place = Place(str(file), "", file.parent)
    _refuse_unknown(tables, _TABLES, place)
    for key in ("plant", "run"):
        if not isinstance(tables.get(key), Mapping):
            raise ParameterError(f"{place}: the table [{key}] is missing.")
    plant = _plant(tables["plant"], place.inside("plant"))
    run, at = tables["run"], place.inside("run")
    _refuse_unknown(run, _RUN, at)
    if "duration" not in run:
        raise ParameterError(f"{at}: 'duration' is missing; write it like duration = \"25 s\".")
    seconds = {key: _number(run[key], "s", f"{at}, {key}") for key in ("start_time", "output") if key in run}
    method = _object(run["method"], Method, at.inside("method")) if "method" in run else Rodas4()
    return Scenario(
        title=str(tables.get("title", file.stem)),
        plant=plant,
        duration=_number(run["duration"], "s", f"{at}, duration"),
        method=method,
        command=_command(tables.get("command", {}), plant, place.inside("command")),
        start=_start(run.get("start", {"pressure": 0.0}), plant, at.inside("start")),
        **seconds,
    )


def _plant(table: Mapping[str, Any], place: Place) -> Plant:
    muscles = table.get("muscle")
    if muscles is None:
        raise ParameterError(f"{place}: 'muscle' is missing; name a library entry, a file, or write [plant.muscle].")
    many = isinstance(muscles, list)
    found = [_muscle(m, place.inside("muscle")) for m in (muscles if many else [muscles])]
    rest = {"model": "Plant", **{key: value for key, value in table.items() if key != "muscle"}}
    ready = {"muscle": tuple(found) if many else found[0]}
    plant: Plant = _checked(build(rest, place, ready), Plant, place)
    return plant


def _muscle(given: Any, place: Place) -> Any:
    if isinstance(given, Mapping):
        rest = {"model": "Muscle", **given}
        base = rest.pop("library", None)
        ready = {} if base is None else _parts(_muscle(base, place.inside("library")), rest)
        return build(rest, place, ready)
    if not isinstance(given, str):
        raise ParameterError(f"{place} is {given!r}; name a library entry or a muscle file.")
    own = place.folder / given
    return load(own if given.endswith(".toml") else given).muscle


def _parts(muscle: Muscle, replaced: Mapping[str, Any]) -> dict[str, Any]:
    """The parts of a muscle that a table leaves as they are; it is plainly named unless the table says otherwise."""
    names = [f.name for f in dataclasses.fields(Muscle) if f.name not in ("name", *replaced)]
    return {name: getattr(muscle, name) for name in names}


def _command(table: Mapping[str, Any], plant: Plant, place: Place) -> Command:
    name = table.get("model", "Schedule")
    points = {}
    for key, rows in table.items():
        if key == "model":
            continue
        if key not in plant.inputs:
            known = ", ".join(plant.inputs) or "none"
            raise ParameterError(
                f"{place}: the plant has no input '{key}'; there are {known}.{suggestion(key, plant.inputs)}"
            )
        points[key] = tuple(_point(row, f"{place}, {key}") for row in _list(rows, f"{place}, {key}"))
    found: Command = _checked(model_class(name, f"{place}, model")(points), Command, place)
    return found


def _list(rows: Any, where: str) -> list[Any]:
    if not isinstance(rows, list):
        raise ParameterError(f'{where} is {rows!r}; write instants and values, [["5 s", 1], ["15 s", 0]].')
    return rows


def _point(row: Any, where: str) -> tuple[float, float]:
    if not (isinstance(row, list) and len(row) == 2):
        raise ParameterError(f'{where} holds {row!r}; each is an instant and a value, ["5 s", 1].')
    return _number(row[0], "s", where), _number(row[1], "1", where)


def _start(given: Any, plant: Plant, place: Place) -> dict[str, float]:
    if not isinstance(given, Mapping):
        raise ParameterError(f'{place} is {given!r}; write start = {{ pressure = "0 bar" }}.')
    coordinates = {
        name: unit for c in plant.mechanism.coordinates for name, unit in ((c.name, c.unit), (c.speed, "m/s"))
    }
    kinds = {"pressure": "Pa", **coordinates}
    _refuse_unknown(given, tuple(kinds), place)
    values = {key: _number(value, kinds[key], f"{place}, {key}") for key, value in given.items()}
    pressure = values.pop("pressure", 0.0)
    return plant.state_at(pressure=pressure, **values) if values else equilibrium(plant, pressure=pressure)


def _object(given: Any, kind: type[Any], place: Place) -> Any:
    return _checked(build({"model": given} if isinstance(given, str) else given, place), kind, place)


def _checked(found: Any, kind: type[Any], place: Place) -> Any:
    if not isinstance(found, kind):
        raise ParameterError(f"{place}: {type(found).__name__} is no {kind.__name__.lower()}.")
    return found


def _number(value: Any, unit: str, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ParameterError(f"{where} is {value!r}; it must be a number in {unit}, or text with a unit.")
    return units.quantity(value, unit, where=where)


def _refuse_unknown(table: Mapping[str, Any], known: tuple[str, ...], place: Place) -> None:
    for key in table:
        if key not in known:
            raise ParameterError(
                f"{place}: '{key}' is not known here; there are {', '.join(known)}.{suggestion(key, known)}"
            )
