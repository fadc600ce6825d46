"""`airmuscle watch`: the files of a day at the rig as they arrive, checked, and their campaign."""

import contextlib
import dataclasses
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, NamedTuple

from ...bench.campaign import Campaign, identify_campaign
from ...bench.diagnosis import RecordFault, check_record, complete_bench
from ...bench.readers import ColumnMapping, find_files, read_rig
from ...core import AirmuscleError, FileError, check_writable, counted
from ...recording import Recording
from ...report.chapter import Chapter, Table
from ...report.text import as_text
from ..requests import ReadingRequest
from ..requests.declaration import option, optional, request
from .delivery import stored_results
from .hints import in_options
from .options import Folder
from .parser import Argument
from .printing import write_result
from .requested import with_requests
from .terminal import echo, terminal_width

PAGE_FILE = "watch.html"
PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>airmuscle watch</title>
<meta http-equiv="refresh" content="5"><style>body,iframe{margin:0;border:0;width:100%;
height:100vh}</style></head><body><iframe src="report.html" title="report"></iframe></body></html>
"""
"""The page that shows the report and loads it again every 5 s."""
OF_TIME = ("sample time", "length")
"""Rules of `check` that apply to records over time alone."""
WatchedFolder = Annotated[Path, Argument("FOLDER", "Folder into which the rig writes its files.")]


@request
class WatchRequest:
    """How a folder is watched."""

    every: float = option(
        "Time between two looks at the folder.", unit="s", default="1 s", bounds=(0.01, 3600.0)
    )
    settle: float = option(
        "Time for which a file must not change until it is read.",
        unit="s",
        default="2 s",
        bounds=(0.0, 3600.0),
    )
    idle: float | None = optional(
        "End when nothing has changed for so long, such as '10 min'; default: never.", unit="s"
    )


class _FileState(NamedTuple):
    """Size [bytes] and time of the last change [ns] of a file."""

    size: int
    changed: int


@dataclasses.dataclass(eq=False)
class WatchedFiles:
    """The files of a folder: which have been read, which change still, and what was read.

    settle  time [s] without a change after which a file is complete
    """

    folder: Path
    mapping: ColumnMapping
    settle: float
    recordings: dict[Path, tuple[Recording, ...]] = dataclasses.field(default_factory=dict)
    refused: dict[Path, str] = dataclasses.field(default_factory=dict)
    _seen: dict[Path, tuple[_FileState, float]] = dataclasses.field(default_factory=dict)
    _read: dict[Path, _FileState] = dataclasses.field(default_factory=dict)

    @property
    def waiting(self) -> int:
        """Number of files that are not read yet."""
        return sum(self._read.get(path) != state for path, (state, _) in self._seen.items())

    def look(self, now: float) -> Iterator[str]:
        """Read what is complete at a time [s], and yield a line for each file."""
        states = _states(self.folder)
        for path in [path for path in self._seen if path not in states]:
            self._forget(path)
            yield f"{path.name}: removed"
        for path, state in states.items():
            if path not in self._seen or self._seen[path][0] != state:
                self._seen[path] = (state, now)
            since = now - self._seen[path][1]
            if self._read.get(path) != state and since >= self.settle:
                self._read[path] = state
                yield self._take(path)

    def _forget(self, path: Path) -> None:
        for files in (self._seen, self._read, self.recordings, self.refused):
            files.pop(path, None)

    def _take(self, path: Path) -> str:
        """Read and check a file; a broken one is named, and does not end anything."""
        self.recordings.pop(path, None)
        self.refused.pop(path, None)
        rig = read_rig([path], self.mapping)
        if rig.failures:
            message = rig.failures[0].error.message
            self.refused[path] = in_options(message, "inspect")
            return f"{path.name}: not read: {self.refused[path]}"
        rows = 0
        for recording in rig.recordings:
            faults = _faults(recording)
            if faults:
                self.refused[path] = f"{faults[0].text}. {faults[0].remedy}"
                return f"{path.name}: not usable: {self.refused[path]}"
            rows += len(next(iter(recording.columns.values())))
        self.recordings[path] = rig.recordings
        return f"{path.name}: usable, {counted(rows, 'row')}"


def _faults(recording: Recording) -> list[RecordFault]:
    """The faults of a record; steady states need neither a time nor many rows."""
    faults = check_record(recording).faults
    if "time" in recording:
        return list(faults)
    return [fault for fault in faults if fault.rule not in OF_TIME]


def _states(folder: Path) -> dict[Path, _FileState]:
    """The files of supported formats in the folder; a file may vanish while this looks."""
    states = {}
    try:
        paths = find_files(folder)
    except FileError:
        return {}
    for path in paths:
        try:
            status = path.stat()
        except OSError:
            continue
        states[path] = _FileState(status.st_size, status.st_mtime_ns)
    return states


@with_requests
def watch(
    folder: WatchedFolder,
    request: WatchRequest,
    reading: ReadingRequest,
    out: Folder = Path("watched"),
) -> None:
    """Read, check and fit the new files of a folder as they come.

    \b
    A file is read when it has not changed for --settle. It is checked as by airmuscle check; if
    it is usable, it joins the campaign of the folder, whose result is printed with its
    uncertainty and what to measure next. A file that is broken or not usable is named, and read
    again when it changes. DIR/watch.html shows the report of the last result and loads it again
    every 5 s. Ctrl-C ends the command; the same command goes on, and stages of the campaign whose
    records are the same are not fitted again.

    \b
    Examples:
      airmuscle watch today --out watched
      airmuscle watch today --mapping rig.toml --resting-length "300 mm"
    """
    if not folder.is_dir():
        raise FileError(f"{folder}: there is no such folder. Create it, or give another one.")
    check_writable(out)
    files = WatchedFiles(folder, reading.column_mapping(), request.settle)
    echo(f"watching {folder}; Ctrl-C ends", err=True)
    with contextlib.suppress(KeyboardInterrupt):
        follow(files, request, out)
    count = counted(len(files.recordings), "usable file")
    echo(f"ended with {count} of {folder}; the same command goes on from there", err=True)


def follow(
    files: WatchedFiles,
    request: WatchRequest,
    out: Path,
    clock: Callable[[], float] = time.monotonic,
    pause: Callable[[float], object] = time.sleep,
) -> None:
    """Look at the folder again and again, until nothing has changed for the idle time."""
    last_change = clock()
    while True:
        now = clock()
        lines = list(files.look(now))
        for line in lines:
            echo(line)
        if lines:
            _deliver(files, out)
        if lines or files.waiting:
            last_change = clock()
        elif request.idle is not None and now - last_change >= request.idle:
            return
        pause(request.every)


def _deliver(files: WatchedFiles, out: Path) -> None:
    """Print and write what is known now."""
    chapters = _chapters(files, out)
    echo(as_text(chapters, terminal_width(), f"the report {out / PAGE_FILE}"))
    write_result(out, chapters, "A day at the rig", {PAGE_FILE: PAGE})


def _chapters(files: WatchedFiles, out: Path) -> list[Chapter]:
    """The campaign of all usable files, or why there is none yet; and the files."""
    recordings = [part for parts in files.recordings.values() for part in parts]
    unread = [(path.name, reason) for path, reason in files.refused.items()]
    summary = "There is no usable file yet."
    if recordings:
        try:
            return [_campaign(recordings, files.mapping, out).chapter(unread)]
        except AirmuscleError as error:
            summary = f"No campaign yet: {in_options(error.message, 'campaign')}"
    columns = {"file": [name for name, _ in unread], "reason": [text for _, text in unread]}
    table = Table("watched-unread", "Files that are not used", columns, brief=len(unread))
    tables = (table,) if unread else ()
    return [Chapter("watch", "A day at the rig", summary, tables=tables)]


def _campaign(recordings: list[Recording], mapping: ColumnMapping, out: Path) -> Campaign:
    complete = complete_bench(recordings, mapping)
    with stored_results(out):
        return identify_campaign(complete)
