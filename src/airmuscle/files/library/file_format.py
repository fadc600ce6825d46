"""Format of muscle files: the version that a file states, and those that this program reads."""

from collections.abc import Mapping
from typing import Any

from ...core import FileError, abridged
from .files import Location

FORMAT = 1
"""Version of the format that this program writes, the greatest that it reads."""
FORMAT_KEY = "format"


def without_format(tables: Mapping[str, Any], location: Location) -> dict[str, Any]:
    """The tables of a muscle file without its version; a file that states none has version 1.
    Raises FileError for a version that this program does not read.
    """
    version = tables.get(FORMAT_KEY, FORMAT)
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        raise FileError(
            f"{location}: format is {abridged(version)}; it must be the version of the muscle file,"
            f" an integer: {FORMAT_KEY} = {FORMAT}."
        )
    if version > FORMAT:
        raise FileError(
            f"{location}: the file has format {version}, and this program reads up to format"
            f" {FORMAT}. Install a newer airmuscle, or ask for the file in format {FORMAT}."
        )
    return {key: value for key, value in tables.items() if key != FORMAT_KEY}
