"""Reader of LabVIEW measurement files (.lvm): one table for each segment of text, with the units of
its header.

National Instruments, Specification for the LabVIEW Measurement File (.lvm), version 2.0.
"""

import dataclasses
import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from ....core import ColumnError, FileError, abridged
from ..tables import (
    Cells,
    Channel,
    NumberedLines,
    RawTable,
    Selection,
    TextFormat,
    TextHeader,
    check_cell_sizes,
    has_content,
    merge_channels,
)
from .raw_csv import parse_columns, read_text

_END = "***End_of_Header***"
_X = "X_Value"
_SPECIAL = re.compile(r"\*\*\*Start_Special\*\*\*.*?\*\*\*End_Special\*\*\*", re.DOTALL)
"""Blocks that only the program that wrote them reads."""
Tags = Mapping[str, Sequence[str]]
"""The lines of a header by their first cells; a value is below the column that it describes."""


def read_lvm_tables(path: Path, selection: Selection = Selection()) -> tuple[RawTable, ...]:
    """Read one table from each segment, or from those of the numbers in `selection.group`. Raises
    FileError or ColumnError.
    """
    text = _SPECIAL.sub(lambda block: "\n" * block[0].count("\n"), read_text(path))
    lines = list(enumerate(re.split(r"\r\n|\n|\r", text), 1))
    ends = [k for k, (_, line) in enumerate(lines) if line.startswith(_END)]
    if len(ends) < 2:
        raise FileError(
            f"{path.name}: no segment of data follows the header. Check that the recording was"
            " completed."
        )
    delimiter = "," if re.search(r"^Separator\W+Comma", text, re.MULTILINE) else "\t"
    check_cell_sizes(path.name, lines)
    starts = [
        next(k for k in range(end - 1, -1, -1) if k in ends or _is_data(lines[k][1])) + 1
        for end in ends[1:]
    ]
    places = zip(starts, ends[1:], [*starts[1:], len(lines)], strict=True)
    segments = {
        str(i): (lines[a : b + 1], lines[b + 1 : c]) for i, (a, b, c) in enumerate(places, 1)
    }
    selected = selection.groups(path.name, "segment", segments)
    file_tags = _tags(lines[: ends[0]], delimiter)
    decimal = next(iter(file_tags.get("Decimal_Separator", [])[1:]), None) or None
    form = dataclasses.replace(
        selection.text_format,
        delimiter=delimiter,
        decimal=selection.text_format.decimal or decimal,
    )
    return tuple(
        _table(
            f"{path.name}, segment {i}" if len(segments) > 1 else path.name,
            _tags(head, delimiter),
            body,
            form,
        )
        for i, (head, body) in segments.items()
        if i in selected
    )


def _is_data(line: str) -> bool:
    """Whether a line belongs to the rows of a segment: it begins with a number, or with an empty
    cell.
    """
    return has_content(line) and not line[:1].isalpha()


def _tags(lines: NumberedLines, delimiter: str) -> dict[str, list[str]]:
    rows = ([cell.strip() for cell in line.split(delimiter)] for _, line in lines)
    return {row[0]: row for row in rows}


def _table(origin: str, tags: Tags, lines: NumberedLines, form: TextFormat) -> RawTable:
    assert form.delimiter is not None
    headings = [cell.strip() for cell in lines[0][1].split(form.delimiter)] if lines else []
    rows = [(i, line.split(form.delimiter)) for i, line in lines[1:] if has_content(line)]
    if not rows or _X not in headings:
        raise FileError(
            f"{origin}: no rows of data below the headings '{_X} ...'. Leave this segment out."
        )
    commented = headings.index("Comment") if "Comment" in headings else len(headings)
    width = max(i for i, name in enumerate(headings[:commented]) if name) + 1
    comment = "".join(rows[0][1][commented : commented + 1])
    body = []
    for number, cells in rows:
        filled = [*cells[:width], *[""] * (width - len(cells))]
        body.append((number, form.delimiter.join(filled)))
    header = TextHeader(tuple(headings[:width]), None, {}, form.delimiter, 0)
    columns = parse_columns(origin, header, body, form)
    channels = list(_channels(origin, tags, headings[:width], columns))
    table = merge_channels(origin, channels, {"comment": comment} if comment else {})
    if len(table.rows) == len(body):
        numbers = np.array([number for number, _ in body])
        table = dataclasses.replace(table, rows=numbers, row_label="line")
    return table


def _channels(
    origin: str, tags: Tags, headings: Sequence[str], columns: Sequence[Cells]
) -> Iterator[Channel]:
    """The channels, each with the time of the column X_Value before it, or of the increment that
    the header states.
    """

    def tag(name: str, column: int, default: str) -> str:
        return next(itertools.islice(tags.get(name, ()), column, None), "") or default

    def number(name: str, column: int, default: str) -> float:
        text = tag(name, column, default)
        try:
            return float(text.replace(",", "."))
        except ValueError:
            raise ColumnError(
                f"{origin}: {name} of '{headings[column]}' is {abridged(text)}; write a number."
            ) from None

    time: Cells = []
    for i, (name, cells) in enumerate(zip(headings, columns, strict=True)):
        if name == _X:
            time = cells
            continue
        values = cells
        if isinstance(
            cells, list
        ):  # a channel with fewer samples than others ends with empty cells
            values = cells[: max((k for k, cell in enumerate(cells, 1) if cell.strip()), default=0)]
        if isinstance(time, list):
            start = number("X0", i, "0")
            step = number("Delta_X", i, "1")
            instants = start + step * np.arange(len(values), dtype=float)
        else:
            instants = time[: len(values)]
        timed = tag("X_Dimension", i, "Time") == "Time"
        yield Channel(name, values, instants if timed else None, unit=tag("Y_Unit_Label", i, ""))
