"""Settings of a fit in the page: interpretation of the files, selection of rows, and options of the
comparison.

An error names the field of the page that it concerns: `resting_length`, `column:p`, `file:run.csv`.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

import airmuscle as am

from ...bench.inspection.outliers import Outlier, kept_rows, leave_out
from ...core import AirmuscleError, UnitError, quantity
from ...files.library.folders import list_laws
from ..requests import BraidRequest, FitRequest, ReadingRequest, RequestError, build, form_fields

MAX_RULES = 200
MAX_CHOICES = 500
"""Maximum number of selections of rows; of corrected columns, or of files with facts of their own
(chosen).
"""
OFFERED = {
    option["name"]: [value for value, _ in option["offered"]]
    for option in form_fields(ReadingRequest)
}
"""Values that the form offers, by the fields with a text that applies to all files."""
TEXTS = tuple(OFFERED)
BRAID = ("braid_radius", "braid_angle")
"""The geometry of a muscle whose law contains none, at rest."""
LENGTHS = ("resting_length", "length")
FILE_FACTS = (*LENGTHS, "specimen")
"""Facts that may be stated for one file."""
COLUMN_CHOICES = (*am.recording.QUANTITIES, "resting_length", "ambient")
"""Quantities of a column."""


@dataclasses.dataclass(frozen=True)
class Rule:
    """Rows of some recordings that are left out, or the only ones that are kept.

    recordings  origins of the recordings; all if empty
    ranges      closed interval [SI] by column; a row is inside if all columns are
    rows        first row and the row after the last, from 0, in place of ranges
    keep        whether the rows inside are the only ones that are used
    """

    recordings: tuple[str, ...]
    ranges: Mapping[str, tuple[float, float]]
    rows: tuple[int, int] | None
    keep: bool


@dataclasses.dataclass(frozen=True)
class FitSettings:
    """What the user states about the files, which rows are used, and what is fitted.

    columns  heading with quantity and unit by the heading in the file; an empty text excludes the
             column
    facts    resting_length, length and specimen by the name of a file
    """

    texts: Mapping[str, str]
    columns: Mapping[str, str]
    facts: Mapping[str, Mapping[str, str]]
    rules: tuple[Rule, ...]
    entry: str
    leave_out: am.bench.GroupSplit | None
    hysteresis: bool

    def mapping(self, columns: Mapping[str, str] | None = None) -> am.bench.ColumnMapping:
        """The interpretation of all files, with these columns in place of all. Raises
        RequestError.
        """
        codes = self.texts["missing_code"].replace(";", ",").split(",")
        texts: dict[str, Any] = {
            **self.texts,
            "missing_code": [code for code in codes if code.strip()],
        }
        try:
            chosen = self.columns if columns is None else columns
            return build(ReadingRequest, texts, _words).column_mapping(columns=chosen)
        except AirmuscleError as error:
            named = next(
                (name for name in TEXTS if name.split("_")[0] in error.message[:40]), "columns"
            )
            raise RequestError(error.message, getattr(error, "field", "") or named) from None

    @property
    def braid(self) -> am.geometry.Braid | None:
        """The braid, of unit length; None if none is stated. Raises RequestError."""
        try:
            return build(BraidRequest, {name: self.texts[name] for name in BRAID}, _words).braid
        except UnitError as error:
            raise RequestError(
                error.message, next(name for name in BRAID if _words(name) in error.message)
            ) from None


def _words(name: str) -> str:
    return name.replace("_", " ")


def _facts(value: Any, field: str) -> dict[str, str]:
    """The facts of a file that are not empty. Raises RequestError for an unknown one."""
    table = _table(value, field)
    for fact in table:
        if fact not in FILE_FACTS:
            text = f"'{str(fact)[:40]}' is no fact of a file; allowed: {', '.join(FILE_FACTS)}."
            raise RequestError(text, field)
    texts = {name: _text(table.get(name, ""), field) for name in FILE_FACTS}
    return {name: text for name, text in texts.items() if text}


def read_settings(data: Any) -> FitSettings:
    """The settings in a request of the page. Raises RequestError."""
    if not isinstance(data, dict):
        raise RequestError("the request must be a table of settings.")
    texts = dict[str, str]()
    for name in (*TEXTS, *BRAID):
        value = data.get(name, "")
        texts[name] = (
            value if value in OFFERED.get(name, ()) else _text(value, name)
        )  # tab and blank as they are
    facts: dict[str, dict[str, str]] = {}
    for file, value in _table(data.get("files", {}), "files").items():
        facts[file] = _facts(value, f"file:{file}")
    columns = {
        key: _heading(key, value)
        for key, value in _table(data.get("columns", {}), "columns").items()
    }
    rules = data.get("rules", [])
    if not isinstance(rules, list) or len(rules) > MAX_RULES:
        raise RequestError(
            f"at most {MAX_RULES} selections of rows are possible; remove some.", "rules"
        )
    entry, left_out = (_text(data.get(name, ""), name) for name in ("entry", "leave_out"))
    leave_out = build(FitRequest, {"compare": True, "leave_out": left_out}, _words).leave_out
    hysteresis = data.get("hysteresis") is True
    settings = FitSettings(
        texts, columns, facts, tuple(map(_rule, rules)), entry, leave_out, hysteresis
    )
    _ = settings.braid  # checks it
    for file, stated in facts.items():
        for name in (fact for fact in stated if fact in LENGTHS):
            _check_length(stated[name], _words(name), f"file:{file}")
    if entry and entry not in list_laws():
        raise RequestError(f"the library has no muscle or law '{entry}'.", "entry")
    settings.mapping()
    return settings


def _check_length(text: str, words: str, field: str) -> None:
    try:
        value = quantity(text, "m", where=words)
    except AirmuscleError as error:
        raise RequestError(error.message, field) from None
    if not 0 < value < math.inf:
        raise RequestError(f"{words} is {text}; it must be positive, such as 300 mm.", field)


def _text(value: Any, field: str, longest: int = 200) -> str:
    if not isinstance(value, str) or len(value) > longest or not value.isprintable():
        raise RequestError(
            f"{_words(field)} must be a text of at most {longest} printable characters.", field
        )
    return value.strip()


def _table(value: Any, field: str) -> dict[str, Any]:
    if not isinstance(value, dict) or len(value) > MAX_CHOICES:
        raise RequestError(f"{field} must be a table with at most {MAX_CHOICES} rows.", field)
    return value


def _heading(key: str, value: Any) -> str:
    """The heading that a correction gives a column; empty for one that is not used."""
    field = f"column:{key}"
    if not isinstance(value, dict):
        raise RequestError("a column needs a quantity and a unit.", field)
    name = _text(value.get("quantity", ""), field)
    unit = _text(value.get("unit", ""), field, 40)
    if not name:
        return ""
    if name not in COLUMN_CHOICES:
        raise RequestError(
            f"'{name[:40]}' is no known quantity; allowed: {', '.join(COLUMN_CHOICES)}.", field
        )
    return f"{name} [{unit}]" if unit else name


def _rule(value: Any) -> Rule:
    try:
        recordings = tuple(_text(origin, "rules") for origin in value.get("recordings", []))
        ranges = {}
        for name, limits in value.get("ranges", {}).items():
            low, high = map(float, limits)
            if not -math.inf < low <= high < math.inf:
                raise ValueError
            ranges[_text(name, "rules")] = low, high
        rows = value.get("rows")
        if rows is not None:
            first, stop = rows
            if not all(type(row) is int and row >= 0 for row in (first, stop)):
                raise ValueError
            rows = (first, stop)
        elif not ranges:
            raise ValueError
        return Rule(recordings, ranges, rows, value.get("keep") is True)
    except (AttributeError, TypeError, ValueError):
        raise RequestError(
            "a selection of rows needs ranges of columns, or the first and the last row.", "rules"
        ) from None


# What the rules leave of a recording

Mask = npt.NDArray[np.bool_]


def used_rows(
    recording: am.Recording, rules: Sequence[Rule], outliers: Sequence[Outlier] = ()
) -> Mask:
    """The rows of a recording that the rules leave, without outliers, shape (N,). Raises
    RequestError for an unknown column."""
    used = kept_rows(recording, outliers)
    for rule in (
        selection
        for selection in rules
        if not selection.recordings or recording.origin in selection.recordings
    ):
        if rule.rows is not None:
            inside = np.zeros(len(recording), bool)
            inside[slice(*rule.rows)] = True
        else:
            inside = np.ones(len(recording), bool)
            for name, (low, high) in rule.ranges.items():
                if name not in recording:
                    text = (
                        f"{recording.origin}: no column '{name[:40]}', which a selection of rows"
                        " names."
                    )
                    raise RequestError(text, "rules")
                inside &= (recording[name] >= low) & (recording[name] <= high)
        used &= inside if rule.keep else ~inside
    return used


def selected(
    recordings: Sequence[am.Recording], rules: Sequence[Rule], outliers: Sequence[Sequence[Outlier]]
) -> list[am.Recording]:
    """The recordings reduced to the selected rows of their files, with a note on what was left out;
    without those that are empty. Raises RequestError if no row is left."""
    reduced = []
    for complete, recording_outliers in zip(recordings, outliers, strict=True):
        recording = leave_out(complete, recording_outliers)
        used = used_rows(complete, rules)[kept_rows(complete, recording_outliers)]
        count = int(np.count_nonzero(~used))
        note = (
            f"{recording.origin}: {count} of {len(recording)} rows are left out, as specified by"
            " the user."
        )
        if used.all():
            reduced.append(recording)
        elif used.any():
            reduced.append(
                dataclasses.replace(recording.rows(used), notes=(*recording.notes, note))
            )
    if recordings and not reduced:
        raise RequestError("no row is left; remove a selection.", "rules")
    return reduced
