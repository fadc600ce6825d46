"""Files of a test rig, read one by one: what each was taken for, and the causes for which some
cannot be read, each cause once.
"""

import dataclasses
import re
from collections.abc import Sequence
from pathlib import Path

from ...core import AirmuscleError, HintedText, counted, listed
from ...recording.recording import Recording
from .formats import Progress, format_of
from .mapping import ColumnMapping, check_mapped_columns
from .reader import Source, find_files, read_one
from .tables import Decimation, Downsampling, RawTable


@dataclasses.dataclass(frozen=True)
class Failure:
    """A file that cannot be read, and the reason."""

    path: Path
    error: AirmuscleError


@dataclasses.dataclass(frozen=True, eq=False)
class RigFiles:
    """The recordings of the files that can be read, the file of each, and the failures."""

    recordings: tuple[Recording, ...]
    paths: tuple[Path, ...]
    failures: tuple[Failure, ...]

    @property
    def files(self) -> tuple[Path, ...]:
        """All files, in the order in which they were read."""
        return tuple(dict.fromkeys([*self.paths, *(failure.path for failure in self.failures)]))

    def causes(self) -> list[tuple[HintedText, tuple[Path, ...]]]:
        """Each cause of a failure, as the message on its first file, with all files of it."""
        groups: dict[str, list[Failure]] = {}
        for failure in self.failures:
            groups.setdefault(_cause(failure), []).append(failure)
        return [
            (group[0].error.message, tuple(failure.path for failure in group))
            for group in groups.values()
        ]

    def describe_failures(self) -> list[HintedText]:
        """A text for each cause, with the number and the names of its files."""
        texts = []
        for message, paths in self.causes():
            if len(paths) == 1:
                texts.append(message)
                continue
            names = listed([path.name for path in paths[1:]])
            text = f" (The same cause in {counted(len(paths) - 1, 'further file')}: {names}.)"
            texts.append(HintedText(message, text))
        return texts


def read_rig(
    source: Source,
    mapping: ColumnMapping = ColumnMapping(),
    downsampling: Downsampling = Decimation(),
    progress: Progress | None = None,
) -> RigFiles:
    """Read the files of a rig, of any formats; a file that cannot be read does not hinder the
    others. Raises FileError where no file is found, and ColumnError for a mapped column that none
    has.
    """
    recordings = list[Recording]()
    paths = list[Path]()
    failures = list[Failure]()
    present = set[str]()
    table: RawTable | None = None
    for path in find_files(source):
        try:
            part = read_one(path, mapping, downsampling, progress)
        except AirmuscleError as error:
            failures.append(Failure(path, error))
            continue
        recordings += part.recordings
        paths += [path] * len(part.recordings)
        present |= part.present
        table = table or part.table
    is_dictionary = bool(mapping.sections) and len(set(paths)) < 2
    if table is not None and not failures and not is_dictionary:
        check_mapped_columns(mapping, present, table)
    return RigFiles(tuple(recordings), tuple(paths), tuple(failures))


def kind_of_file(path: Path) -> str:
    """The format that a file was taken for, as a word."""
    try:
        return format_of(path).name
    except AirmuscleError:
        return "unreadable"


def _cause(failure: Failure) -> str:
    """The cause of a failure without the name of its file and without numbers."""
    text = str(failure.error.message)
    for name in (str(failure.path), failure.path.name):
        text = text.replace(name, "")
    return re.sub(r"\d+(\.\d+)?", "#", text)


def describe_files(paths: Sequence[Path]) -> str:
    """The number of files of each kind: `10 TDMS, 10 MATLAB`."""
    counts: dict[str, int] = {}
    for path in paths:
        kind = kind_of_file(path)
        counts[kind] = counts.get(kind, 0) + 1
    return ", ".join(f"{count} {kind}" for kind, count in counts.items())
