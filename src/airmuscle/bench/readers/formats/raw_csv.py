"""Reader of text tables: from bytes to an uninterpreted RawTable; large tables and streams are read
in chunks.
"""

import codecs
import itertools
import operator
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ....core import ColumnError, FileError, Hint, listed
from ....recording.recording import list_rows
from ..tables import (
    COMMA_NUMBER,
    MAX_LISTED,
    POINT_NUMBER,
    Cells,
    Decimation,
    Downsampling,
    NumberedLines,
    RawTable,
    Selection,
    TextFormat,
    TextHeader,
    check_beginning,
    check_text_file,
    downsample,
    has_content,
    is_comment,
    numbers_if_all,
    parse_header,
    readable,
    split_cells,
)
from ..tables import text_format as form
from .text_sections import sections, with_headings_of_cells

_DOTS = re.compile(r"[-+]?\d{1,3}(\.\d{3}){2,}")
"""A number with dots for thousands and for decimals, or for thousands alone."""
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}[.,]\d{3}")


Progress = Callable[[str, float], None]
"""Called with the name of a file and the fraction that has been read, 0 to 1."""


def read_csv_table(path: Path, text_format: TextFormat = TextFormat()) -> RawTable:
    """Read the table in a text file. Raises FileError or ColumnError."""
    check_text_file(path)
    tables = parse_text(path.name, read_text(path), text_format)
    if len(tables) > 1:
        raise ColumnError(
            f"{path.name}: the file contains {len(tables)} tables, each below its headings; read()"
            " gives a recording of each."
        )
    return tables[0]


def read_text_tables(
    path: Path, selection: Selection = Selection(), progress: Progress | None = None
) -> tuple[RawTable, ...]:
    """The table of a text file, a large one in chunks. Raises FileError or ColumnError."""
    check_text_file(path)
    if is_large_file(path):
        return (read_large_csv(path, selection.text_format, selection.downsampling, progress),)
    return parse_text(path.name, read_text(path), selection.text_format)


def parse_text(origin: str, text: str, text_format: TextFormat) -> tuple[RawTable, ...]:
    """The tables of a text, of which a further one begins where the headings repeat. Raises
    FileError or ColumnError.
    """
    lines = re.split(r"\r\n|\n|\r", text)
    filled = [(number, line) for number, line in enumerate(lines, 1) if has_content(line)]
    numbered = with_headings_of_cells(filled)
    header = parse_header(origin, numbered, text_format)
    body = [(number, line) for number, line in numbered if not is_comment(line)]
    parts = sections(body, header.headings, header.delimiter)
    if len(parts) > 1:
        tables = []
        for number, part in enumerate(parts, 1):
            title = part.title or f"table {number}"
            tables.append(_table_of(f"{origin}, {title}", part.lines, text_format))
        return tuple(tables)
    if not parts[0].note:
        rows = body[header.header_lines :]
        cells = parse_columns(origin, header, rows, text_format)
        return (header.table(origin, cells, [number for number, _ in rows]),)
    comments = [(number, line) for number, line in numbered if is_comment(line)]
    complete = sorted([*comments, *parts[0].lines], key=operator.itemgetter(0))
    table = _table_of(origin, complete, text_format)
    return (table.noted(parts[0].note),)


def _table_of(origin: str, numbered: NumberedLines, text_format: TextFormat) -> RawTable:
    """The table of the lines of one table, with comments."""
    header = parse_header(origin, numbered, text_format)
    lines = [(number, line) for number, line in numbered if not is_comment(line)]
    body = lines[header.header_lines :]
    cells = parse_columns(origin, header, body, text_format)
    numbers = [number for number, _ in body]
    return header.table(origin, cells, numbers)


def _header_and_body(
    origin: str, lines: list[str], text_format: TextFormat
) -> tuple[TextHeader, NumberedLines]:
    """The header, and the lines below it that are no comments."""
    numbered = [(i, line) for i, line in enumerate(lines, 1) if has_content(line)]
    header = parse_header(origin, numbered, text_format)
    return (
        header,
        [(i, line) for i, line in numbered if not is_comment(line)][header.header_lines :],
    )


def read_text(path: Path) -> str:
    """The text of a file. Raises FileError."""
    with readable(path):
        content = path.read_bytes()
    if not content.strip():
        raise FileError(f"{path}: the file is empty.")
    return content.decode(form.detect_encoding(content), errors="replace")


def parse_columns(
    origin: str, header: TextHeader, body: NumberedLines, text_format: TextFormat
) -> tuple[Cells, ...]:
    """The columns, from a fast parser if every cell is a number, otherwise cell by cell. Raises
    ColumnError.
    """
    comma = (
        text_format.decimal != "."
        and header.delimiter != ","
        and any("," in line for _, line in body)
    )
    lines = [line.replace(",", ".") if comma else line for _, line in body]
    separator = None if header.delimiter == " " else header.delimiter
    try:
        numbers = np.loadtxt(lines, delimiter=separator, comments=None, ndmin=2, quotechar='"')
    except ValueError:
        numbers = np.empty(
            (0, 0)
        )  # a text, an empty cell or a ragged row: `_parse_by_cell` reports the line
    ambiguous = (comma or text_format.decimal == ",") and any("." in line for _, line in body)
    if ambiguous or numbers.shape != (len(body), len(header.headings)):
        return _parse_by_cell(origin, header, body, text_format.decimal)
    return tuple(np.ascontiguousarray(column) for column in numbers.T)


def _parse_by_cell(
    origin: str, header: TextHeader, body: NumberedLines, decimal: str | None
) -> tuple[Cells, ...]:
    width = len(header.headings)
    rows = list[list[str]]()
    for number, line in body:  # each line is checked before the next is split: most may be no table
        row = split_cells(line, header.delimiter)
        if len(row) < width or any(row[width:]):
            hint = " If the comma is a decimal comma, separate the columns by ';' or tab."
            raise ColumnError(
                f"{origin}, line {number}: the line must have {width} cells"
                f" ({listed(header.headings)}); it has"
                f" {len(row)}.{hint if header.delimiter == ',' else ''} Start lines that are not"
                " part of the table with '#'."
            )
        rows.append(row)
    decimal = decimal or _sign_beside_thousands(rows, header.delimiter)
    _check_decimal_sign(origin, body, rows, decimal)
    return tuple(
        numbers_if_all([_with_decimal_point(row[i], decimal) for row in rows]) for i in range(width)
    )


_GROUPED = {
    ",": re.compile(r"[-+]?\d{1,3}(\.\d{3})+,\d*"),
    ".": re.compile(r"[-+]?\d{1,3}(,\d{3})+\.\d*"),
}
"""Numbers with separated thousands, by their decimal sign."""


def _sign_beside_thousands(rows: list[list[str]], delimiter: str) -> str | None:
    """The decimal sign where numbers such as `1.300,00` show it, and no number contradicts them;
    None elsewhere.
    """
    if delimiter == "," or not rows:
        return None
    for sign, grouped in _GROUPED.items():
        other = POINT_NUMBER if sign == "," else COMMA_NUMBER
        is_shown = False
        is_contradicted = False
        for column in range(len(rows[0])):
            cells = [row[column] for row in rows if column < len(row)]
            other_cells = [cell for cell in cells if other.fullmatch(cell)]
            shows = any(map(grouped.fullmatch, cells))
            is_shown = is_shown or shows
            all_thousands = all(map(_THOUSANDS.fullmatch, other_cells))
            is_contradicted = is_contradicted or not (all_thousands and (shows or not other_cells))
        if is_shown and not is_contradicted:
            return sign
    return None


def _with_decimal_point(cell: str, decimal: str | None) -> str:
    """A number with a decimal point; if the decimal sign is given, the other sign separates
    thousands.
    """
    if decimal is None:
        return cell.replace(",", ".") if COMMA_NUMBER.fullmatch(cell) else cell
    if decimal == "." and _DOTS.fullmatch(cell):  # the last dot is the decimal point
        cell = cell[::-1].replace(".", "_", 1).replace(".", "").replace("_", ".")[::-1]
    thousands = "." if decimal == "," else ","
    plain = cell.replace(thousands, "").replace(",", ".")
    return plain if re.fullmatch(r"[-+]?[\d.]+(?:[eE][-+]?\d+)?", plain) else cell


def _check_decimal_sign(
    origin: str, body: NumberedLines, rows: list[list[str]], decimal: str | None
) -> None:
    """Raise ColumnError where the sign that is not the stated decimal sign cannot separate
    thousands, as in `0.5`. If none is stated, both signs must not occur: next to `0.5`, the comma
    in `1,234` may separate thousands.
    """

    def matching(sign: re.Pattern[str]) -> Iterator[tuple[int, str]]:
        return (
            (i, cell)
            for (i, _), row in zip(body, rows, strict=True)
            for cell in row
            if sign.fullmatch(cell)
        )

    suspect_cells = matching(POINT_NUMBER if decimal == "," else COMMA_NUMBER)
    ambiguous_cells = [
        (i, cell) for i, cell in suspect_cells if not (decimal and _THOUSANDS.fullmatch(cell))
    ]
    if not ambiguous_cells:
        return
    line, cell = ambiguous_cells[0]
    lines = list(dict.fromkeys(line for line, _ in ambiguous_cells))
    further = (
        f"; there are {len(ambiguous_cells)} such cells ({list_rows('line', lines, MAX_LISTED)})"
        if len(ambiguous_cells) > 1
        else ""
    )
    if decimal:
        raise ColumnError(
            f"{origin}, line {line}: '{cell}' contradicts the decimal sign '{decimal}', which is"
            f" stated: the other sign separates groups of three digits{further}. Correct the"
            " decimal sign or the numbers."
        )
    for point, example in matching(POINT_NUMBER):
        raise ColumnError(
            f"{origin}, line {line}: the comma in '{cell}' is ambiguous, because line {point}"
            f" contains a decimal point ('{example}'){further}. Write all numbers with the same"
            " decimal sign and without thousands separators.",
            hint=Hint("To specify the decimal sign", "decimal", ",", function="ColumnMapping"),
        )


LARGE_FILE_BYTES = 4_000_000
"""Files larger than this are read in chunks, in a separate process (chosen: as a whole, such a file
of lines of one digit takes 0.4 GB and 3 s, measured; in chunks, ten times as much takes 0.2 GB)."""
LONGEST_LINE = 10_000_000
"""Most characters of a line of a stream (chosen; a file of 100 000 columns has a tenth)."""
_HEADER_BYTES = 65_536
_CHUNK_ROWS = 100_000


def is_large_file(path: Path) -> bool:
    """Whether a file is read in chunks."""
    return path.is_file() and path.stat().st_size > LARGE_FILE_BYTES


def read_large_csv(
    path: Path,
    text_format: TextFormat,
    downsampling: Downsampling,
    progress: Progress | None = None,
) -> RawTable:
    """The table in a large text file, with at most `downsampling.max_rows` rows; a note reports a
    reduction. With Decimation, the lines between the kept rows are not parsed. Raises FileError or
    ColumnError."""
    with path.open("rb") as file:
        beginning = file.read(_HEADER_BYTES)
    encoding = form.detect_encoding(beginning)
    first, header = _read_header(path.name, beginning, encoding, text_format)
    total = _count_lines(path) - first + 1
    step = downsampling.step(total)
    stride = step if isinstance(downsampling, Decimation) else 1
    columns: list[tuple[Cells, ...]] = []
    rows: list[int] = []
    size = (
        max(_CHUNK_ROWS // step, 1) * step // stride
    )  # complete blocks of `step` lines, every `stride`-th one
    with path.open(encoding=encoding, errors="replace") as text:
        numbered = zip(
            itertools.count(first, stride), itertools.islice(text, first - 1, None, stride)
        )
        while lines := list(itertools.islice(numbered, size)):
            chunk = [(i, line) for i, line in lines if has_content(line) and not is_comment(line)]
            if not chunk:
                continue
            cells = parse_columns(path.name, header, chunk, text_format)
            columns.append(
                cells if stride == step else tuple(downsampling.reduce(c, step) for c in cells)
            )
            rows += [line for line, _ in chunk][:: step // stride]
            if progress:
                progress(path.name, min(1.0, (rows[-1] - first + 1) / total))
    return header.table(
        path.name, _joined(columns), rows, (downsampling.note(total, step),) if step > 1 else ()
    )


def read_text_stream(
    stream: BinaryIO,
    origin: str,
    text_format: TextFormat = TextFormat(),
    downsampling: Downsampling = Decimation(),
) -> RawTable:
    """The table in a stream, such as a pipe, which is read once to its end and has an unknown
    length. With Decimation, one row in 2, 4, 8, ... is kept as soon as there are more. Raises
    FileError or ColumnError."""
    beginning = stream.read(_HEADER_BYTES)
    if not beginning.strip():
        raise FileError(f"{origin}: it contains nothing. Check the program that writes to it.")
    check_beginning(origin, beginning)
    encoding = form.detect_encoding(beginning)
    if len(beginning) < _HEADER_BYTES:
        return downsample(
            parse_text(origin, beginning.decode(encoding, errors="replace"), text_format)[0],
            downsampling,
        )
    first, header = _read_header(origin, beginning, encoding, text_format)
    blocks = itertools.chain([beginning], iter(lambda: stream.read(1 << 20), b""))
    text = codecs.iterdecode(blocks, encoding, errors="replace")
    lines = enumerate(_split_lines(origin, text), 1)
    body = (
        (i, line) for i, line in lines if i >= first and has_content(line) and not is_comment(line)
    )
    parts = list[tuple[Cells, ...]]()
    rows = list[int]()
    stride = 1
    total = 0
    while chunk := list(itertools.islice(body, _CHUNK_ROWS)):
        sampled_lines = chunk[-total % stride :: stride]
        total += len(chunk)
        if not sampled_lines:
            continue
        parts.append(parse_columns(origin, header, sampled_lines, text_format))
        rows += [line for line, _ in sampled_lines]
        while isinstance(downsampling, Decimation) and len(rows) > downsampling.max_rows:
            parts = [tuple(column[::2] for column in _joined(parts))]
            rows = rows[::2]
            stride = 2 * stride
    notes = (downsampling.note(total, stride),) if stride > 1 else ()
    return downsample(header.table(origin, _joined(parts), rows, notes), downsampling)


def _split_lines(origin: str, blocks: Iterable[str]) -> Iterator[str]:
    rest = ""
    for block in blocks:
        *lines, rest = f"{rest}{block}".split("\n")
        yield from (line.removesuffix("\r") for line in lines)
        if len(rest) > LONGEST_LINE:
            raise FileError(
                f"{origin}: a line has more than {LONGEST_LINE} characters. It is no table."
            )
    yield rest


def _read_header(
    origin: str, beginning: bytes, encoding: str, text_format: TextFormat
) -> tuple[int, TextHeader]:
    """The line number of the first row of numbers, and the header above it."""
    lines = beginning.decode(encoding, errors="replace").splitlines()[
        :-1
    ]  # the last line may be incomplete
    header, body = _header_and_body(origin, lines, text_format)
    return body[0][0], header


def _count_lines(path: Path) -> int:
    """The number of lines, including a last line without line break."""
    count = 0
    last = b""
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            count += block.count(b"\n")
            last = block
    return count + (not last.endswith((b"\n", b"\n\0", b"\0\n")))


def _joined(chunks: list[tuple[Cells, ...]]) -> tuple[Cells, ...]:
    """The columns from their chunks: numbers if all chunks contain numbers, texts otherwise."""
    columns: list[Cells] = []
    for parts in zip(*chunks, strict=True):
        numbers = [part for part in parts if not isinstance(part, list)]
        if len(numbers) == len(parts):
            columns.append(np.concatenate(numbers))
            continue
        texts = list[str]()
        for part in parts:
            texts += part if isinstance(part, list) else map(repr, part.tolist())
        columns.append(texts)
    return tuple(columns)
