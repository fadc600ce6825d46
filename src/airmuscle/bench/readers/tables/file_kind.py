"""File kind: type of a path, checked before any of its contents is read; and the reading of TOML.

A pipe or a device may have no end, and the contents of a binary file are no table.
"""

import contextlib
import os
import re
import stat
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ....core import FileError

_SIGNATURES = (
    (b"\x89PNG", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"GIF8", "a GIF image"),
    (b"BM", "a BMP image"),
    (b"%PDF-", "a PDF document"),
    (b"\xd0\xcf\x11\xe0", "an old Office document"),
    (b"\x1f\x8b", "a gzip archive"),
    (b"PK\x03\x04", "a ZIP archive or an Excel workbook"),
    (b"BZh", "a bzip2 archive"),
    (b"7z\xbc\xaf", "a 7z archive"),
    (b"\xfd7zXZ", "an xz archive"),
    (b"Rar!", "a RAR archive"),
    (b"\x89HDF", "an HDF5 file"),
    (b"\x7fELF", "a program"),
    (b"SQLite format 3", "an SQLite database"),
    (b"MATLAB 7.3", "a MATLAB file"),
    (b"MATLAB 5.0", "a MATLAB file"),
    (b"TDSm", "a TDMS file"),
    (b"MDF ", "an MDF file"),
    (b"PAR1", "a Parquet file"),
    (b"\x93NUMPY", "a NumPy file"),
    (b"\x80\x02", "a Python pickle"),
    (b"\x80\x03", "a Python pickle"),
    (b"\x80\x04", "a Python pickle"),
    (b"\x80\x05", "a Python pickle"),
)
_ARCHIVES = (
    "a gzip archive",
    "a bzip2 archive",
    "a 7z archive",
    "an xz archive",
    "a RAR archive",
)
_PICTURES = ("a PNG image", "a JPEG image", "a GIF image", "a BMP image", "a PDF document")
_REMEDIES = {
    _ARCHIVES: "Unpack it, and read the files inside.",
    _PICTURES: "Read the numbers off it, or ask its authors for them.",
    ("a Python pickle",): (
        "It is not read, because it may run code. In the program that wrote it, use"
        " DataFrame.to_csv or to_parquet, or numpy.savez."
    ),
}
"""What to do with a file of a kind that contains no table."""
_NO_DATA = (
    (
        b"version https://git-lfs.github.com/spec/",
        "a pointer of Git LFS in place of the data. Fetch them in the repository: git lfs pull",
    ),
    (
        b"<!doctype html",
        "a page of HTML, such as the answer of a failed download. Download it again",
    ),
    (b"<html", "a page of HTML, such as the answer of a failed download. Download it again"),
)
"""First bytes, in lower case, of what is stored under the name of a file of data by mistake."""
_BYTE_ORDER_MARKS = (b"\xff\xfe", b"\xfe\xff", b"\0\0\xfe\xff")
_CONTROL = bytes(set(range(32)) - {*b"\t\n\v\f\r\x1a\x1b"})
_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)

MAX_TOML = 4_000_000
MAX_KEYS = 50
"""Maximum size of a TOML file [bytes], and parts of a key (chosen): the parser takes the square of
the latter.
"""
_DEEP_KEY = re.compile(r"(?<![\w-])(?:[\w-]+[ \t]*\.[ \t]*)" + f"{{{MAX_KEYS}}}")


def check_regular_file(path: Path) -> None:
    """Raise FileError unless the path is a regular file that is not empty; the file is not opened.
    The files of the system, such as those in /proc, have a size of zero, and may have no end."""
    try:
        state = os.stat(path)
    except (OSError, ValueError) as reason:  # ValueError: a null character in the name
        cause = getattr(reason, "strerror", None) or reason
        raise FileError(
            f"{path}: cannot be read ({cause}). Check the name and the folder."
        ) from None
    if not stat.S_ISREG(state.st_mode):
        kind = next((name for test, name in _KINDS if test(state.st_mode)), "no regular file")
        raise FileError(
            f"{path}: cannot be read, because it is {kind}. Pass a regular file; copy the data into"
            " one."
        )
    if not state.st_size:
        raise FileError(f"{path}: the file is empty.")


@contextlib.contextmanager
def readable(path: object) -> Iterator[None]:
    """Raise FileError where the system refuses what is done with the file in this context."""
    try:
        yield
    except OSError as reason:
        raise FileError(
            f"{path}: cannot be read ({reason.strerror}). Check the name and the folder."
        ) from None


def read_toml(path: Path) -> dict[str, Any]:
    """The tables of a TOML file. Raises FileError if it cannot be read or is not valid TOML."""
    check_regular_file(path)
    if path.stat().st_size > MAX_TOML:
        raise FileError(
            f"{path}: the file has more than {MAX_TOML} bytes. Write its numbers to a data file."
        )
    try:
        with readable(path):
            return parse_toml(path.read_text(encoding="utf-8-sig"), str(path))
    except UnicodeDecodeError as error:
        raise FileError(
            f"{path}: is not UTF-8 text (byte {error.start}). Save it as UTF-8."
        ) from None


def parse_toml(text: str, origin: str) -> dict[str, Any]:
    """The tables of a TOML text. Raises FileError if it is not valid; `origin` begins the
    message.
    """
    if _DEEP_KEY.search(text):
        raise FileError(f"{origin}: a key has more than {MAX_KEYS} parts between dots.")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise FileError(f"{origin}: is not valid TOML: {error}.") from None
    except (
        ValueError,
        RecursionError,
    ) as error:  # an integer of thousands of digits, or brackets in brackets
        raise FileError(f"{origin}: cannot be read ({error}).") from None


def check_is_data(path: Path) -> None:
    """Raise FileError for a file that another program wrote in place of the data."""
    with readable(path), path.open("rb") as file:
        beginning = file.read(64).lstrip(b"\xef\xbb\xbf \t\r\n").lower()
    for signature, what in _NO_DATA:
        if beginning.startswith(signature):
            raise FileError(f"{path.name}: the file is {what}.")


def check_text_file(path: Path) -> None:
    """Raise FileError unless the path is a regular file that begins with text."""
    check_regular_file(path)
    check_is_data(path)
    with readable(path), path.open("rb") as file:
        check_beginning(path.name, file.read(4096))


def is_text(beginning: bytes) -> bool:
    """Whether the first bytes of a file are those of a text with several lines."""
    has_control = len(beginning) != len(beginning.translate(None, _CONTROL))
    is_marked = beginning.startswith(_BYTE_ORDER_MARKS)
    return is_marked or (not has_control and b"\n" in beginning and b"\xff" not in beginning)


def check_beginning(origin: str, beginning: bytes) -> None:
    """Raise FileError if the first bytes are not those of a text."""
    known = next((kind for signature, kind in _SIGNATURES if beginning.startswith(signature)), "")
    has_control = len(beginning) != len(beginning.translate(None, _CONTROL))
    is_binary = has_control and not beginning.startswith(_BYTE_ORDER_MARKS)
    kind = (known or "a binary file") if is_binary else known if known == "a PDF document" else ""
    remedy = next((text for names, text in _REMEDIES.items() if kind in names), "")
    if kind and remedy:
        raise FileError(f"{origin}: the file is {kind}, not a table of text. {remedy}")
    if kind:
        raise FileError(
            f"{origin}: the file is {kind}, not a table of text. Export the data as text (.csv), or"
            " give the file the extension of its format (.xlsx, .ods, .mat, .tdms, .mf4, .parquet,"
            " .h5)."
        )
