"""Proposed declaration of a folder: its muscle file, its records with their hashes, and question
marks for what only a person knows.
"""

import hashlib
from pathlib import Path

from ...bench.readers import Source, find_files
from ...core import AirmuscleError, FileError
from ...files.library import kind_of, read_toml
from .declaration import DECLARATION, OPEN, RIG, Submission, SubmittedRecord

BLOCK = 1 << 20
"""Bytes that are read at once."""
REPORT_FOLDER = "report"
"""Folder of the report below that of the contribution, whose files are no records."""


def propose_submission(folder: Path) -> Submission:
    """The declaration of a folder without one. Raises FileError for a folder without records."""
    if not folder.is_dir():
        raise FileError(
            f"{folder}: there is no such folder. Make one with the muscle file and its records."
        )
    records = _records_in(folder)
    if not records:
        raise FileError(
            f"{folder}: the folder has no records. Put the muscle file and the raw records into it,"
            " or write their SHA-256 and address into submission.toml."
        )
    return Submission(
        folder, muscle=_muscle_file(folder), rig=dict.fromkeys(RIG, OPEN), records=records
    )


def sha256_of(path: Path) -> str:
    """SHA-256 of the bytes of a file, 64 hexadecimal digits."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(BLOCK):
            digest.update(block)
    return digest.hexdigest()


def _records_in(folder: Path) -> tuple[SubmittedRecord, ...]:
    folders: list[Source] = [folder]
    folders += sorted(
        path
        for path in folder.rglob("*")
        if path.is_dir() and path.relative_to(folder).parts[0] != REPORT_FOLDER
    )
    paths = []
    for source in folders:
        try:
            paths += find_files(source)
        except FileError:  # a folder without measurement files
            continue
    return tuple(
        SubmittedRecord(path.relative_to(folder).as_posix(), sha256_of(path)) for path in paths
    )


def _muscle_file(folder: Path) -> str:
    """The only muscle file of a folder, or a question mark."""
    names = []
    for path in sorted(folder.glob("*.toml")):
        if path.name == DECLARATION:
            continue
        try:
            tables = read_toml(path)
            is_muscle = "characteristic" in tables and kind_of(tables) == "muscle or law"
        except AirmuscleError:  # a file of another purpose
            continue
        if is_muscle:
            names.append(path.name)
    return names[0] if len(names) == 1 else OPEN
