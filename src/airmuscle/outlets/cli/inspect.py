"""`airmuscle inspect`: measurement files before a fit."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import click

from ...bench.diagnosis import complete_bench, level_tables
from ...bench.inspection import inspect_all, inspection_chapters
from ...bench.readers import (
    ColumnMapping,
    Proposal,
    RecordedTime,
    RigFiles,
    describe_files,
    kind_of_file,
    read_rig,
)
from ...core import atomic_file
from ...recording import Recording
from ...report.chapter import Chapter, NamedValue, Table
from ..requests import ReadingRequest, optional, request
from .delivery import deliver
from .hints import in_options
from .measurements import AnyFiles
from .options import Json, OptionalFolder
from .requested import with_requests
from .terminal import echo, print_json, progress_bars
from .way_on import possible_commands, print_mapping, proposed_mapping, way_on

MAX_FILES = 60
"""Maximum number of files that the brief view lists where some cannot be read (chosen)."""


@request
class InspectRequest:
    """What an inspection writes."""

    save_mapping: Path | None = optional(
        "File of the mapping that is proposed for what the files do not state (TOML).",
        metavar="FILE",
    )


@with_requests
def inspect(
    files: AnyFiles,
    request: InspectRequest,
    reading: ReadingRequest,
    json: Json = False,
    out: OptionalFolder = None,
) -> None:
    """Inspect measurement files: columns, runs, sampling, outliers.

    \b
    Shows how the files are interpreted: columns and units, sampling, runs, branches, plateaus and
    suspected outliers, and what can be done with them. The data are not changed. A folder may
    contain files of several formats; one that cannot be read does not hinder the others. What the
    files do not state is proposed as a mapping, with question marks for what only you know;
    --save-mapping writes it. With --out, DIR/report.html shows all of each recording, with a
    figure. Sensor properties are estimated from all files together, as from one test rig.

    \b
    Examples:
      airmuscle inspect bench.csv
      ssh rig cat log.csv | airmuscle inspect -
      airmuscle inspect runs/ --resting-length "300 mm" --out inspection
      airmuscle inspect log.mat --save-mapping rig.toml
      airmuscle inspect runs/*.tdms --mapping rig.toml --json
    """
    unordered = ColumnMapping(
        time=RecordedTime(ordered=False)
    )  # stamps that repeat or decrease are shown
    mapping = reading.column_mapping(unordered)
    with progress_bars() as progress:
        rig = read_rig(files, mapping, progress=progress)
    recordings = complete_bench(rig.recordings, mapping)
    proposal = proposed_mapping(rig.failures, rig.paths, mapping)
    if request.save_mapping is not None and proposal:
        with atomic_file(request.save_mapping) as path:
            path.write_text(proposal.toml, encoding="utf-8")
    problems = [in_options(text, "inspect") for text in rig.describe_failures()]
    if recordings:
        chapters = _inspected(files, rig, recordings, problems, proposal)
        deliver("inspect", chapters, json=json, out=out, title="Inspection")
    else:
        for problem in problems:
            echo(f"error: {problem}", err=True)
        if json:
            print_json({"problems": problems, "mapping": proposal.toml if proposal else None})
    if not json:
        print_mapping(proposal, files, request.save_mapping, echo)
    if not recordings:
        raise click.exceptions.Exit(1)


def _inspected(
    files: Sequence[str],
    rig: RigFiles,
    recordings: Sequence[Recording],
    problems: Sequence[str],
    proposal: Proposal,
) -> list[Chapter]:
    """The chapters of an inspection: the files, the recordings, their levels, and the way on."""
    chapters = inspection_chapters(inspect_all(recordings))
    if len(rig.files) > 1 or problems:
        chapters[0] = dataclasses.replace(
            chapters[0],
            summary=f"{chapters[0].summary} Files: {describe_files(rig.files)}.",
            tables=(*chapters[0].tables, _file_table(rig)),
            problems=(*problems, *chapters[0].problems),
        )
    tables = level_tables(recordings)
    if tables:
        chapters.append(
            Chapter("level-records", "Isometric and isobaric records", "", tables=tables)
        )
    further = way_on(files, recordings)
    possible = possible_commands(recordings)
    is_understood = not problems and not proposal
    if len(recordings) > 1 and is_understood and possible:
        commands = f"Possible now: airmuscle {', '.join(possible)}."
        chapters[0] = dataclasses.replace(chapters[0], summary=f"{chapters[0].summary} {commands}")
        further = dataclasses.replace(further, brief=False)
    if proposal:
        further = dataclasses.replace(
            further, values=(NamedValue("mapping", proposal.toml, brief=False),)
        )
    return [*chapters, further]


def _file_table(rig: RigFiles) -> Table:
    """What each file was taken for."""
    unread = {failure.path for failure in rig.failures}
    columns = {
        "file": [str(path) for path in rig.files],
        "taken for": [kind_of_file(path) for path in rig.files],
        "read": ["no" if path in unread else "yes" for path in rig.files],
    }
    return Table("kinds", "Files and formats", columns, brief=MAX_FILES if unread else 0)
