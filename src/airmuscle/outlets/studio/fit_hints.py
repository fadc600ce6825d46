"""Remedies of the page: the hints of messages in the words of the fields of the tab Fit."""

from collections.abc import Callable, Mapping

import airmuscle as am

from ...core import AirmuscleError, Hint, HintedText
from ..requests.declaration import RequestError


def _missing(hint: Hint) -> str:
    """The field of a treatment of missing values, and that of its codes."""
    codes = ", ".join(map(str, hint.value.codes))
    choice = "interpolate short gaps" if isinstance(hint.value, am.bench.InterpolateMissing) else "leave out the rows"
    return f"select '{choice}' in the field 'Missing values'" + (
        f" and write {codes} into the field 'Codes of missing values'" if codes else ""
    )


_INSTRUCTIONS: Mapping[str, tuple[str, Callable[[Hint], str]]] = {
    "units": ("columns", lambda hint: f"select it in the table Columns, row {', '.join(map(str, hint.value))}"),
    "columns": ("columns", lambda hint: "select the quantity of each column in the table Columns"),
    "constants": ("files", lambda hint: "write it into the row of the file, in the table Files"),
    "file_name": ("file_name", lambda hint: f"write {hint.value} into the field 'Values in file names'"),
    "time": ("time", lambda hint: "select another time base"),
    "decimal": ("decimal", lambda hint: "select the decimal mark"),
    "missing": ("missing", _missing),
    "drop_outliers": ("outliers", lambda hint: "select 'leave out' in the field 'Suspected outliers'"),
    "skip_rows": ("skip_rows", lambda hint: "write it into the field 'Lines above the headings'"),
    "displacement_zero": (
        "displacement_zero",
        lambda hint: "write it into the field 'Displacement at the resting length'",
    ),
    "resting_length": ("resting_length", lambda hint: "write it into the field 'Resting length'"),
    "by": ("leave_out", lambda hint: f"select {hint.value.quantity} in the field 'Cross-validation leaves out'"),
    "leave_out": ("leave_out", lambda hint: f"select {hint.value.quantity} in the field 'Cross-validation leaves out'"),
    "bench.fit_hysteresis": ("hysteresis", lambda hint: "mark 'Friction from both branches'"),
}
"""Field and instruction by the argument of a hint, or by its function."""


def in_page_words(text: str) -> str:
    """The text with hints that name fields of the page; a hint for which the page has no field is left out."""
    if not isinstance(text, HintedText):
        return text

    def sentence(hint: Hint) -> str:
        known = _INSTRUCTIONS.get(hint.argument or hint.function)
        return f"{hint.purpose}, {known[1](hint)}." if known else ""

    return text.written(sentence)


def as_field_error(error: AirmuscleError, field: str = "") -> RequestError:
    """The error with its field: its own, that of its hint, or else `field`."""
    own = getattr(error, "field", "")
    hinted = next(
        (instruction[0] for hint in error.message.hints if (instruction := _INSTRUCTIONS.get(hint.argument))), ""
    )
    return RequestError(in_page_words(error.message), own or hinted or field)
