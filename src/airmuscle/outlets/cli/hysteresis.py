"""`airmuscle hysteresis`: identification of friction models from hysteresis loops."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ...bench.identify.branch_residuals import delay_notes, find_delay
from ...bench.identify.campaign import HeldCreep, fit_held_creep, free_of_creep
from ...bench.identify.hysteresis import JointFit, LoopFit, find_loops, fit_jointly, fit_loop, loops_not_joined
from ...bench.identify.hysteresis.hysteresis_chapter import hysteresis_chapters
from ...bench.identify.hysteresis.joint import SelectedFriction, select_friction
from ...bench.readers.reading_chapter import reading_chapters
from ...core.atomic_output import atomic_folder, check_writable
from ...files.library.entry import Entry
from ...files.library.entry_file import load_law
from ...files.library.uncertainty import without_parts
from ...files.library.write import part_toml, save
from ...physics.muscle.characteristic.base import ForceLaw
from ...recording import Recording
from ...report.chapter import Chapter
from ...report.write import write_into
from .bench_files import Files, read_recordings
from .hysteresis_output import creep_to_dict, joint_to_dict, loop_to_dict, print_creep, print_joint, print_loops
from .option_hints import in_options
from .options import Folder, Json
from .reading_options import NO_OPTIONS, ReadingOptions, with_reading_options
from .terminal import echo, print_json

Muscle = Annotated[
    str | None,
    typer.Option(metavar="NAME", help="Muscle to which the friction is added: a library entry or a muscle file."),
]
UseCharacteristic = Annotated[
    bool,
    typer.Option(
        "--use-characteristic",
        help="Take the muscle's characteristic plus an offset as the friction-free curve; default: a polynomial.",
    ),
]
Degree = Annotated[int, typer.Option(min=0, max=9, metavar="N", help="Degree of the polynomial friction-free curve.")]
AllRows = Annotated[bool, typer.Option("--all-rows", help="Include rows in which pressure or length change quickly.")]
Elements = Annotated[
    int, typer.Option(min=1, max=30, metavar="N", help="Number of elements of MaxwellSlip and PrandtlIshlinskii.")
]
Creep = Annotated[
    bool, typer.Option("--creep", help="Fit creep to the longest hold of every file and write creep elements.")
]


@with_reading_options
def hysteresis(
    files: Files,
    muscle: Muscle = None,
    use_characteristic: UseCharacteristic = False,
    degree: Degree = 3,
    all_rows: AllRows = False,
    elements: Elements = 8,
    creep: Creep = False,
    out: Folder = Path("hysteresis"),
    reading: ReadingOptions = NO_OPTIONS,
    json: Json = False,
) -> None:
    """Fit friction models to hysteresis loops.

    \b
    The type of a run (isobaric, isometric) is detected; a second run at the same level validates the first.
    Statistical tests decide whether the data justify a friction model. Runs at several pressures are also fitted
    together, with a friction that depends on the pressure; a model that does not hold for all of them is not written.
    With --creep the holds after a motion give Maxwell elements, whose force is not taken for friction.
    Writes DIR/report.html. If a model that a plant can use is justified, it is written to DIR/muscle.toml (with
    --muscle) or to DIR/friction.toml, with the range of pressure and speed of the data; creep elements are written to
    the same DIR/muscle.toml, or to DIR/creep.toml.

    \b
    Examples:
      airmuscle hysteresis loop1.csv loop2.csv --resting-length "200 mm" --out friction
      airmuscle hysteresis loops/*.csv --muscle fit/muscle.toml --mapping rig.toml --creep
    """
    if use_characteristic and muscle is None:
        raise typer.BadParameter("--use-characteristic requires --muscle")
    recordings = read_recordings(files, reading)
    entry = None if muscle is None else load_law(muscle)
    law = entry.characteristic if entry is not None and use_characteristic else None
    held = _fit_creep(recordings, entry) if creep else None
    freed = recordings if held is None else free_of_creep(held.elements, recordings)
    loops = find_loops(freed, law=law, degree=degree, all_rows=all_rows)
    check_writable(out)
    progress = None if json else lambda name: echo(f"  {name}", err=True)
    fits = [_with_option_names(fit_loop(loop, elements=elements, progress=progress)) for loop in loops]
    joint = fit_jointly(fits, progress=progress)
    sentences = [] if held is None else [*held.sentences, held.verdict]
    remarks = delay_notes(find_delay(recordings))
    chapters = [*hysteresis_chapters(fits, sentences, joint, remarks), *reading_chapters(recordings)]
    written = _write(chapters, select_friction(fits, joint), held, entry, out)
    if json:
        data = {**_loops_to_dict(fits, joint), **creep_to_dict(held), "notes": remarks}
        print_json({**data, "written": str(written.get("friction", ""))})
        return
    print_loops(fits)
    for remark in remarks:
        echo(f"note: {remark}")
    print_creep(held)
    print_joint(joint, loops_not_joined(fits))
    _print_files(written, out, creep=creep, of_all_runs=bool(joint))


def _loops_to_dict(fits: Sequence[LoopFit], joint: Sequence[JointFit]) -> dict[str, Any]:
    return {
        "loops": [loop_to_dict(fit) for fit in fits],
        "joint": [joint_to_dict(fit) for fit in joint],
        "not_joined": list(loops_not_joined(fits)) if joint else [],
    }


def _fit_creep(recordings: Sequence[Recording], entry: Entry | None) -> HeldCreep:
    law = None if entry is None else entry.characteristic
    return fit_held_creep(recordings, law=law if isinstance(law, ForceLaw) else None)


def _print_files(written: Mapping[str, Path], out: Path, *, creep: bool, of_all_runs: bool) -> None:
    of_all = " for all runs together" if of_all_runs else ""
    for path in dict.fromkeys(written.values()):
        echo(f"{path.stem}: {path}")
    if "friction" not in written:
        echo(f"no friction file: no model that a plant can use is justified{of_all}")
    if creep and "creep" not in written:
        echo("no creep elements are written")
    echo(f"report: {out / 'report.html'}")


def _with_option_names(fit: LoopFit) -> LoopFit:
    """The fits whose reasons of failure name options instead of Python arguments."""
    failed = {name: in_options(reason, "hysteresis") for name, reason in fit.failed.items()}
    return dataclasses.replace(fit, failed=failed)


def _write(
    chapters: Sequence[Chapter],
    selected: SelectedFriction | None,
    held: HeldCreep | None,
    entry: Entry | None,
    out: Path,
) -> dict[str, Path]:
    """Write the report and what was identified; returns the file of the friction and that of the creep elements."""
    parts = [
        *([("friction", selected.friction, selected.verdict)] if selected is not None else []),
        *([("creep", held.elements, held.verdict)] if held is not None and held.elements.stiffnesses else []),
    ]
    written = {name: "muscle.toml" if entry is not None else f"{name}.toml" for name, _, _ in parts}
    with atomic_folder(out) as folder:
        write_into(folder, chapters, title="Friction")
        if parts and entry is not None:
            save(_completed(entry, selected, held), folder / "muscle.toml")
        elif entry is None:
            for name, part, verdict in parts:
                (folder / f"{name}.toml").write_text(f"# {verdict}\n{part_toml(name, part)}", encoding="utf-8")
    return {name: out / file for name, file in written.items()}


def _completed(entry: Entry, selected: SelectedFriction | None, held: HeldCreep | None) -> Entry:
    """The muscle with friction and creep elements; its checks apply to the characteristic alone and are kept."""
    note, changes = entry.note, dict[str, Any]()
    if selected is not None:
        changes["friction"] = selected.friction
        note = f"{note} Friction from {selected.origin}: {selected.verdict}"
    if held is not None and held.elements.stiffnesses:
        changes["creep"] = held.elements
        note = f"{note} Creep: {held.verdict}"
    uncertainty = entry.uncertainty and without_parts(entry.uncertainty, changes)
    band = None if changes else entry.error_band  # it was stated without them
    return dataclasses.replace(
        entry, name="muscle", note=note.strip(), uncertainty=uncertainty, error_band=band, **changes
    )
