"""`airmuscle campaign`: identification of one muscle from all files of a test rig."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ...bench.identify.campaign import STAGES, Campaign, LeftOutStage, StaticStage, identify_campaign
from ...bench.identify.campaign.campaign_chapters import UnreadFile, ValidationRow, campaign_chapters
from ...bench.readers import ColumnMapping
from ...bench.readers.reader import complete_bench, find_files, read_file
from ...bench.readers.reading_chapter import reading_chapters
from ...core.atomic_output import atomic_folder, check_writable
from ...core.errors import AirmuscleError, ColumnError, FileError, IdentificationError
from ...files.library.campaign_entry import campaign_entry
from ...files.library.entry import Entry
from ...files.library.initial_law import resting_lengths
from ...files.library.write import save
from ...files.scenario.campaign import RecordScenario, campaign_scenarios
from ...physics.muscle.geometry import Geometry
from ...recording import Recording
from ...report.chapter import Chapter
from ...report.write import as_json, write_into
from .bench_files import print_row_notes
from .campaign_output import campaign_to_dict, print_campaign, stage_to_dict
from .campaign_stages import KeptStages
from .fit_geometry import braid_of_length, check_one_length, parse_braid
from .option_hints import in_options
from .options import Folder, Json
from .progress import computation_progress, reading_progress
from .reading_options import NO_OPTIONS, ReadingOptions, with_reading_options
from .terminal import echo, print_json

STAGES_FILE = "stages.json"
"""File of the finished stages, which is replaced at the end of each stage."""
SCENARIOS = "scenarios"
"""Folder of the scenarios."""

CampaignFolder = Annotated[
    list[Path],
    typer.Argument(metavar="FOLDER", help="Folder with the files of one rig; or its files, or a glob pattern."),
]
Braid = Annotated[
    str | None,
    typer.Option(
        "--braid",
        metavar="SIZE",
        help="Braid at rest, such as 'radius=10 mm, angle=24.4 deg'; default: the volume follows from the static law "
        "and fills at several lengths.",
    ),
]
KeptAside = Annotated[
    list[Path] | None,
    typer.Option("--validate", metavar="FILE", help="Record that is kept aside and predicted; repeatable."),
]


@with_reading_options
def campaign(
    folder: CampaignFolder,
    validate: KeptAside = None,
    braid: Braid = None,
    out: Folder = Path("campaign"),
    reading: ReadingOptions = NO_OPTIONS,
    json: Json = False,
) -> None:
    """Identify a muscle from all files of a test rig.

    \b
    The records are sorted by kind: slow runs (isobaric, isometric, isotonic), fills, releases and creep. Creep,
    hysteresis, static characteristic, valve and volume, and damping are identified in this order; a stage that the
    records do not allow is left out, and the report states what to measure.
    Writes DIR/report.html, DIR/muscle.toml with standard errors and correlations, and DIR/scenarios/*.toml, which
    reproduce the records. The same command after an interruption does not fit the finished stages again.

    \b
    Examples:
      airmuscle campaign bench --out identified
      airmuscle campaign bench --resting-length "300 mm" --braid "radius=10 mm, angle=24.4 deg"
      airmuscle campaign bench --validate later/isobar_250kPa.csv --mapping rig.toml
      airmuscle simulate campaign/scenarios/fill_1.toml
    """
    size = parse_braid(braid)
    columns = reading.column_mapping()
    kept_aside = {path.resolve() for path in validate or ()}
    files = [path for path in find_files(folder) if path.resolve() not in kept_aside]
    recordings, unread = _read_each(files, columns)
    aside = [recording for path in find_files(validate or ()) for recording in read_file(path, columns)]
    complete = complete_bench([*recordings, *aside], columns)
    print_row_notes(complete)
    recordings, aside = complete[: len(recordings)], complete[len(recordings) :]
    geometry = None if size is None else braid_of_length(size, _one_length(recordings))
    check_writable(out)
    result = _identify(recordings, geometry, out)
    validation = [row for recording in aside for row in _validation(result, recording)]
    scenarios = campaign_scenarios(result)
    _write(result, unread, scenarios, validation, out, reading_chapters(complete))
    if json:
        print_json(campaign_to_dict(result, unread, scenarios, validation))
        return
    print_campaign(result, unread, scenarios, validation, out)


def _read_each(files: Sequence[Path], mapping: ColumnMapping) -> tuple[list[Recording], list[UnreadFile]]:
    """The recordings of the files, and the files that cannot be read. Raises FileError if none can be read."""
    recordings, unread = list[Recording](), list[UnreadFile]()
    with reading_progress("reading") as show:
        for i, path in enumerate(files):
            show("files", i / len(files))
            try:
                recordings += read_file(path, mapping)
            except AirmuscleError as error:
                unread.append(UnreadFile(path.name, in_options(error.message, "campaign")))
    if not recordings:
        reasons = (x.reason if x.name in x.reason else f"{x.name}: {x.reason}" for x in unread)
        raise FileError(f"no file of the campaign could be read. {' '.join(reasons)}")
    return recordings, unread


def _one_length(recordings: Sequence[Recording]) -> float:
    lengths = resting_lengths(recordings)
    check_one_length(lengths)
    return lengths[0]


def _identify(recordings: Sequence[Recording], geometry: Geometry | None, out: Path) -> Campaign:
    """The campaign, continued from an interrupted one; each finished stage is kept and written to the folder."""
    kept, stages, names = KeptStages(recordings, geometry), list[dict[str, Any]](), STAGES[1:-1]
    known = kept.load(names)
    if known:
        echo(f"  continued after: {', '.join(known)} (finished before the interruption)", err=True)

    def keep(stage: str, result: object) -> None:
        stages.append(stage_to_dict(stage, result))
        if stage in names and stage not in known:
            kept.save(stage, result)
        with atomic_folder(out) as folder:
            (folder / STAGES_FILE).write_text(as_json(stages), encoding="utf-8")

    with computation_progress("campaign") as show:
        result = identify_campaign(
            recordings, geometry=geometry, progress=lambda _, fraction: show(fraction), finished=keep, known=known
        )
    kept.remove(names)
    return _with_option_names(result)


def _with_option_names(result: Campaign) -> Campaign:
    """The campaign whose reasons name options instead of Python arguments."""
    changes: dict[str, Any] = {}
    for field in dataclasses.fields(result):
        stage = getattr(result, field.name)
        if isinstance(stage, LeftOutStage):
            changes[field.name] = dataclasses.replace(stage, reason=in_options(stage.reason, "campaign"))
        if isinstance(stage, StaticStage):
            excluded = tuple(
                dataclasses.replace(each, reason=in_options(each.reason, "campaign"))
                for each in stage.comparison.excluded
            )
            notes = tuple(in_options(note, "campaign") for note in stage.data_notes)
            changes[field.name] = dataclasses.replace(
                stage, comparison=dataclasses.replace(stage.comparison, excluded=excluded), data_notes=notes
            )
    return dataclasses.replace(result, **changes)


def _validation(result: Campaign, recording: Recording) -> list[ValidationRow]:
    """The error of the prediction of a record that was kept aside; empty without a static characteristic."""
    if not isinstance(result.static, StaticStage):
        return []
    for name in ("pressure", "contraction", "force"):
        if name not in recording:
            raise ColumnError(f"{recording.origin}: --validate needs pressure, length or contraction, and force.")
    prediction = result.predict(recording)
    force, rows = recording["force"], recording["force"] > 0.0
    if not rows.any():
        raise ColumnError(f"{recording.origin}: no row has a positive force, so that no prediction can be compared.")
    inside = (force >= prediction.low) & (force <= prediction.high)
    error = (prediction.force - force)[rows]
    half = 0.5 * float(np.median(prediction.high - prediction.low))
    rms = float(np.sqrt(np.mean(error**2)))
    return [ValidationRow(recording.origin, rms, half, float(inside[rows].mean()), int(rows.sum()))]


def _entry(result: Campaign, length: float | None = None) -> Entry | None:
    try:
        text = "" if result.resting_length is None else f", {1e3 * (length or result.resting_length):.4g} mm"
        return campaign_entry(result, f"Muscle identified from {len(result.records)} records{text}", length)
    except IdentificationError:
        return None  # the overview of the report states why


def _write(
    result: Campaign, unread: Sequence[UnreadFile], scenarios: Sequence[RecordScenario],
    validation: Sequence[ValidationRow], out: Path, more: Sequence[Chapter],
) -> None:  # fmt: skip
    """Write muscle files, scenarios and report into the folder."""
    entry = _entry(result)
    lengths = {r.resting_length for r in result.records if r.kind.is_static and r.resting_length is not None}
    with atomic_folder(out) as folder:
        if entry is not None:
            save(entry, folder / "muscle.toml")
            for length in sorted(lengths - {result.resting_length}):
                other = _entry(result, length)
                if other is not None:
                    save(other, folder / f"muscle-{1e3 * length:.0f}mm.toml")
        (folder / SCENARIOS).mkdir()
        for scenario in scenarios:
            if scenario.text:
                (folder / SCENARIOS / scenario.name).write_text(scenario.text, encoding="utf-8")
        named = [(s.record, f"{SCENARIOS}/{s.name}" if s.text else s.reason) for s in scenarios]
        chapters = campaign_chapters(result, entry, unread=unread, scenarios=named, validation=validation)
        write_into(folder, [*chapters, *more], title="Bench campaign")
