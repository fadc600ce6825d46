"""Audit of a list of constants: printed against coded values, and values that no muscle has."""

import itertools
import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from ...core import FileError, UnitError, quantity
from ..body.poses import separated_rows
from .finding import AuditFinding, AuditResult

ROUNDING = 0.01
"""Relative difference of a printed and a coded value that rounding may cause (chosen)."""
RULES = ("printed as coded", "plausible")


class PlausibleRange(NamedTuple):
    """Words of a name, and the range [SI] of such a quantity in a muscle or its air (chosen)."""

    words: tuple[str, ...]
    unit: str
    low: float
    high: float


PLAUSIBLE = (
    PlausibleRange(("density", "air"), "kg/m^3", 0.5, 20.0),
    PlausibleRange(("density",), "kg/m^3", 500.0, 3000.0),
    PlausibleRange(("angle",), "rad", 0.05, 1.55),
    PlausibleRange(("gas", "constant"), "J/(kg K)", 280.0, 300.0),
    PlausibleRange(("temperature",), "K", 230.0, 400.0),
    PlausibleRange(("critical", "ratio"), "1", 0.05, 0.6),
    PlausibleRange(("isentropic",), "1", 1.0, 1.7),
    PlausibleRange(("polytropic",), "1", 1.0, 1.7),
    PlausibleRange(("poisson",), "1", 0.2, 0.5),
    PlausibleRange(("modulus",), "Pa", 1e4, 5e8),
    PlausibleRange(("contraction",), "1", -0.1, 0.5),
    PlausibleRange(("length",), "m", 1e-3, 20.0),
    PlausibleRange(("diameter",), "m", 1e-4, 0.2),
    PlausibleRange(("radius",), "m", 1e-4, 0.1),
    PlausibleRange(("pressure",), "Pa", -1.1e5, 3e6),
    PlausibleRange(("force",), "N", -1e3, 2e4),
    PlausibleRange(("volume",), "m^3", 1e-9, 0.1),
)
"""The first row whose words are all in the name of a constant applies."""


def audit_constants(path: Path) -> AuditResult:
    """The audit of a CSV file with the columns name, value, unit, and printed where a source prints
    another value. Raises FileError.
    """
    rows = _read(path)
    findings = tuple(finding for row in rows for finding in _findings(path, row))
    left_out = (
        () if any(row.get("printed") for row in rows) else ((RULES[0], "needs a column 'printed'"),)
    )
    rules = RULES[len(left_out) :]
    return AuditResult(path.name, rules, findings, left_out, len(rows))


def is_list_of_constants(path: Path) -> bool:
    """Whether the first line of a file names the columns of a list of constants."""
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        heading = next(separated_rows([file.readline(1000)]), [])
    return {"name", "value"} <= {word.strip().lower() for word in heading}


def _read(path: Path) -> list[dict[str, str]]:
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise FileError(f"{path}: cannot be read as text ({error}).") from None
    heading, *lines = [line for line in separated_rows(text.splitlines()) if line] or [[]]
    names = [word.strip().lower() for word in heading]
    rows = [
        {name: cell.strip() for name, cell in itertools.zip_longest(names, line, fillvalue="")}
        for line in lines
    ]
    if not rows or not {"name", "value"} <= rows[0].keys():
        raise FileError(
            f"{path}: a list of constants has a heading with name and value, and may have unit and"
            " printed: name,value,unit,printed."
        )
    return rows


def _number(path: Path, row: Mapping[str, str], key: str) -> float:
    try:
        value = float(row[key])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise FileError(f"{path}: {key} of {row['name']} is '{row[key]}'; it must be a number.")
    return value


def _findings(path: Path, row: Mapping[str, str]) -> Iterator[AuditFinding]:
    name = row["name"]
    unit = row.get("unit", "") or "1"
    coded = _number(path, row, "value")
    shown = f"{name} = {coded:g}" + ("" if unit == "1" else f" {unit}")
    if row.get("printed"):
        printed = _number(path, row, "printed")
        if abs(coded - printed) > ROUNDING * max(abs(coded), abs(printed)):
            share = f" ({coded / printed:.3g} times)" if printed else ""
            text = f"{name} is {coded:g} in the code and {printed:g} in print{share}."
            yield AuditFinding(RULES[0], text, (shown, f"printed: {printed:g}"))
    expected = _plausible(name)
    if expected is None:
        return
    try:
        value = quantity(
            f"{coded!r} {unit}" if unit != "1" else repr(coded), expected.unit, where=name
        )
    except UnitError as error:
        yield AuditFinding(RULES[1], f"{name}: {error}", (shown,))
        return
    if not expected.low <= value <= expected.high:
        in_degrees = expected.unit == "rad" and expected.low <= math.radians(value) <= expected.high
        cause = " It seems to be in degrees." if in_degrees else ""
        text = (
            f"{shown} is outside of what muscles have: {expected.low:g} to {expected.high:g}"
            f"{'' if expected.unit == '1' else ' ' + expected.unit}.{cause}"
        )
        yield AuditFinding(RULES[1], text, (shown,))


def _plausible(name: str) -> PlausibleRange | None:
    words = re.split(r"[^a-z]+", name.lower())
    for row in PLAUSIBLE:
        if all(any(word.startswith(stem) for word in words) for stem in row.words):
            return row
    return None
