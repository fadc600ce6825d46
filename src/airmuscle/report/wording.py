"""How numbers and claims read on a page or in a terminal."""

from __future__ import annotations

import math
from numbers import Integral, Real
from typing import Any

import numpy as np

from .chapter import DIFFERS, HOLDS, NOT_PRINTED, AtLeast, AtMost, Claim, Table

MARKS = {HOLDS: "✓", DIFFERS: "✗", NOT_PRINTED: "–"}
"""A sign beside the word, for those who do not see the colour."""

MISSING = "–"
_RELATIONS = {AtLeast: "≥ ", AtMost: "≤ "}


def number(value: Any) -> str:
    """A value to six significant digits; a dash where there is none; text as it stands."""
    if isinstance(value, str):
        return value
    if value is None or isinstance(value, bool) or not isinstance(value, Real):
        return MISSING if value is None else str(value)
    if isinstance(value, Integral):
        return str(int(value))
    return f"{float(value):.6g}" if math.isfinite(value) else MISSING


def published(claim: Claim) -> str:
    """What the paper prints, with the sense of the comparison: `≥ 4`, `20 ± 0.5`."""
    if claim.printed is None:
        return MISSING
    relation = _RELATIONS.get(type(claim.printed), "")
    tolerance = f" ± {number(claim.printed.tolerance)}" if claim.printed.tolerance else ""
    chosen = " (chosen)" if claim.printed.chosen else ""
    return f"{relation}{number(claim.printed.value)}{tolerance}{chosen}"


def tally(claims: tuple[Claim, ...]) -> dict[str, int]:
    """How many claims got each verdict."""
    verdicts = [claim.verdict for claim in claims]
    return {verdict: verdicts.count(verdict) for verdict in MARKS}


def rows(table: Table) -> list[tuple[Any, ...]]:
    """The rows of a table, which is kept by columns."""
    columns = [np.atleast_1d(np.asarray(values, dtype=object)) for values in table.columns.values()]
    return list(zip(*columns, strict=True))
