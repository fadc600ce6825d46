"""Readers of the fields of designs, distributions and metrics in a study file.

The unit of such a field is not fixed: it is that of the varied parameter, or of the column that a metric evaluates. A
field is therefore declared with `custom_field` and one of these readers, which receive that unit.
"""

from __future__ import annotations

import re
from typing import Any

from ...core.annotation import abridged
from ...core.errors import ParameterError
from ...files.library.location import read_finite_number

_NUMBER = re.compile(r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


def read_quantity(value: Any, unit: str, where: object) -> float:
    """A finite number in the contextual unit. Raises ParameterError or UnitError."""
    return read_finite_number(value, unit, where)


def read_difference(value: Any, unit: str, where: object) -> float:
    """A difference of two quantities, converted without the offset of its unit (degC, bara)."""
    number = read_finite_number(value, unit, where)
    return (
        number - read_finite_number(_NUMBER.sub("0", value, count=1), unit, where) if isinstance(value, str) else number
    )


def read_ratio(value: Any, unit: str, where: object) -> float:
    """A dimensionless number, or a percentage as text."""
    return read_finite_number(value, "1", where)


def read_time(value: Any, unit: str, where: object) -> float:
    """A time [s]."""
    return read_finite_number(value, "s", where)


def read_count(value: Any, unit: str, where: object) -> int:
    """A non-negative integer."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ParameterError(f"{where} is {abridged(value)}; it must be a non-negative integer.")
    return value


def read_name(value: Any, unit: str, where: object) -> str:
    """A non-empty text."""
    if not isinstance(value, str) or not value:
        raise ParameterError(f"{where} is {abridged(value)}; it must be a quoted name.")
    return value
