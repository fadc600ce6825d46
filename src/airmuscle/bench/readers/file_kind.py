"""File kind: type of a path, checked before any of its contents is read.

A pipe or a device may have no end, and the contents of a binary file are no table.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path

from ...core.errors import FileError

_SIGNATURES = (
    (b"\x89PNG", "a PNG image"), (b"\xff\xd8\xff", "a JPEG image"), (b"GIF8", "a GIF image"), (b"BM", "a BMP image"),
    (b"%PDF-", "a PDF document"), (b"\xd0\xcf\x11\xe0", "an old Office document"), (b"\x1f\x8b", "a gzip archive"),
    (b"PK\x03\x04", "a ZIP archive or an Excel workbook"), (b"BZh", "a bzip2 archive"), (b"7z\xbc\xaf", "a 7z archive"),
    (b"\xfd7zXZ", "an xz archive"), (b"Rar!", "a RAR archive"), (b"\x89HDF", "an HDF5 file"), (b"\x7fELF", "a program"),
    (b"SQLite format 3", "an SQLite database"), (b"MATLAB 7.3", "a MATLAB file"), (b"MATLAB 5.0", "a MATLAB file"),
    (b"TDSm", "a TDMS file"), (b"MDF ", "an MDF file"), (b"PAR1", "a Parquet file"), (b"\x93NUMPY", "a NumPy file"),
)  # fmt: skip
_BYTE_ORDER_MARKS = (b"\xff\xfe", b"\xfe\xff")
_CONTROL = bytes(set(range(32)) - {*b"\t\n\v\f\r\x1a\x1b"})
_KINDS = (
    (stat.S_ISDIR, "a folder"), (stat.S_ISFIFO, "a pipe"), (stat.S_ISCHR, "a device"), (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)  # fmt: skip


def check_regular_file(path: Path) -> None:
    """Raise FileError unless the path is a regular file that is not empty; the file is not opened.

    The files of the system, such as those in /proc, have a size of zero, and may have no end.
    """
    try:
        state = os.stat(path)
    except (OSError, ValueError) as reason:  # ValueError: a null character in the name
        cause = getattr(reason, "strerror", None) or reason
        raise FileError(f"{path}: cannot be read ({cause}). Check the name and the folder.") from None
    if not stat.S_ISREG(state.st_mode):
        kind = next((name for test, name in _KINDS if test(state.st_mode)), "no regular file")
        raise FileError(f"{path}: cannot be read, because it is {kind}. Pass a regular file; copy the data into one.")
    if not state.st_size:
        raise FileError(f"{path}: the file is empty.")


def check_text_file(path: Path) -> None:
    """Raise FileError unless the path is a regular file that begins with text."""
    check_regular_file(path)
    try:
        with path.open("rb") as file:
            beginning = file.read(4096)
    except OSError as reason:
        raise FileError(f"{path}: cannot be read ({reason.strerror}). Check the name and the folder.") from None
    kind = _binary_kind(beginning)
    if kind:
        raise FileError(
            f"{path.name}: the file is {kind}, not a table of text. Export the data as text (.csv), or give the file "
            "the extension of its format (.xlsx, .ods, .mat, .tdms, .mf4, .parquet, .h5)."
        )


def _binary_kind(beginning: bytes) -> str:
    """Name of the binary format of a file that begins like this; empty for text."""
    known = next((kind for signature, kind in _SIGNATURES if beginning.startswith(signature)), "")
    control = len(beginning) - len(beginning.translate(None, _CONTROL))
    if beginning[:2] in _BYTE_ORDER_MARKS or not control:
        return known if known == "a PDF document" else ""
    return known or "a binary file"
