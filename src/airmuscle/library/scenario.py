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
from types import NoneType
from typing import Any

from ..characteristic.base import ForceLaw
from ..command import Command, refuse_unknown_input
from ..equilibrium import equilibrium
from ..errors import ParameterError
from ..method import Method, Rodas4
from ..plant import Plant
from ..recording import Recording
from ..simulate import refuse_beyond_range, simulate
from .build import build
from .catalogue import load, parsed
from .entry import Entry
from .models import model_class
from .place import Place, checked, finite, refuse_unknown, said_at, text

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
    return scenario_from(parsed(file), Place(str(file), "", file.parent))


def scenario_from(tables: Mapping[str, Any], place: Place, plant: Plant | None = None) -> Scenario:
    """The scenario that the tables of a file describe; a `plant` that is given stands for the table [plant]."""
    refuse_unknown(tables, _TABLES, place)
    for key in ("plant", "run"):
        _table(tables.get(key), key, place)
    plant = plant or _plant(tables["plant"], place.inside("plant"))
    run, at = tables["run"], place.inside("run")
    refuse_unknown(run, _RUN, at)
    if "duration" not in run:
        raise ParameterError(f"{at}: 'duration' is missing; write it like duration = \"25 s\".")
    duration, start_time = _length(run, "duration", at), finite(run.get("start_time", 0.0), "s", f"{at}, start_time")
    command = _command(_table(tables.get("command", {}), "command", place), plant, place.inside("command"))
    with said_at(place.inside("command")):
        refuse_beyond_range(plant, command.segments(plant.inputs, start_time, duration), start_time)
    return Scenario(
        title=text(tables, "title", place, needed=False) or Path(place.file).stem,
        plant=plant,
        command=command,
        duration=duration,
        start=_start(run.get("start", {"pressure": 0.0}), plant, at.inside("start")),
        start_time=start_time,
        output=_length(run, "output", at) if "output" in run else None,
        method=_object(run["method"], Method, at.inside("method")) if "method" in run else Rodas4(),
    )


def _table(given: Any, key: str, place: Place) -> Mapping[str, Any]:
    if not isinstance(given, Mapping):
        what = "is missing" if given is None else f"is {given!r}, no table; write [{key}] and its keys under it"
        raise ParameterError(f"{place}: the table [{key}] {what}.")
    return given


def _length(table: Mapping[str, Any], key: str, place: Place) -> float:
    """A length of time [s]."""
    found = finite(table[key], "s", f"{place}, {key}")
    if not found > 0:
        raise ParameterError(f"{place}, {key} is {table[key]!r}; it must be greater than zero.")
    return found


def _plant(table: Mapping[str, Any], place: Place) -> Plant:
    muscles = table.get("muscle")
    if muscles is None:
        raise ParameterError(f"{place}: 'muscle' is missing; name a library entry, a file, or write [plant.muscle].")
    found: Any
    if isinstance(muscles, list):
        found = tuple(_muscle(m, place.inside(f"muscle[{i}]")) for i, m in enumerate(muscles))
    else:
        found = _muscle(muscles, place.inside("muscle"))
    rest = {"model": "Plant", **{key: value for key, value in table.items() if key != "muscle"}}
    plant: Plant = checked(build(rest, place, {"muscle": found}), Plant, place)
    return plant


def _muscle(given: Any, place: Place) -> Any:
    if isinstance(given, Mapping):
        rest = {"model": "Muscle", **given}
        base = rest.pop("library", None)
        return build(rest, place, {} if base is None else _parts(_entry(base, place.inside("library")), rest, place))
    entry = _entry(given, place)
    with said_at(place):
        return entry.muscle


def _entry(given: Any, place: Place) -> Entry:
    if not isinstance(given, str):
        raise ParameterError(f"{place} is {given!r}; name a library entry or a muscle file.")
    with said_at(place):
        return load(place.folder / given if given.endswith(".toml") else given)


def _parts(entry: Entry, replaced: Mapping[str, Any], place: Place) -> dict[str, Any]:
    """The parts of an entry that a table leaves as they are; what it lacks, such as a geometry, the table may give."""
    parts = {"contractile": entry.characteristic, **{n: getattr(entry, n) for n in ("geometry", "spring", "damper")}}
    left = {name: part for name, part in parts.items() if part is not None and name not in replaced}
    if not isinstance(left.get("contractile"), ForceLaw | NoneType):
        raise ParameterError(
            f"{place}: {entry.name} is {type(entry.characteristic).__name__}, which is not solved for the force; "
            "a plant needs a ForceLaw. In Python, as_force_law(law, box) makes one."
        )
    return left


def _command(table: Mapping[str, Any], plant: Plant, place: Place) -> Command:
    rows = {key: value for key, value in table.items() if key != "model"}
    with said_at(place):
        refuse_unknown_input(list(rows), plant.inputs)
    points = {
        key: tuple(_point(row, f"{place}, {key}") for row in _list(given, f"{place}, {key}"))
        for key, given in rows.items()
    }
    kind = model_class(table.get("model", "Schedule"), f"{place}, model")
    if not issubclass(kind, Command):
        raise ParameterError(f"{place}: {kind.__name__} is no command.")
    with said_at(place):
        return kind(points)  # type: ignore[call-arg]  # every command that a file can name is made of its points


def _list(rows: Any, where: str) -> list[Any]:
    if not isinstance(rows, list):
        raise ParameterError(f'{where} is {rows!r}; write instants and values, [["5 s", 1], ["15 s", 0]].')
    return rows


def _point(row: Any, where: str) -> tuple[float, float]:
    if not (isinstance(row, list) and len(row) == 2):
        raise ParameterError(f'{where} holds {row!r}; each is an instant and a value, ["5 s", 1].')
    return finite(row[0], "s", where), finite(row[1], "1", where)


def _start(given: Any, plant: Plant, place: Place) -> dict[str, float]:
    if not isinstance(given, Mapping):
        raise ParameterError(f'{place} is {given!r}; write start = {{ pressure = "0 bar" }}.')
    coordinates = {
        name: unit for c in plant.mechanism.coordinates for name, unit in ((c.name, c.unit), (c.speed, f"{c.unit}/s"))
    }
    kinds = {"pressure": "Pa", **coordinates}
    refuse_unknown(given, tuple(kinds), place)
    values = {key: finite(value, kinds[key], f"{place}, {key}") for key, value in given.items()}
    pressure = values.pop("pressure", 0.0)
    with said_at(place):
        return plant.state_at(pressure=pressure, **values) if values else equilibrium(plant, pressure=pressure)


def _object(given: Any, kind: type[Any], place: Place) -> Any:
    return checked(build({"model": given} if isinstance(given, str) else given, place), kind, place)
