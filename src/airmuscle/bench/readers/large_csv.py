"""Large text tables, read in chunks and downsampled while reading, so that memory use is bounded."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from .downsampling import Decimation, Downsampling
from .raw_csv import parse_columns
from .table import Cells, RawTable
from .text_format import NumberedLines, TextFormat, TextHeader, detect_encoding, has_content, is_comment, parse_header

LARGE_FILE_BYTES = 32_000_000
"""Files larger than this are read in chunks (chosen: a smaller file fits any memory as a whole)."""
_HEADER_BYTES = 65_536
_CHUNK_ROWS = 100_000

Progress = Callable[[str, float], None]
"""Called with the name of a file and the fraction that has been read, 0 to 1."""


def is_large_file(path: Path) -> bool:
    """Whether a file is read in chunks."""
    return path.is_file() and path.stat().st_size > LARGE_FILE_BYTES


def read_large_csv(
    path: Path,
    text_format: TextFormat = TextFormat(),
    downsampling: Downsampling = Decimation(),
    progress: Progress | None = None,
) -> RawTable:
    """The table in a large text file, with at most `downsampling.max_rows` rows; a note reports a reduction.

    With Decimation, the lines between the kept rows are not parsed. Raises FileError or ColumnError.
    """
    with path.open("rb") as file:
        beginning = file.read(_HEADER_BYTES)
    encoding = detect_encoding(beginning)
    first, header = _read_header(path.name, beginning, encoding, text_format)
    total = _count_lines(path) - first + 1
    step = downsampling.step(total)
    stride = step if isinstance(downsampling, Decimation) else 1
    columns: list[tuple[Cells, ...]] = []
    rows: list[int] = []
    for chunk in _read_chunks(path, encoding, first, stride, step):
        cells = parse_columns(path.name, header, chunk, text_format)
        columns.append(cells if stride == step else tuple(downsampling.reduce(c, step) for c in cells))
        rows += [line for line, _ in chunk][:: step // stride]
        if progress:
            progress(path.name, min(1.0, (rows[-1] - first + 1) / total))
    notes = (downsampling.note(total, step),) if step > 1 else ()
    joined = tuple(_concatenate(list(parts)) for parts in zip(*columns, strict=True))
    return RawTable(
        path.name, header.headings, header.units, joined, np.array(rows), constants=header.constants, notes=notes
    )


def _read_header(origin: str, beginning: bytes, encoding: str, text_format: TextFormat) -> tuple[int, TextHeader]:
    """The line number of the first row of numbers, and the header above it."""
    text = beginning.decode(encoding, errors="replace").splitlines()[:-1]  # the last line may be incomplete
    lines = [(i, line) for i, line in enumerate(text, 1) if has_content(line)]
    header = parse_header(origin, lines, text_format)
    body = [i for i, line in lines if not is_comment(line)]
    return body[header.header_lines], header


def _count_lines(path: Path) -> int:
    """The number of lines, including a last line without line break."""
    count, last = 0, b""
    with path.open("rb") as file:
        while block := file.read(1 << 20):
            count += block.count(b"\n")
            last = block
    return count + (not last.endswith((b"\n", b"\n\0", b"\0\n")))


def _read_chunks(path: Path, encoding: str, first: int, stride: int, step: int) -> Iterator[NumberedLines]:
    """The lines from line `first` on, every `stride`-th one, in chunks of complete blocks of `step` lines."""
    size = max(_CHUNK_ROWS // step, 1) * step // stride
    with path.open(encoding=encoding, errors="replace") as file:
        numbered = zip(itertools.count(first, stride), itertools.islice(file, first - 1, None, stride))
        while lines := list(itertools.islice(numbered, size)):
            chunk = [(i, line) for i, line in lines if has_content(line) and not is_comment(line)]
            if chunk:
                yield chunk


def _concatenate(parts: list[Cells]) -> Cells:
    """One column from its chunks: numbers if all chunks contain numbers, texts otherwise."""
    numbers = [part for part in parts if not isinstance(part, list)]
    if len(numbers) == len(parts):
        return np.concatenate(numbers)
    return [cell for part in parts for cell in (part if isinstance(part, list) else map(repr, part.tolist()))]
