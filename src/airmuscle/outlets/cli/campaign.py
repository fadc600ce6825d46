"""`airmuscle campaign`: identification of one muscle from all files of a test rig, resumed at its
finished stages.
"""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ...bench.campaign import Campaign, LeftOutStage, StaticStage, ValidationRow, identify_campaign
from ...bench.campaign.campaign_chapters import campaign_chapters, stage_data
from ...bench.diagnosis.checked_reading import complete_bench
from ...bench.readers import ColumnMapping, describe_files, find_files, read_file, read_rig
from ...core import atomic_folder, check_writable, counted, listed
from ...core.errors import ColumnError, FileError, IdentificationError
from ...files.library import Entry, campaign_entry, resting_lengths, to_toml
from ...files.scenario.write import campaign_scenarios
from ...physics.muscle.geometry import Braid, Geometry
from ...recording import Recording
from ...report.json_text import as_json
from ..requests import (
    ReadingRequest,
    braid_of_length,
    check_one_length,
    many,
    option,
    optional,
    read_braid,
    request,
)
from .delivery import Execution, deliver
from .hints import in_options
from .measurements import print_row_notes, reading_chapters
from .options import Folder, Json
from .parser import Argument
from .requested import with_requests
from .terminal import progress_bars

STAGES_FILE = "stages.json"
SCENARIOS = "scenarios"
"""File of the finished stages, which is replaced at the end of each stage, and folder of the
scenarios.
"""

FOLDER = "Folder with the files of one rig; or its files, or a glob pattern."
CampaignFolder = Annotated[list[Path], Argument("FOLDER", FOLDER)]


@request
class CampaignRequest:
    """What a campaign is asked for."""

    validate: tuple[Path, ...] = many(
        "Record that is kept aside and predicted; repeatable.", metavar="FILE"
    )
    accept_misfit: bool = option(
        "Write the muscle although the rms error of its static law is more than ten times the"
        " scatter of the data; the file states the misfit.",
        default=False,
    )
    braid: Braid | None = optional(
        "Braid at rest, such as 'radius=10 mm, angle=24.4 deg'; default: the volume follows from"
        " the static law and fills at several lengths.",
        metavar="SIZE",
        read=read_braid,
    )


@with_requests
def campaign(
    folder: CampaignFolder,
    request: CampaignRequest,
    reading: ReadingRequest,
    execution: Execution,
    out: Folder = Path("campaign"),
    json: Json = False,
) -> None:
    """Identify a muscle from all files of a test rig.

    \b
    The records are sorted by kind: slow runs (isobaric, isometric, isotonic), fills, releases and
    creep. Creep, hysteresis, static characteristic, valve and volume, and damping are identified in
    this order; a stage that the records do not allow is left out, and the report states what to
    measure. Writes DIR/report.html, DIR/muscle.toml with standard errors and correlations, and
    DIR/scenarios/*.toml, which reproduce the records. The same command after an interruption does
    not fit the finished stages again.

    \b
    Examples:
      airmuscle campaign bench --out identified
      airmuscle campaign bench --resting-length "300 mm" --braid "radius=10 mm, angle=24.4 deg"
      airmuscle campaign bench --validate later/isobar_250kPa.csv --mapping rig.toml
      airmuscle simulate campaign/scenarios/fill_1.toml
    """
    columns = reading.column_mapping()
    size = request.braid
    kept_aside = {path.resolve() for path in request.validate}
    files = [path for path in find_files(folder) if path.resolve() not in kept_aside]
    recordings, unread = _read_each(files, columns)
    aside = [
        recording for path in find_files(request.validate) for recording in read_file(path, columns)
    ]
    complete = complete_bench([*recordings, *aside], columns)
    print_row_notes(complete)
    recordings, aside = complete[: len(recordings)], complete[len(recordings) :]
    geometry = (
        None
        if size is None
        else braid_of_length(size, check_one_length(resting_lengths(recordings)))
    )
    check_writable(out)
    result = _identify(recordings, geometry, out, execution)
    validation = [row for recording in aside for row in _validation(result, recording)]
    scenarios = campaign_scenarios(result)
    refusal = "" if request.accept_misfit else _refusal(result)
    entry = None if refusal else _entry(result)
    named = [(s.record, f"{SCENARIOS}/{s.name}" if s.text else s.reason) for s in scenarios]
    chapters = [result.chapter(unread, named, validation), *campaign_chapters(result, entry)]
    notes = []
    if entry is None and isinstance(result.static, LeftOutStage):
        notes.append("muscle: not written, because it needs a static characteristic")
    if scenarios and not any(scenario.text for scenario in scenarios):
        reasons = dict.fromkeys(scenario.reason for scenario in scenarios)
        notes.append(f"scenarios: not written: {'; '.join(reasons)}")
    chapters[0] = dataclasses.replace(
        chapters[0],
        problems=(*chapters[0].problems, *filter(None, [refusal])),
        notes=(*chapters[0].notes, *notes),
    )
    contents = {f"{SCENARIOS}/{s.name}": s.text for s in scenarios if s.text}
    if entry is not None:  # and the muscles of the other resting lengths
        contents = {"muscle.toml": to_toml(entry), **_other_muscles(result), **contents}
    chapters += reading_chapters(complete)
    deliver(
        "campaign",
        chapters,
        json=json,
        out=out,
        title="Bench campaign",
        files=contents,
    )


def _other_muscles(result: Campaign) -> dict[str, str]:
    """The files of the muscles of the other resting lengths."""
    lengths = {
        record.resting_length
        for record in result.records
        if record.kind.is_static and record.resting_length is not None
    }
    files = {}
    for length in sorted(lengths - {result.resting_length}):
        entry = _entry(result, length)
        if entry:
            files[f"muscle-{1e3 * length:.0f}mm.toml"] = to_toml(entry)
    return files


def _read_each(
    files: Sequence[Path], mapping: ColumnMapping
) -> tuple[list[Recording], list[tuple[str, str]]]:
    """The recordings, and the files that cannot be read with the reason, each reason once. Raises
    FileError if none can be read.
    """
    with progress_bars("reading") as show:
        rig = read_rig(files, mapping, progress=show)
    unread = []
    for message, paths in rig.causes():
        names = listed([path.name for path in paths])
        unread.append((names, in_options(message, "campaign")))
    if not rig.recordings:
        reasons = "\n".join(
            f"{counted(len(paths), 'file')}: {in_options(message, 'campaign')}"
            for message, paths in rig.causes()
        )
        raise FileError(
            f"no file of the campaign could be read ({describe_files(files)}).\n{reasons}\n"
            "`airmuscle inspect` proposes a mapping for all of them."
        )
    return list(rig.recordings), unread


def _identify(
    recordings: Sequence[Recording],
    geometry: Geometry | None,
    out: Path,
    execution: Execution,
) -> Campaign:
    """The campaign; each finished stage is written to a folder."""
    stages = list[dict[str, Any]]()

    def write(stage: str, result: object) -> None:
        stages.append(stage_data(stage, result))
        with atomic_folder(out) as folder:
            (folder / STAGES_FILE).write_text(as_json(stages), encoding="utf-8")

    with execution.executor(out, alone=True) as workers, progress_bars("campaign") as show:
        return identify_campaign(
            recordings,
            geometry=geometry,
            progress=lambda _, fraction: show("", fraction),
            finished=write,
            workers=workers,
        )


def _validation(result: Campaign, recording: Recording) -> list[ValidationRow]:
    """The error of the prediction of a record that was kept aside; empty without a static
    characteristic.
    """
    if not isinstance(result.static, StaticStage):
        return []
    for name in ("pressure", "contraction", "force"):
        if name not in recording:
            raise ColumnError(
                f"{recording.origin}: --validate needs pressure, length or contraction, and force."
            )
    prediction = result.predict(recording)
    force = recording["force"]
    rows = recording["force"] > 0.0
    if not rows.any():
        raise ColumnError(
            f"{recording.origin}: no row has a positive force, so that no prediction can be"
            " compared."
        )
    inside = (force >= prediction.low) & (force <= prediction.high)
    half = 0.5 * float(np.median(prediction.high - prediction.low))
    rms = float(np.sqrt(np.mean((prediction.force - force)[rows] ** 2)))
    return [ValidationRow(recording.origin, rms, half, float(inside[rows].mean()), int(rows.sum()))]


def _refusal(result: Campaign) -> str:
    """Why the muscle is not written although there is a static law; empty if it may be."""
    misfit = result.static.fit.misfit if isinstance(result.static, StaticStage) else None
    return "" if misfit is None else misfit.refusal


def _entry(result: Campaign, length: float | None = None) -> Entry | None:
    try:
        text = (
            ""
            if result.resting_length is None
            else f", {1e3 * (length or result.resting_length):.4g} mm"
        )
        return campaign_entry(
            result, f"Muscle identified from {len(result.records)} records{text}", length
        )
    except IdentificationError:
        return None  # the overview of the report states why
