"""Reader of a text table: `read_csv`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ...recording.recording import Recording
from .interpret import interpret
from .raw_csv import read_csv_table


def read_csv(
    path: str | Path,
    *,
    units: Mapping[str, str] | None = None,
    resting_length: float | str | None = None,
    ambient: float | str | None = None,
    specimen: str | None = None,
) -> Recording:
    """Read one text file as a Recording in SI units.

    Each column heading states the unit (`pressure [kPa]`, `p / bara`, `length_mm`), or a row of units follows the
    headings; `units` gives the units that the file does not state, by quantity or heading. Delimiter (comma,
    semicolon, tab), decimal comma, encoding and comment lines (#, %) are detected. `resting_length` L0 [m], or a text
    such as "300 mm", allows conversion between length and contraction. `ambient` is the ambient pressure [Pa], or a
    text, subtracted from absolute pressures; the default is 101.325 kPa unless the file states another value. A
    comment such as `# resting_length [mm] = 300` in the file has the same effect.

    Raises FileError, ColumnError or UnitError; the message names file, line, value and remedy.
    """
    arguments = {"resting_length": resting_length, "ambient": ambient, "specimen": specimen}
    constants = {name: value for name, value in arguments.items() if value is not None}
    return interpret(read_csv_table(path), units=units or {}, constants=constants)
