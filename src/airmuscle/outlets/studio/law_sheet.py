"""Sheet of a law: all that the page shows of a muscle or a law, as plain data; TOML text with
places for numbers; the printed law and its outline as JavaScript functions of arrays, parameters as
inputs.

A template is a list of texts and integers: an integer is the place of the parameter of this index,
which is written as Python writes a float, so that a page fills in numbers without a server. The
functions write into arrays that they are given; x are the arguments, c is what `prepare(p, c)` made
of the parameters:

    force(x, c, f)          x = (p, eps), f = (F, dF/dp, dF/deps)
    contraction(x, c, f)    x = (p, F),   f = (eps, deps/dp, deps/dF)
    pressure(x, c, f)       x = (eps, F), f = (p, dp/deps, dp/dF)
    limits(c, f)            f = search ranges of pressure, contraction and force
    outline(x, c, f)        x = (eps, t), f = (axial position, radius), t from -1 to 1 along a
                            segment
    volume(x, c, f)         x = (eps),    f = (V, dV/deps)

A direction that the law does not give in closed form is missing; the page searches for its root.
"""

import dataclasses
import functools
import hashlib
import json
import math
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

import airmuscle as am

from ...core import (
    AirmuscleError,
    Array,
    Leaf,
    Node,
    ParameterError,
    TraceError,
    autodiff,
    cite,
    conversion,
    leaves,
    nodes,
    slopes,
    tree,
)
from ...engine.compile.functions import Printer
from ...engine.compile.text.languages import JavaScriptLanguage
from ...files.library import Entry, to_toml
from ...physics.muscle.characteristic.calls import (
    recorded_force,
    searched_contractions,
    stated_range,
)
from ...physics.muscle.characteristic.validity_range import validity_range_of
from ...physics.muscle.geometry.straight_fibre import FibreTube
from ..export.targets import FORMS, refused_beyond

_FIRST = 7.0e250
"""The first of the marks: numbers that no file contains."""
_STEP = 1.0e240
_MARK = re.compile(r"7(?:\.\d+)?e\+250")

Law = am.characteristic.Characteristic
Template = list[str | int]
MAX_PARAMETERS = 60
"""Maximum number of parameters with a slider; a law with more, such as a table, has none
(chosen).
"""
SHOWN_UNITS: dict[str, tuple[tuple[float, str], ...]] = {
    "m": ((1.0, "mm"),),
    "rad": ((math.inf, "deg"),),
    "s": ((0.5, "ms"),),
    "m3": ((1.0, "cm3"),),
    "kg": ((0.1, "g"),),
    "Pa": ((1e3, "Pa"), (1e6, "kPa"), (math.inf, "MPa")),
    "m3/(s Pa)": ((math.inf, "dm3/(s bar)"),),
}
"""Units in which numbers below a limit are shown, by SI unit (chosen)."""
OUTLINE_CONTRACTIONS = 61
OUTLINE_POINTS = 41
"""Grid of an outline that is not in closed form (chosen)."""
DIRECTIONS = ("force", "contraction", "pressure")
_UNTRACEABLE = (AirmuscleError, RuntimeError, TypeError, ValueError)
"""Errors of a direction that needs numbers, as a root search does."""


def law_sheet(entry: Entry) -> dict[str, Any]:
    """The sheet of an entry, with the text of its program under "script"; of a law without a closed
    form, that of its approximation on its validity range, with the error. Raises TraceError for one
    without a validity range.
    """
    law, errors = _in_closed_form(entry)
    geometry = entry.geometry
    kind = type(entry.characteristic)
    ratings = entry.ratings
    text, functions, held_values = print_law(law, geometry)
    rows = [(f"characteristic.{leaf.path}", leaf) for leaf in leaves(law)]
    if parameter_model(law, geometry) is not law:
        rows += [(f"geometry.{leaf.path}", leaf) for leaf in leaves(geometry)]
    limits = validity_range_of(law, entry.validity_range)
    fixed = bool(errors) or len(rows) > MAX_PARAMETERS
    parameters = [] if fixed else _parameter_rows(rows, entry)
    shape = None if geometry is None else _shape_row(geometry, "outline" in functions)
    sheet: dict[str, Any] = {
        **{key: getattr(entry, key) for key in ("name", "title", "provenance", "note", "warning")},
        "law": kind.__name__,
        "formula": (kind.__doc__ or "").strip().partition("\n")[0],
        "kind": next(method for form, method, *_ in FORMS if isinstance(law, form)),
        "functions": functions,
        "held": held_values,
        "limits": [float(limit) for limit in _limits(law)],
        "beyond": _beyond_row(law),
        "values": [leaf.value for _, leaf in rows],
        "parameters": parameters,
        "resting_length": _place_of_resting_length([path for path, _ in rows]),
        "validity_range": None if limits is None else dataclasses.asdict(limits),
        "ratings": {name: getattr(ratings, name) for name in ratings.stated} if ratings else {},
        "geometry": shape,
        "references": [str(reference) for reference in cite(entry)],
        "approximation": errors,
        "toml": _toml(entry, fixed),
    }
    return with_script(sheet, text, ("prepare", *functions))


def _beyond_row(law: Law) -> dict[str, Any] | None:
    """The range of a law, beyond which the page continues its force and searches for solutions;
    None for a law that refuses what lies there.
    """
    if law.refuses_beyond:
        return None
    limits = stated_range(law)
    pressures = limits.pressure
    return {
        "begin": float(limits.min_contraction),
        "end": float(limits.end),
        "searched": [float(limit) for limit in searched_contractions(law, limits)],
        "pressures": None if pressures is None else [float(limit) for limit in pressures],
        "permitted": limits.stated_force,
    }


def _parameter_rows(rows: Sequence[tuple[str, Leaf]], entry: Entry) -> list[dict[str, Any]]:
    """The parameters of the page by their paths, with their standard errors as far as known."""
    known = entry.uncertainty
    stated = (
        {} if known is None else dict(zip(known.parameters, known.standard_errors, strict=True))
    )
    parameters = [parameter_row(path, leaf, entry.provenance) for path, leaf in rows]
    for row in parameters:
        path = row["path"]
        of_law = stated.get(path.removeprefix("characteristic."))
        row["standard_error"] = stated.get(path, of_law)
    return parameters


def _place_of_resting_length(paths: Sequence[str]) -> int | None:
    """The number of the parameter that is the resting length; None without one."""
    for i, path in enumerate(paths):
        if path.endswith("resting_length"):
            return i
    return None


def _shape_row(geometry: am.geometry.Geometry, is_printed: bool) -> dict[str, Any]:
    """A geometry with the number of its segments, and its radii on a grid where the program has no
    function of them.
    """
    low, high = geometry.contraction_range
    segments = geometry.segments if isinstance(geometry, FibreTube) else 1
    shape = {
        "model": type(geometry).__name__,
        "segments": segments,
        "range": [float(low), float(high)],
    }
    if not is_printed:
        grid = np.linspace(max(low, -0.05), min(high, 0.6), OUTLINE_CONTRACTIONS)
        shape |= sampled_outline(geometry, grid)
    return shape


def identifier_of(sheet: Mapping[str, Any], text: str = "") -> str:
    """The identifier of a sheet and of the text of its program, a hash of both."""
    return hashlib.sha256((text + json.dumps(sheet)).encode()).hexdigest()[:32]


def with_script(sheet: Mapping[str, Any], text: str, functions: Sequence[str]) -> dict[str, Any]:
    """A sheet with its identifier, and its program as a script that enters functions into the table
    of the page.
    """
    identifier = identifier_of(sheet, text)
    result = f"return {{ {', '.join(functions)} }};"
    text = re.sub(r"^export ", "", text, flags=re.MULTILINE)
    script = (
        f'"use strict";\nairmusclePrograms["{identifier}"] = (() => {{\n{text}\n{result}\n}})();\n'
    )
    return {**sheet, "id": identifier, "script": script}


def _in_closed_form(entry: Entry) -> tuple[Law, dict[str, Any] | None]:
    """The law, or its approximation with its errors [N]."""
    law = entry.characteristic
    if law.traceable:
        return law, None
    limits = validity_range_of(law, entry.validity_range)
    if limits is None:
        raise TraceError(
            f"{entry.name}: {type(law).__name__} has no closed form and no validity range, on which"
            " it could be approximated. Add [validity_range] to its file, or see airmuscle"
            " approximate."
        )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        approximation: am.characteristic.PolynomialSurrogate = am.characteristic.as_force_law(
            law, limits
        )
    errors = {key: getattr(approximation, key) for key in ("max_error", "rms_error", "coverage")}
    return approximation.surface, {**errors, "degree": approximation.surface.degree}


def parameter_row(path: str, leaf: Leaf, source: str) -> dict[str, Any]:
    """One parameter for the page: symbol, unit, meaning, bounds, source, and the unit in which it
    is shown.
    """
    declared = leaf.declared
    value = float(leaf.value)
    unit = declared.unit
    shown = next((shown for limit, shown in SHOWN_UNITS.get(unit, ()) if abs(value) < limit), unit)
    return {
        "path": path,
        "symbol": declared.symbol,
        "unit": unit,
        "meaning": declared.meaning,
        "bounds": [bound if math.isfinite(bound) else None for bound in declared.bounds],
        "value": value,
        "shown_unit": "" if shown == unit == "1" else shown,
        "factor": 1.0 if shown == unit else conversion(shown, unit).factor,
        "source": source,
    }


def sampled_outline(
    geometry: am.geometry.Geometry,
    contractions: Array,
    points: int = OUTLINE_POINTS,
    decimals: int | None = None,
) -> dict[str, Any]:
    """Axial positions and radii of an outline at contractions (n,), rounded to decimals if
    given.
    """
    outlines = [geometry.outline(float(c), points) for c in contractions]
    if decimals is not None:
        outlines = [
            (np.round(axial, decimals), np.round(radius, decimals)) for axial, radius in outlines
        ]
    axial, radius = ([outline[i].tolist() for outline in outlines] for i in (0, 1))
    return {"contractions": contractions.tolist(), "axial": axial, "radius": radius}


def _toml(entry: Entry, fixed: bool) -> dict[str, Any]:
    """The file of the entry as it is, and the template of its file with other parameters. Standard
    errors, checks and the validity range of a fit belong to the parameters of the entry alone."""
    note = f"Parameters of {entry.name} ({entry.provenance}) changed in airmuscle studio. {entry.note}".strip()  # noqa: E501
    changed = dataclasses.replace(
        entry,
        title=f"{entry.title}, parameters changed",
        provenance="chosen",
        uncertainty=None,
        checks=(),
        warning="",
        note=note,
    )

    def write(model: Any) -> str:
        law, geometry = law_and_geometry(model, entry.geometry)
        return to_toml(dataclasses.replace(changed, characteristic=law, geometry=geometry))

    model = parameter_model(entry.characteristic, entry.geometry)
    return {"unchanged": to_toml(entry), "changed": [] if fixed else toml_template(write, model)}


def toml_template(write: Callable[[Any], str], model: Any) -> Template:
    """The template of the text that `write` makes of a model, with a place for each leaf. Raises
    ParameterError.
    """
    marks = [_FIRST + i * _STEP for i, _ in enumerate(leaves(model))]
    place = {repr(mark): i for i, mark in enumerate(marks)}
    text = write(tree.unflatten(model, marks))
    template = list[str | int]()
    end = 0
    for match in _MARK.finditer(text):
        template += [text[end : match.start()], place[match.group()]]
        end = match.end()
    template.append(text[end:])
    missing = set(range(len(marks))) - {item for item in template if isinstance(item, int)}
    if missing:
        raise ParameterError(
            f"{type(model).__name__}: {len(missing)} parameters do not appear in its file."
        )
    return template


# The printed law


def print_law(law: Law, geometry: am.geometry.Geometry | None) -> tuple[str, list[str], int]:
    """The program of a traceable law, and of the outline where the geometry is in closed form, as
    JavaScript text; the names of its functions, and the length of `c`. Raises TraceError for a law
    without a closed form.
    """
    model, p = autodiff.symbolic(parameter_model(law, geometry))
    model, shape = law_and_geometry(model, geometry)
    printer = Printer(JavaScriptLanguage(exported=False))
    names = []
    for name, inputs, outputs in _functions(law, model, shape):
        printer.add(name, {**inputs, "p": p}, {"f": outputs})
        names.append(name)
    if not set(names) & set(DIRECTIONS):
        raise TraceError(f"{type(law).__name__} has no direction in closed form.")
    return printer.module(), names, printer.held


def parameter_model(law: Law, geometry: am.geometry.Geometry | None) -> Any:
    """What has the parameters of the page as leaves: the law, or the pair with a geometry that is
    not part of it.
    """
    return (
        law if geometry is None or geometry == getattr(law, "geometry", None) else (law, geometry)
    )


def law_and_geometry(model: Any, geometry: am.geometry.Geometry | None) -> tuple[Any, Any]:
    """The law and its geometry in what `parameter_model` has made of them."""
    return (
        model if isinstance(model, tuple) else (model, None if geometry is None else model.geometry)
    )


class LawFunction(NamedTuple):
    """A function of the program of a law, by its arguments and results."""

    name: str
    arguments: dict[str, list[Node]]
    results: list[Node]


def _functions(law: Law, model: Any, shape: Any) -> list[LawFunction]:
    """Every function of a law that can be traced; `model` is the law with symbols for its
    parameters.
    """
    functions = list[LawFunction]()
    x = nodes.symbols("x", 2)
    for name in DIRECTIONS:
        answer = getattr(model, name)
        if name == "force" and isinstance(law, am.characteristic.ForceLaw):
            answer = functools.partial(recorded_force, law, model)
        values = _traced(lambda *at, answer=answer: [answer(*at)], *x)
        if values is not None:
            results = [*values, *slopes.gradient(values[0], x)]
            answered = refused_beyond(model, name, x, results)
            functions.append(LawFunction(name, {"x": x}, answered))
    limits = _traced(lambda: _limits(model))
    if limits is not None:
        functions.append(LawFunction("limits", {}, limits))
    if shape is None:
        return functions
    contraction = x[:1]
    volume = _traced(lambda c: [shape.volume(c)], *contraction) if shape.traceable else None
    if volume is not None:
        slope = slopes.gradient(volume[0], contraction)
        functions.append(LawFunction("volume", {"x": contraction}, [*volume, *slope]))
    outline = _traced(lambda *at: _outline(shape, *at), *x)
    if outline is not None:
        functions.append(LawFunction("outline", {"x": x}, outline))
    return functions


def _traced(function: Callable[..., Sequence[Any]], *arguments: Node) -> list[Node] | None:
    """The expressions of a function, None where it needs numbers."""
    try:
        values = nodes.as_nodes(function(*arguments))
        autodiff.check_finite(values, "law")
    except _UNTRACEABLE:
        return None
    return values


def _limits(model: Any) -> Sequence[Any]:
    return (*model.pressure_range, *model.contraction_range, *model.force_range)


def _outline(shape: Any, contraction: Any, t: Any) -> tuple[Any, Any]:
    """Axial position from the middle of a segment [m] and radius [m]. Raises TraceError for another
    geometry.
    """
    if isinstance(shape, am.geometry.Braid):
        return t * shape.resting_length * (1.0 - contraction) / 2, shape.radius_at(contraction)
    if isinstance(shape, FibreTube) and shape.traceable:
        return shape.profile(contraction, t)
    raise TraceError(f"{type(shape).__name__}: the outline is not in closed form.")
