"""Writing a Recording so that reading it again gives the same numbers to the last digit."""

from __future__ import annotations

import csv
import json
import os
from pathlib import Path
from typing import TextIO

from ..core.errors import FileError, ParameterError
from .recording import Recording, column_heading

_UNITS = {"resting_length": "m", "ambient": "Pa"}


def write_csv(recording: Recording, path: str | Path) -> Path:
    """Write a recording in SI units; headings carry the units, comments above them origin, constants and notes.

    The file appears whole or not at all, and an older one stays until then. Raises FileError.
    """
    if not isinstance(recording, Recording):
        raise ParameterError(f"write_csv: {str(recording)[:80]} is no Recording, as simulate and read_csv return it.")
    if not isinstance(path, str | Path):
        raise FileError(f"write_csv: {path!r} is no path; name a file.")
    path = Path(path)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with unfinished.open("w", encoding="utf-8", newline="") as file:
            _write(recording, file)
        unfinished.replace(path)
    except OSError as reason:
        raise FileError(
            f"{path}: cannot be written ({reason.strerror or reason}). Choose a folder that exists and is open to you."
        ) from None
    finally:
        _discard(unfinished)
    return path


def _write(recording: Recording, file: TextIO) -> None:
    file.write(f"# {_one_line(recording.origin)}\n")
    for name, value in recording.constants.items():
        unit = f" [{_UNITS[name]}]" if name in _UNITS else ""
        file.write(f"# {name}{unit} = {json.dumps(value, ensure_ascii=False)}\n")
    for note in recording.notes:
        file.write(f"# Note: {_one_line(note)}\n")
    table = csv.writer(file, lineterminator="\n")
    table.writerow([column_heading(name) for name in recording])
    table.writerows(zip(*(recording[name].tolist() for name in recording), strict=True))


def _one_line(text: str) -> str:
    return " ".join(text.split())


def _discard(unfinished: Path) -> None:
    try:
        unfinished.unlink()
    except OSError:
        return  # it was renamed, or never begun
