"""Large text tables and streams, read in chunks and downsampled while reading, so that memory use is bounded."""

from __future__ import annotations

import codecs
import itertools
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ...core.errors import FileError
from .downsampling import Decimation, Downsampling, downsample
from .file_kind import check_beginning
from .raw_csv import parse_columns, parse_text
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
    return RawTable(
        path.name,
        header.headings,
        header.units,
        _joined(columns),
        np.array(rows),
        constants=header.constants,
        notes=notes,
    )


def read_text_stream(
    stream: BinaryIO,
    origin: str,
    text_format: TextFormat = TextFormat(),
    downsampling: Downsampling = Decimation(),
) -> RawTable:
    """The table in a stream, such as a pipe, which is read once to its end and has an unknown length.

    With Decimation, one row in 2, 4, 8, ... is kept as soon as more than `max_rows` rows have been read. Raises
    FileError or ColumnError.
    """
    beginning = stream.read(_HEADER_BYTES)
    if not beginning.strip():
        raise FileError(f"{origin}: it contains nothing. Check the program that writes to it.")
    check_beginning(origin, beginning)
    encoding = detect_encoding(beginning)
    if len(beginning) < _HEADER_BYTES:
        return downsample(parse_text(origin, beginning.decode(encoding, errors="replace"), text_format), downsampling)
    first, header = _read_header(origin, beginning, encoding, text_format)
    blocks = itertools.chain([beginning], iter(lambda: stream.read(1 << 20), b""))
    lines = enumerate(_split_lines(codecs.iterdecode(blocks, encoding, errors="replace")), 1)
    body = ((i, line) for i, line in lines if i >= first and has_content(line) and not is_comment(line))
    parts, rows, stride, total = list[tuple[Cells, ...]](), list[int](), 1, 0
    while chunk := list(itertools.islice(body, _CHUNK_ROWS)):
        kept = chunk[-total % stride :: stride]
        total += len(chunk)
        if not kept:
            continue
        parts.append(parse_columns(origin, header, kept, text_format))
        rows += [line for line, _ in kept]
        while isinstance(downsampling, Decimation) and len(rows) > downsampling.max_rows:
            parts, rows, stride = [tuple(each[::2] for each in _joined(parts))], rows[::2], 2 * stride
    notes = (downsampling.note(total, stride),) if stride > 1 else ()
    table = RawTable(
        origin, header.headings, header.units, _joined(parts), np.array(rows), constants=header.constants, notes=notes
    )
    return downsample(table, downsampling)


def _split_lines(blocks: Iterable[str]) -> Iterator[str]:
    rest = ""
    for block in blocks:
        *lines, rest = f"{rest}{block}".split("\n")
        yield from (line.removesuffix("\r") for line in lines)
    yield rest


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


def _joined(chunks: list[tuple[Cells, ...]]) -> tuple[Cells, ...]:
    return tuple(_concatenate(list(parts)) for parts in zip(*chunks, strict=True))


def _concatenate(parts: list[Cells]) -> Cells:
    """One column from its chunks: numbers if all chunks contain numbers, texts otherwise."""
    numbers = [part for part in parts if not isinstance(part, list)]
    if len(numbers) == len(parts):
        return np.concatenate(numbers)
    return [cell for part in parts for cell in (part if isinstance(part, list) else map(repr, part.tolist()))]
