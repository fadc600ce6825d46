"""Tasks of the studio: sheets of laws, plants and sizings from the library or from a text of a
user, within limits.

Files in the library folder may refer to other files. A text over the network must not, because it
would read files of the machine of the server.
"""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import airmuscle as am

from ...bench.readers.tables.file_kind import parse_toml
from ...core import AirmuscleError, Array, ParameterError, is_known_unit
from ...design.sizing.scenario import sizing_scenario
from ...files.library import Location, is_path, list_plants, plant_tables, read_toml
from ...files.library.loading import build_entry, check_describes_law, load_law
from ...physics.muscle.characteristic.validity_range import validity_range_of
from ...physics.muscle.isobars import compute_isobars
from ...report.data import as_sheet, csv_text
from ..requests import KINDS, SizeRequest, build, form_fields, options_of
from .law_sheet import identifier_of, law_sheet
from .plant_sheet import sheet_of_plant, sheet_of_tables
from .security import table_of

MAX_TEXT = 64 * 1024
"""Largest size of a muscle or scenario file [bytes] (chosen)."""
FILE_KEYS = ("file", "mapping")
"""Keys whose value is a path."""
TEXT_KEYS = ("title", "provenance", "note", "warning", "source", "sources", "reference")
"""Keys of texts that are shown and not read as names."""
UPLOADED = Location("muscle.toml", "", Path())
"""The location of a text of a user in messages."""


def sheet_of_law(name: str) -> dict[str, Any]:
    """The sheet of a muscle or a law, by its name in the library or by its path."""
    return law_sheet(load_law(name))


def sheet_of_library_plant(name: str) -> dict[str, Any]:
    """The sheet of a plant of the library, by its complete name."""
    return sheet_of_plant(*plant_tables(name), name)


def warm_up() -> None:
    """Import what the sheets need, so that the first one is as fast as the next ones."""
    sheet_of_law("tondu-lopez")
    sheet_of_library_plant("lift-dmsp-20")


def sheet_of_scenario_text(text: str) -> dict[str, Any]:
    """The sheet of a scenario of a user."""
    tables = read_text_tables(text)
    if "plant" not in tables:
        raise ParameterError(
            "the text contains no [plant]; a scenario for airmuscle simulate is required."
        )
    return sheet_of_tables(tables, Location("scenario.toml", "", Path()), "own scenario", {}, text)


def sheet_of_any(name: str) -> dict[str, Any]:
    """The sheet of a muscle, a law or a plant by its name, or of a muscle file or a scenario by its
    path.
    """
    if name in list_plants():
        return sheet_of_library_plant(name)
    path = Path(name)
    tables = read_toml(path) if is_path(name) else {}
    if "plant" in tables:
        return sheet_of_tables(
            tables, Location(str(path), "", path.parent), path.stem, {}, path.read_text("utf-8-sig")
        )
    sheet = sheet_of_law(name)
    return {**sheet, "own_text": sheet["toml"]["unchanged"]} if is_path(name) else sheet


def sheet_of_law_text(text: str) -> dict[str, Any]:
    """The sheet of a muscle file of a user. Raises ParameterError for another kind of file."""
    tables = read_text_tables(text)
    check_describes_law(tables, "the text")
    return {
        **law_sheet(dataclasses.replace(build_entry(tables, UPLOADED), name="own muscle")),
        "own_text": text,
    }


def read_text_tables(text: str) -> dict[str, Any]:
    """The tables of a TOML text that refers to no file. Raises FileError or ParameterError."""
    tables = parse_toml(text.removeprefix("\ufeff"), "the text")
    check_self_contained(tables)
    return tables


def check_self_contained(value: Any, path: str = "") -> None:
    """Raise ParameterError if tables refer to a file; names of the library are allowed."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            inner = f"{path}.{key}" if path else key
            if key in FILE_KEYS:
                raise _refusal(inner)
            if key not in TEXT_KEYS:
                check_self_contained(item, inner)
    elif isinstance(value, list):
        for i, item in enumerate(value):
            check_self_contained(item, f"{path}[{i}]")
    elif isinstance(value, str) and is_path(value) and not _is_quantity(value):
        raise _refusal(path)


def _refusal(path: str) -> ParameterError:
    return ParameterError(
        f"{path[:200]}: a text in the studio must not refer to files; write the numbers themselves,"
        " or a name of the library. The command line reads files that refer to others."
    )


def _is_quantity(text: str) -> bool:
    number, _, unit = text.strip().partition(" ")
    try:
        float(number)
    except ValueError:
        return False
    return is_known_unit(unit.strip())


# Sizings: ranked muscles for a lift or a joint with their charts and scenarios, for the tab Size

OMITTED = ("count", "muscle")
"""Fields of the command that the page does not have."""
FIELDS = tuple(option.name for option in options_of(SizeRequest) if option.name not in OMITTED)
"""Fields of the page; each is a text as a user types it, and may be empty where it is optional."""
MAX_CHOICES = 30
MAX_FIELD = 60
POINTS = 81
"""Maximum number of choices that the page receives, maximum length of a field, and points of a
curve (chosen).
"""


def size_form() -> dict[str, Any]:
    """The fields of the form of the page: those of each kind of requirement, and of all."""
    fields = {
        option["name"]: option
        for option in form_fields(SizeRequest)
        if option["name"] not in OMITTED
    }
    of_kinds = {name for names in KINDS.values() for name in names}
    return {
        **{kind: [fields[name] for name in names] for kind, names in KINDS.items()},
        "all": [option for name, option in fields.items() if name not in of_kinds],
    }


def size_sheet(text: str) -> dict[str, Any]:
    """The sheet of a request in JSON. Raises InputError, or SolveError with what is reachable."""
    stated = read_request(text)
    request = build(SizeRequest, stated, lambda name: name.replace("_", " "))
    result = request.evaluate()
    chapter = result.chapter(sizing_scenario(result.best, "in the page"))
    sheet: dict[str, Any] = {
        "tab": "size",
        "name": "sizing",
        "provenance": "the library",
        "request": stated,
        "form": size_form(),
        "own_text": text,
        **as_sheet(chapter),
        "title": result.requirement.describe(),
        "csv": "\n".join(csv_text(table) for table in chapter.tables[1:3]),
        "choices": [_choice(choice) for choice in result.choices[:MAX_CHOICES]],
        "left_out": max(0, len(result.choices) - MAX_CHOICES),
    }
    return {**sheet, "id": identifier_of(sheet), "script": '"use strict";\n'}


def read_request(text: str) -> dict[str, str]:
    """The fields of a request. Raises ParameterError for another form."""
    stated = table_of(text, ParameterError)
    if set(stated) - set(FIELDS):
        raise ParameterError(f"the request must have the fields {', '.join(FIELDS)} and no others.")
    if not all(isinstance(value, str) and len(value) <= MAX_FIELD for value in stated.values()):
        raise ParameterError(
            f"the fields of the request must be texts of at most {MAX_FIELD} characters."
        )
    return {name: stated.get(name, "").strip() for name in FIELDS}


def _choice(choice: am.design.MuscleChoice) -> dict[str, Any]:
    """A choice with its scenario, or the reason why it has none, and its chart: isobars of one
    muscle, its capacity, the load and both end points; contractions as ratios, forces in N."""
    try:
        scenario = am.design.scenario_text(choice)
        reason = ""
    except AirmuscleError as error:
        scenario = ""
        reason = str(error.message)
    entry = choice.entry
    muscle = choice.muscle
    design = choice.design
    radius = choice.design.radius
    of_radius = "" if radius is None else f", pulley radius {1e3 * radius:.4g} mm"
    label = f"{choice.total_count} × {choice.product}, {1e3 * choice.length:.4g} mm{of_radius}"
    curves = compute_isobars(
        entry.characteristic, validity_range_of(entry.characteristic, entry.validity_range)
    )
    grid = np.linspace(*muscle.contraction_range, POINTS)
    points = [point._asdict() for point in (design.extended, design.contracted)]
    shown = None
    if isinstance(choice.requirement, am.design.PullRequirement):
        displacement, load = choice.requirement.path
        contractions = design.extended.contraction + displacement / choice.length
        shown = {
            "contractions": _rounded(contractions),
            "forces": _rounded(load / choice.count),
            "factor": choice.conditions.safety_factor,
        }
    chart = {
        "pressures": curves.pressures.tolist(),
        "contractions": _rounded(curves.contractions),
        "forces": [_rounded(row) for row in curves.forces],
        "capacity": {"contractions": _rounded(grid), "forces": _rounded(muscle.capacity(grid))},
        "points": [{key: float(value) for key, value in point.items()} for point in points],
        "load": shown,
    }
    return {
        "name": entry.name,
        "label": label,
        "chart": chart,
        "scenario": scenario,
        "reason": reason,
    }


def _rounded(values: Array) -> list[float | None]:
    """Numbers for a chart: seven digits, None where there is no value."""
    return [
        float(f"{value:.7g}") if np.isfinite(value) else None
        for value in np.asarray(values, dtype=float)
    ]
