"""Reading a bench file that is text: `read_csv`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from .interpret import interpret
from .raw_csv import read_csv_table
from .recording import Recording


def read_csv(
    path: str | Path,
    *,
    units: Mapping[str, str] | None = None,
    resting_length: float | str | None = None,
    ambient: float | str | None = None,
    specimen: str | None = None,
) -> Recording:
    """A bench file as a Recording in SI units.

    Headings name each column with its unit (`pressure [kPa]`, `p / bara`, `length_mm`) or a row of units follows
    them; `units` gives those that the file does not state, by quantity or heading. Delimiter (comma, semicolon,
    tab), decimal comma, encoding and comment lines (#, %) are recognised. `resting_length` L0 (metres, or text
    such as "300 mm") turns length into contraction; `ambient` is the absolute pressure (pascal, or text) that
    absolute pressures are reduced by, 101.325 kPa unless the file says otherwise. A comment such as
    `# resting_length [mm] = 300` states the same in the file.

    Raises FileError, ColumnError or UnitError with file, line, value and remedy.
    """
    given = {"resting_length": resting_length, "ambient": ambient, "specimen": specimen}
    stated = {name: value for name, value in given.items() if value is not None}
    return interpret(read_csv_table(path), units=units or {}, constants=stated)
