"""Sheet of a law: all that the page shows of a muscle or a law, as plain data; TOML text with places for numbers.

A template is a list of texts and integers: an integer is the place of the parameter of this index, which is written
as Python writes a float, so that a page fills in numbers without a server.
"""

import dataclasses
import hashlib
import json
import math
import re
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

import airmuscle as am

from ...core import Array, Leaf, ParameterError, TraceError, cite, conversion, leaves, tree
from ...files.library import Entry, to_toml
from ...physics.muscle.characteristic.validity_range import validity_range_of
from ...physics.muscle.geometry.straight_fibre import FibreTube
from ..export.targets import FORMS
from .law_program import law_and_geometry, parameter_model, print_law

_FIRST = 7.0e250
"""The first of the marks: numbers that no file contains."""
_STEP = 1.0e240
_MARK = re.compile(r"7(?:\.\d+)?e\+250")

Template = list[str | int]
MAX_PARAMETERS = 60
"""Maximum number of parameters with a slider; a law with more, such as a table, has none (chosen)."""
SHOWN_UNITS: dict[str, tuple[tuple[float, str], ...]] = {
    "m": ((1.0, "mm"),), "rad": ((math.inf, "deg"),), "s": ((0.5, "ms"),), "m3": ((1.0, "cm3"),), "kg": ((0.1, "g"),),
    "Pa": ((1e3, "Pa"), (1e6, "kPa"), (math.inf, "MPa")), "m3/(s Pa)": ((math.inf, "dm3/(s bar)"),),
}  # fmt: skip
"""Units in which numbers below a limit are shown, by SI unit (chosen)."""
OUTLINE_CONTRACTIONS, OUTLINE_POINTS = 61, 41
"""Grid of an outline that is not in closed form (chosen)."""


def law_sheet(entry: Entry) -> dict[str, Any]:
    """The sheet of an entry, with the text of its program under "script".

    A law without a closed form is approximated on its validity range, and the sheet states the error. Raises
    TraceError for one without a validity range.
    """
    law, errors = _in_closed_form(entry)
    geometry = entry.geometry
    program = print_law(law, geometry)
    rows = _parameter_leaves(law, geometry)
    limits = validity_range_of(law, entry.validity_range)
    sheet: dict[str, Any] = {
        "name": entry.name,
        "title": entry.title,
        "provenance": entry.provenance,
        "note": entry.note,
        "warning": entry.warning,
        "law": type(entry.characteristic).__name__,
        "formula": (type(entry.characteristic).__doc__ or "").strip().partition("\n")[0],
        "kind": next(method for kind, method, *_ in FORMS if isinstance(law, kind)),
        "functions": list(program.functions),
        "held": program.held,
        "limits": list(program.limits),
        "values": [leaf.value for _, leaf in rows],
        "parameters": [] if errors or len(rows) > MAX_PARAMETERS else _parameter_rows(rows, entry),
        "resting_length": next((i for i, (path, _) in enumerate(rows) if path.endswith("resting_length")), None),
        "validity_range": None if limits is None else dataclasses.asdict(limits),
        "ratings": {name: getattr(entry.ratings, name) for name in (entry.ratings.stated if entry.ratings else ())},
        "geometry": None if geometry is None else _geometry_sheet(geometry, "outline" in program.functions),
        "references": [str(reference) for reference in cite(entry)],
        "approximation": errors,
        "toml": _toml(entry, bool(errors) or len(rows) > MAX_PARAMETERS),
    }
    sheet["id"] = hashlib.sha256((program.text + json.dumps(sheet)).encode()).hexdigest()[:32]
    sheet["script"] = script_text(sheet["id"], program.text, ("prepare", *program.functions))
    return sheet


def script_text(identifier: str, text: str, functions: tuple[str, ...]) -> str:
    """A program as a script that enters its functions into the table of the page."""
    result = f"return {{ {', '.join(functions)} }};"
    return f'"use strict";\nairmusclePrograms["{identifier}"] = (() => {{\n{text}\n{result}\n}})();\n'


def _in_closed_form(entry: Entry) -> tuple[am.characteristic.Characteristic, dict[str, Any] | None]:
    """The law, or its approximation with its errors [N]."""
    law = entry.characteristic
    if law.traceable:
        return law, None
    limits = validity_range_of(law, entry.validity_range)
    if limits is None:
        raise TraceError(
            f"{entry.name}: {type(law).__name__} has no closed form and no validity range, on which it could be "
            "approximated. Add [validity_range] to its file, or see airmuscle approximate."
        )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        approximation: am.characteristic.PolynomialSurrogate = am.characteristic.as_force_law(law, limits)
    return approximation.surface, {
        "max_error": approximation.max_error, "rms_error": approximation.rms_error, "coverage": approximation.coverage,
        "degree": approximation.surface.degree,
    }  # fmt: skip


def _parameter_leaves(
    law: am.characteristic.Characteristic, geometry: am.geometry.Geometry | None
) -> list[tuple[str, Leaf]]:
    """The parameters in the order of the program, each with its path in the file of the entry."""
    rows = [(f"characteristic.{leaf.path}", leaf) for leaf in leaves(law)]
    if parameter_model(law, geometry) is not law:
        rows += [(f"geometry.{leaf.path}", leaf) for leaf in leaves(geometry)]
    return rows


def parameter_row(path: str, leaf: Leaf, source: str) -> dict[str, Any]:
    """One parameter for the page: symbol, unit, meaning, bounds, source, and the unit in which it is shown."""
    unit = leaf.declared.unit
    shown = display_unit(float(leaf.value), unit)
    return {
        "path": path,
        "symbol": leaf.declared.symbol,
        "unit": unit,
        "meaning": leaf.declared.meaning,
        "bounds": [bound if math.isfinite(bound) else None for bound in leaf.declared.bounds],
        "value": float(leaf.value),
        "shown_unit": shown[0],
        "factor": shown[1],
        "source": source,
    }


def display_unit(value: float, unit: str) -> tuple[str, float]:
    """The unit in which a number is shown, and its factor."""
    shown = next((shown for limit, shown in SHOWN_UNITS.get(unit, ()) if abs(value) < limit), unit)
    if shown == unit:
        return "" if unit == "1" else unit, 1.0
    return shown, conversion(shown, unit).factor


def _parameter_rows(rows: list[tuple[str, Leaf]], entry: Entry) -> list[dict[str, Any]]:
    known = entry.uncertainty
    errors = {} if known is None else dict(zip(known.parameters, known.standard_errors, strict=True))
    table = [parameter_row(path, leaf, entry.provenance) for path, leaf in rows]
    for row in table:
        row["standard_error"] = errors.get(row["path"], errors.get(row["path"].removeprefix("characteristic.")))
    return table


def _geometry_sheet(geometry: am.geometry.Geometry, printed: bool) -> dict[str, Any]:
    """The outline of a geometry: the number of its segments, and radii on a grid where there is no closed form."""
    segments = geometry.segments if isinstance(geometry, FibreTube) else 1
    low, high = geometry.contraction_range
    sheet = {"model": type(geometry).__name__, "segments": segments, "range": [float(low), float(high)]}
    if printed:
        return sheet
    return {**sheet, **sampled_outline(geometry, np.linspace(max(low, -0.05), min(high, 0.6), OUTLINE_CONTRACTIONS))}


def sampled_outline(
    geometry: am.geometry.Geometry, contractions: Array, points: int = OUTLINE_POINTS, decimals: int | None = None
) -> dict[str, Any]:
    """Axial positions and radii of an outline at contractions (n,), rounded to decimals if given."""
    outlines = [geometry.outline(float(c), points) for c in contractions]
    if decimals is not None:
        outlines = [(np.round(axial, decimals), np.round(radius, decimals)) for axial, radius in outlines]
    axial, radius = ([each[i].tolist() for each in outlines] for i in (0, 1))
    return {"contractions": contractions.tolist(), "axial": axial, "radius": radius}


def _toml(entry: Entry, fixed: bool) -> dict[str, Any]:
    """The file of the entry as it is, and the template of its file with other parameters.

    Standard errors, checks and the validity range of a fit belong to the parameters of the entry alone.
    """
    changed = dataclasses.replace(
        entry,
        title=f"{entry.title}, parameters changed",
        provenance="chosen",
        uncertainty=None,
        checks=(),
        warning="",
        note=f"Parameters of {entry.name} ({entry.provenance}) changed in airmuscle studio. {entry.note}".strip(),
    )
    return {"unchanged": to_toml(entry), "changed": [] if fixed else _changed_template(changed)}


def _changed_template(entry: Entry) -> Template:
    def write(model: Any) -> str:
        law, geometry = law_and_geometry(model, entry.geometry)
        return to_toml(dataclasses.replace(entry, characteristic=law, geometry=geometry))

    return toml_template(write, parameter_model(entry.characteristic, entry.geometry))


def toml_template(write: Callable[[Any], str], model: Any) -> Template:
    """The template of the text that `write` makes of a model, with a place for each leaf. Raises ParameterError."""
    marks = [_FIRST + i * _STEP for i, _ in enumerate(leaves(model))]
    place = {repr(mark): i for i, mark in enumerate(marks)}
    text = write(tree.unflatten(model, marks))
    template: Template = []
    end = 0
    for match in _MARK.finditer(text):
        template += [text[end : match.start()], place[match.group()]]
        end = match.end()
    template.append(text[end:])
    missing = set(range(len(marks))) - {item for item in template if isinstance(item, int)}
    if missing:
        raise ParameterError(f"{type(model).__name__}: {len(missing)} parameters do not appear in its file.")
    return template


def fill_template(template: Template, values: list[float]) -> str:
    """The text with these values, as the page fills it in."""
    return "".join(repr(values[item]) if isinstance(item, int) else item for item in template)
