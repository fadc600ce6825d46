"""The catalogue of valves: what data sheets and papers print of real valves, by name, and valve files of the user.

    title = "..."                   what it is, and which of its paths
    provenance = "data sheet"       how the numbers came here
    [valve]                         the law and its parameters; a path to the muscle where the two paths differ
    [exhaust]                       optional: the path to the surroundings, where its figures differ
    [response]                      optional: opening_delay, closing_delay, as published
    [[check]]                       published flows that the law must give
    [[reference]]                   the sources

`load_valve("matrix-821")` gives a ValveEntry; in a scenario, `fill = { library = "matrix-821" }`, and
`discharge = { library = "ckd-m4ga1-r", path = "exhaust" }` for the other path.
"""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..core.declaration import model, parameter, parameters
from ..core.errors import AirmuscleWarning, ParameterError, UnknownNameError, suggestion
from ..core.reference import Reference
from ..core.units import ABSOLUTE
from ..pneumatics.gas import REFERENCE_DENSITY, REFERENCE_TEMPERATURE
from ..pneumatics.orifice import Orifice
from .build import build
from .catalogue import complete_name, read_toml
from .entry import Check
from .location import Location, check_keys, check_type, read_finite_number, located_errors, read_text
from .read import read_references, read_table_array

FOLDER = Path(__file__).parent / "valves"
PATHS = ("valve", "exhaust")
"""The paths through a valve that a file may describe; the first is the usual one."""
_TEXTS = ("title", "provenance", "note", "warning")
_CHECK = {"upstream": ABSOLUTE, "downstream": ABSOLUTE, "flow": "m3/s", "tolerance": "m3/s"}


@model
class SwitchingTimes:
    """How long a valve takes to answer its command, as published; a sheet may give an upper limit, "10 ms or less"."""

    opening_delay: float = parameter("s", "t_on", "time from the command to open until it is open", bounds=(0.0, 1.0))
    closing_delay: float = parameter("s", "t_off", "time from the command to shut until it is shut", bounds=(0.0, 1.0))


@dataclasses.dataclass(frozen=True)
class ValveEntry:
    """One valve of the catalogue as it was read, all numbers SI.

    `provenance` says how the numbers came here, `note` what was published and how it was converted. A check is a published
    volume flow [m3/s at the reference atmosphere] between two absolute pressures.
    """

    name: str
    title: str
    provenance: str
    valve: Orifice
    exhaust: Orifice | None = None
    switching_times: SwitchingTimes | None = None
    note: str = ""
    warning: str = ""
    checks: tuple[Check, ...] = ()
    references: tuple[Reference, ...] = ()

    def orifice(self, path: str) -> Orifice:
        """The law of a path, "valve" or "exhaust". Raises UnknownName where the entry has no such path."""
        found = getattr(self, path, None) if path in PATHS else None
        if found is None:
            there = ", ".join(p for p in PATHS if getattr(self, p) is not None)
            raise UnknownNameError(
                f"{self.name} has no path '{path}'; there are {there}.{suggestion(str(path), PATHS)}"
            )
        law: Orifice = found
        return law

    def flow(self, upstream: float, downstream: float) -> float:
        """Volume flow [m3/s at the reference atmosphere] between absolute pressures [Pa], open, air at 293.15 K."""
        return float(self.valve.mass_flow(upstream, downstream, 1.0, REFERENCE_TEMPERATURE) / REFERENCE_DENSITY)


def list_valves() -> tuple[str, ...]:
    """The names of all valves of the catalogue, sorted."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


def load_valve(name_or_path: str | Path) -> ValveEntry:
    """A valve by its name or a unique beginning of it, or a valve file by its path.

    Raises UnknownName, FileError, ParameterError or UnitError, saying where; an entry that carries a warning
    issues it as an AirmuscleWarning.
    """
    as_text = str(name_or_path)
    is_path = isinstance(name_or_path, Path) or as_text.endswith(".toml")
    path = Path(name_or_path) if is_path else FOLDER / f"{complete_name(as_text, list_valves(), 'valve')}.toml"
    entry = build_valve_entry(read_toml(path), path.stem, path if is_path else Path(path.name))
    if entry.warning:
        warnings.warn(f"{entry.name}: {entry.warning}", AirmuscleWarning, stacklevel=2)
    return entry


def build_valve_entry(tables: Mapping[str, Any], name: str, file: Path) -> ValveEntry:
    """The valve that a parsed file describes; messages name `file`."""
    place = Location(str(file), "", file.parent)
    check_keys(tables, (*_TEXTS, *PATHS, "response", "check", "reference"), place)
    if "valve" not in tables:
        raise ParameterError(f"{place}: the table [valve] is missing; it says which flow law and its parameters.")
    texts: dict[str, Any] = {
        key: read_text(tables, key, place, needed=key in ("title", "provenance")) for key in _TEXTS
    }
    paths = {key: _orifice(tables[key], place.inside(key)) for key in PATHS if key in tables}
    return ValveEntry(
        name=name,
        **texts,
        **paths,
        switching_times=_response(tables["response"], place.inside("response")) if "response" in tables else None,
        checks=tuple(_check(t, p) for t, p in read_table_array(tables, "check", place)),
        references=read_references(tables, place),
    )


def _orifice(table: Any, place: Location) -> Any:
    return check_type(build(table, place), Orifice, place)


def _response(table: Any, place: Location) -> SwitchingTimes:
    if not isinstance(table, Mapping):
        raise ParameterError(f'{place}: {table!r} is no table; write opening_delay = "10 ms" under [response].')
    names = tuple(p.name for p in parameters(SwitchingTimes))
    check_keys(table, names, place)
    for name in names:
        if name not in table:
            raise ParameterError(f"{place}: '{name}' is missing; a response has {' and '.join(names)}.")
    with located_errors(place):
        return SwitchingTimes(**{name: read_finite_number(table[name], "s", f"{place}, {name}") for name in names})


def _check(table: Mapping[str, Any], place: Location) -> Check:
    check_keys(table, (*_CHECK, "source"), place)
    for key, unit in _CHECK.items():
        if key not in table:
            raise ParameterError(f"{place}: '{key}' is missing; it is a number in {unit}, or text with a unit.")
    values = {key: read_finite_number(table[key], unit, f"{place}, {key}") for key, unit in _CHECK.items()}
    given = (("upstream", values["upstream"]), ("downstream", values["downstream"]))
    return Check("flow", given, values["flow"], values["tolerance"], read_text(table, "source", place, needed=True))
