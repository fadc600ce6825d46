"""Writer of a Recording as CSV; reading the file again returns bit-identical numbers."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import TextIO

from ...core.annotation import abridged, one_line
from ...core.atomic_output import atomic_file
from ...core.errors import FileError, ParameterError
from ...recording.recording import Recording, column_heading
from .constants import CONSTANT_UNITS


def write_csv(recording: Recording, path: str | Path, *, comments: bool = True) -> Path:
    """Write a recording in SI units and return the path.

    The column headings state the units; comments above them state origin, constants and notes. Without `comments` the
    file has the headings and the rows alone, as other programs expect it (`pandas.read_csv(path)`); constants and notes
    are then not in it. The file is replaced atomically: an existing file remains unchanged if writing fails. Raises
    FileError or ParameterError.
    """
    if not isinstance(recording, Recording):
        raise ParameterError(
            f"write_csv: {one_line(recording)} is not a Recording. Pass the result of simulate, read or read_csv."
        )
    if not isinstance(path, str | Path):
        raise FileError(f"write_csv: {abridged(path)} is not a path. Pass the name of a file.")
    path = Path(path)
    try:
        with atomic_file(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
            if comments:
                _write_comments(recording, file)
            _write_table(recording, file)
    except OSError as reason:
        raise FileError(
            f"{path}: cannot be written ({reason.strerror or reason}). Choose an existing folder with write permission."
        ) from None
    return path


def _write_comments(recording: Recording, file: TextIO) -> None:
    file.write(f"# {_one_line(recording.origin)}\n")
    for name, value in recording.constants.items():
        unit = f" [{CONSTANT_UNITS[name]}]" if name in CONSTANT_UNITS else ""
        file.write(f"# {name}{unit} = {json.dumps(value, ensure_ascii=False)}\n")
    for note in recording.notes:
        file.write(f"# Note: {_one_line(note)}\n")


def _write_table(recording: Recording, file: TextIO) -> None:
    table = csv.writer(file, lineterminator="\n")
    table.writerow([column_heading(name) for name in recording])
    table.writerows(zip(*(recording[name].tolist() for name in recording), strict=True))


def _one_line(text: str) -> str:
    return " ".join(text.split())
