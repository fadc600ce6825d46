"""Text tables too large to hold at once: read in pieces, thinned as they come, so that memory stays bounded."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from .raw_csv import parse_columns
from .table import Cells, RawTable
from .text_format import NumberedLines, TextFormat, TextHeader, detect_encoding, parse_header, has_content, is_comment
from .downsampling import Decimation, Downsampling

LARGE_FILE_BYTES = 32_000_000
"""Files of more bytes than this are read in pieces (chosen: below it, the whole text fits anywhere)."""
_HEADER_BYTES = 65_536
_CHUNK_ROWS = 100_000

Progress = Callable[[str, float], None]
"""Called with a file's name and the part of it that is read, 0 to 1."""


def is_large_file(path: Path) -> bool:
    """Whether a file is to be read in pieces."""
    return path.is_file() and path.stat().st_size > LARGE_FILE_BYTES


def read_large_csv(
    path: Path,
    form: TextFormat = TextFormat(),
    thinning: Downsampling = Decimation(),
    progress: Progress | None = None,
) -> RawTable:
    """The table in a large text file, with no more rows than the thinning allows, which a note says.

    Under a Decimation the lines between those kept are not even parsed. Raises FileError or ColumnError.
    """
    with path.open("rb") as file:
        beginning = file.read(_HEADER_BYTES)
    encoding = detect_encoding(beginning)
    first, head = _read_header(path.name, beginning, encoding, form)
    total = _count_lines(path) - first + 1
    step = thinning.step(total)
    read_each = step if isinstance(thinning, Decimation) else 1
    columns: list[tuple[Cells, ...]] = []
    rows: list[int] = []
    for piece in _read_chunks(path, encoding, first, read_each, step):
        cells = parse_columns(path.name, head, piece, form)
        columns.append(cells if read_each == step else tuple(thinning.column(c, step) for c in cells))
        rows += [line for line, _ in piece][:: step // read_each]
        if progress:
            progress(path.name, min(1.0, (rows[-1] - first + 1) / total))
    notes = (thinning.note(total, step),) if step > 1 else ()
    joined = tuple(_concatenate(list(parts)) for parts in zip(*columns, strict=True))
    return RawTable(path.name, head.headings, head.units, joined, np.array(rows), constants=head.constants, notes=notes)


def _read_header(origin: str, beginning: bytes, encoding: str, form: TextFormat) -> tuple[int, TextHeader]:
    """The number of the first line of numbers, and what stands above it."""
    text = beginning.decode(encoding, errors="replace").splitlines()[:-1]  # the last one may be cut
    lines = [(i, line) for i, line in enumerate(text, 1) if has_content(line)]
    head = parse_header(origin, lines, form)
    body = [i for i, line in lines if not is_comment(line)]
    return body[head.header_lines], head


def _count_lines(path: Path) -> int:
    """The number of lines; the last may lack its end."""
    count, last = 0, b""
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            count += block.count(b"\n")
            last = block
    return count + (not last.endswith((b"\n", b"\n\0", b"\0\n")))


def _read_chunks(path: Path, encoding: str, first: int, read_each: int, step: int) -> Iterator[NumberedLines]:
    """The lines from the first of numbers on, one in `read_each`, in pieces of whole blocks of `step`."""
    size = max(_CHUNK_ROWS // step, 1) * step // read_each
    with path.open(encoding=encoding, errors="replace") as file:
        numbered = zip(itertools.count(first, read_each), itertools.islice(file, first - 1, None, read_each))
        while taken := list(itertools.islice(numbered, size)):
            piece = [(i, line) for i, line in taken if has_content(line) and not is_comment(line)]
            if piece:
                yield piece


def _concatenate(parts: list[Cells]) -> Cells:
    """One column from its pieces: numbers if all of them are, else texts."""
    numbers = [part for part in parts if not isinstance(part, list)]
    if len(numbers) == len(parts):
        return np.concatenate(numbers)
    return [cell for part in parts for cell in (part if isinstance(part, list) else map(repr, part.tolist()))]
