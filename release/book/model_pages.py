"""Pages of the models: one for each class that a file may name, and one index for each package."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import math
import re
from collections.abc import Iterable, Iterator
from typing import Any

from airmuscle.core.annotation import describe, type_hints
from airmuscle.core.declaration import Parameter, parameters
from airmuscle.core.reference import Reference
from airmuscle.files import load
from airmuscle.files.library import files
from airmuscle.files.library.entry import Entry
from airmuscle.files.library.fields import PACKAGES, model_class, model_names
from airmuscle.physics import Characteristic, ContractionLaw, ForceLaw, PressureLaw

from .docstrings import docstring, parts, symbol, to_markdown
from .formulas_in_text import escape, markdown
from .tables import table

ROOMS = {
    "characteristic": "Static characteristics",
    "geometry": "Geometries",
    "friction": "Friction laws",
    "muscle": "Elements of a muscle",
    "pneumatics": "Air, valves, tubes and circuits",
    "mechanism": "Mechanisms",
    "laws": "Controllers",
    "estimation": "Controllers of a linearised plant",
    "loop": "Sensors, drivers and interfaces of controllers",
    "plant": "Plant",
    "run": "Integrators",
}
"""Packages of the models, in the order of the pages, with their titles."""
DIRECTIONS = {"force": "tension", "contraction": "contraction", "pressure": "pressure"}


@functools.cache
def rooms() -> dict[str, list[type[Any]]]:
    """The model classes of each package, by name."""
    packages = {package.__name__.rpartition(".")[2]: package for package in PACKAGES}
    classes = [model_class(name, "documentation") for name in model_names()]
    return {
        room: sorted(
            (c for c in classes if c.__name__ in packages[room].__all__), key=lambda c: c.__name__
        )
        for room in ROOMS
    }


def pages(pictures: Iterable[str] = ()) -> Iterator[tuple[str, str]]:
    """(path without suffix, text) of all pages; `pictures` are the classes with a file
    models/images/NAME.svg.
    """
    drawn = frozenset(pictures)
    yield "models/index", overview()
    for room, classes in rooms().items():
        yield f"models/{room}/index", room_page(room, classes)
        for cls in classes:
            yield f"models/{room}/{cls.__name__}", model_page(cls, room, cls.__name__ in drawn)


def overview() -> str:
    """The index of all models."""
    lines = [
        "# Models\n",
        (
            "Every model that a library or scenario file may name, with its formula, parameters,"
            " bounds and references. The pages are generated from the declarations in the code."
            " Values are in SI units; files and the command line also accept texts with a unit.\n"
        ),
    ]
    for room, classes in rooms().items():
        lines.append(f"* [{ROOMS[room]}]({room}/index.md): {len(classes)} models")
    tree = "\n".join(f"{room}/index" for room in ROOMS)
    return "\n".join([*lines, "", f"```{{toctree}}\n:hidden:\n\n{tree}\n```", ""])


def first_sentence(cls: type[Any]) -> str:
    """The summary of a model in one line, with its formula if it is short."""
    text = " ".join(parts(docstring(cls)).summary.split())
    name = re.match(r"[^=]*?[\w)](?=: )", text)
    return markdown(text) if len(text) <= 120 or name is None else f"{markdown(name[0])}."


def face_of(room: str) -> str:
    """The face from which users import the models of a package: a room, or a collection of the
    muscle's parts.
    """
    if room in ("characteristic", "geometry", "friction"):
        return f"airmuscle.{room}"
    package = next(package for package in PACKAGES if package.__name__.endswith(f".{room}"))
    return package.__name__.rpartition(".")[0]


def room_page(room: str, classes: list[type[Any]]) -> str:
    """The index of the models of a package."""
    rows = [(f"[{cls.__name__}]({cls.__name__}.md)", first_sentence(cls)) for cls in classes]
    tree = "\n".join(cls.__name__ for cls in classes)
    head = f"# {ROOMS[room]}\n\nModels of `{face_of(room)}`.\n"
    return (
        f"{head}\n{table(('model', 'definition'), rows)}\n```{{toctree}}\n:hidden:\n\n{tree}\n```\n"
    )


def model_page(cls: type[Any], room: str, drawn: bool) -> str:
    """The page of one model."""
    declared = parameters(cls) if dataclasses.is_dataclass(cls) else ()
    name = cls.__name__
    sections = [
        f"# {name}\n",
        f"`{face_of(room)}.{name}` · [all {ROOMS[room][0].lower() + ROOMS[room][1:]}](index.md)\n",
        to_markdown(docstring(cls), _letters(declared), omit_references=bool(_references(cls))),
        picture(cls) if drawn else "",
        parameter_section(declared),
        component_section(cls),
        property_section(cls),
        library_section(cls),
        reference_section(_references(cls)),
    ]
    return "\n".join(section for section in sections if section)


def _letters(declared: Iterable[Parameter]) -> set[str]:
    return {p.symbol for p in declared if len(p.symbol) == 1} - {"A", "I"}


def picture(cls: type[Any]) -> str:
    """The figure of a model."""
    return f"![{cls.__name__}, drawn by the program](../images/{cls.__name__}.svg)\n"


def bounds_text(low: float, high: float) -> str:
    """Bounds as text; empty if there are none."""
    if math.isinf(low) and math.isinf(high):
        return ""
    return f"{low:g} to {high:g}"


def default_text(value: Any) -> str:
    """The default of a field as text; empty if there is none."""
    if value is dataclasses.MISSING or value is inspect.Parameter.empty:
        return ""
    if isinstance(value, float | int) and not isinstance(value, bool):
        return f"{value:g}"
    return f"`{value!r}`" if len(repr(value)) < 60 else f"`{type(value).__name__}(...)`"


def parameter_section(declared: Iterable[Parameter]) -> str:
    """Table of the declared parameters."""
    fields = list(declared)
    if not fields:
        return ""
    rows = [
        (
            symbol(p.symbol),
            f"`{p.name}`",
            escape(p.unit),
            bounds_text(*p.bounds),
            default_text(
                p.default if p.default is not dataclasses.MISSING else inspect.Parameter.empty
            ),
            escape(p.meaning) + ("" if p.fitted else " (not fitted by default)"),
        )
        for p in fields
    ]
    return "## Parameters\n\n" + table(
        ("symbol", "name", "unit", "allowed", "default", "meaning"), rows
    )


def component_section(cls: type[Any]) -> str:
    """Table of the other fields: components, integers and names."""
    if not dataclasses.is_dataclass(cls):
        return ""
    hints = type_hints(cls)
    fields = [f for f in dataclasses.fields(cls) if "unit" not in f.metadata and f.init]
    if not fields:
        return ""
    rows = [
        (
            f"`{f.name}`",
            _linked(hints[f.name]) if f.name in hints else f"`{f.type}`",
            default_text(_default(f)),
        )
        for f in fields
    ]
    return "## Components and options\n\n" + table(("name", "value", "default"), rows)


def _default(field: dataclasses.Field[Any]) -> Any:
    return field.default_factory() if callable(field.default_factory) else field.default


def _linked(hint: Any) -> str:
    """An annotation in words, with links to the pages of models."""
    places = {cls.__name__: room for room, classes in rooms().items() for cls in classes}
    return re.sub(
        r"\w+",
        lambda m: f"[{m[0]}](../{places[m[0]]}/{m[0]}.md)" if m[0] in places else m[0],
        escape(describe(hint)),
    )


def property_section(cls: type[Any]) -> str:
    """Solution in closed form or by search, and use in plants, of a static characteristic."""
    if not issubclass(cls, Characteristic):
        return ""
    base = next(
        kind
        for kind in (ForceLaw, ContractionLaw, PressureLaw, Characteristic)
        if issubclass(cls, kind)
    )
    own = [word for method, word in DIRECTIONS.items() if _defines(cls, method, base)]
    searched = [word for word in DIRECTIONS.values() if word not in own]
    lines = [f"* Given by the model itself: {', '.join(own)}."]
    if searched:
        lines.append(f"* By a bracketed root search with exact slopes: {', '.join(searched)}.")
    if not cls.traceable:
        lines.append(
            "* Not in closed form: a plant uses it through `as_force_law`, which estimates its"
            " maximum error."
        )
    return "## Directions\n\n" + "\n".join(lines) + "\n"


def _defines(cls: type[Any], method: str, base: type[Any]) -> bool:
    return getattr(cls, method) is not getattr(base, method) or base is Characteristic


@functools.cache
def entries() -> tuple[Entry, ...]:
    """All muscles and laws of the library."""
    import warnings

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a page shows the warning of an entry
        return tuple(entry for name in files.list_laws() if isinstance(entry := load(name), Entry))


def entries_of(cls: type[Any]) -> list[Entry]:
    """Library entries that contain an object of a class, those whose law is of this class first."""
    found = [entry for entry in entries() if any(type(part) is cls for part in components(entry))]
    return sorted(found, key=lambda entry: type(entry.characteristic) is not cls)


def components(obj: Any) -> Iterator[Any]:
    """An object and all models within it."""
    yield obj
    if dataclasses.is_dataclass(obj) and not isinstance(obj, type):
        for field in dataclasses.fields(obj):
            yield from components(getattr(obj, field.name))


def library_section(cls: type[Any]) -> str:
    """Entries of the library that use a model, with the range in which they are valid."""
    found = entries_of(cls)
    if not found:
        return ""
    rows = [(f"`{e.name}`", escape(e.title), _validity(e), escape(e.provenance)) for e in found]
    return "## In the library\n\n" + table(("entry", "title", "validity range", "numbers"), rows)


def _validity(entry: Entry) -> str:
    limits = entry.validity_range
    if limits is None:
        return "–"
    low, high = limits.pressure
    first, last = limits.contraction
    return (
        f"{low / 1e3:.4g} to {high / 1e3:.4g} kPa, {100 * first:.3g} to"
        f" {100 * last:.3g}\N{NO-BREAK SPACE}%"
    )


def _references(cls: type[Any]) -> tuple[Reference, ...]:
    return tuple(getattr(cls, "references", ()) or ())


def reference_section(references: Iterable[Reference]) -> str:
    """Sources of a model, in full."""
    lines = [f"* {reference_text(each)}" for each in references]
    return "## References\n\n" + "\n".join(lines) + "\n" if lines else ""


def reference_text(each: Reference) -> str:
    """A reference with a link to its DOI."""
    year = f" ({each.year})" if each.year else ""
    doi = f", [doi:{escape(each.doi)}](https://doi.org/{each.doi})" if each.doi else ""
    note = f" {escape(each.note[0].upper() + each.note[1:])}." if each.note else ""
    return f"{escape(each.authors)}{year}: {escape(each.title)}. {escape(each.where)}{doi}.{note}"
