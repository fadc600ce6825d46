"""`airmuscle hysteresis`: identification of friction models from hysteresis loops."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ..core import leaves
from ..identify.hysteresis import (
    HysteresisFit,
    JointFit,
    LoopFit,
    find_holds,
    find_loops,
    fit_creep,
    fit_jointly,
    fit_loop,
    loops_not_joined,
)
from ..identify.hysteresis.selection import SelectedFriction, select_friction
from ..library.entry import Entry
from ..library.law_file import load_law
from ..library.write import part_toml, save
from ..recording import Recording
from ..report.chapter import Chapter
from ..report.hysteresis_chapter import describe_row_counts, hysteresis_chapters
from ..report.output_folder import atomic_folder, check_writable
from ..report.write import write_into
from .bench_files import Files, read_recordings
from .option_hints import in_options
from .options import Folder, Json
from .reading_options import NO_OPTIONS, ReadingOptions, with_reading_options
from .terminal import echo, print_json, print_table

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
Creep = Annotated[bool, typer.Option("--creep", help="Also fit creep to the longest hold phase of every file.")]


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
    Writes DIR/report.html. If a model that a plant can use is justified, it is written to DIR/muscle.toml (with
    --muscle) or to DIR/friction.toml, with the range of pressure and speed of the data.

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
    loops = find_loops(recordings, characteristic=law, degree=degree, all_rows=all_rows)
    check_writable(out)
    progress = None if json else lambda name: echo(f"  {name}", err=True)
    fits = [_with_option_names(fit_loop(loop, elements=elements, progress=progress)) for loop in loops]
    joint = fit_jointly(fits, progress=progress)
    creep_results = _fit_creep(recordings) if creep else []
    path = _write(hysteresis_chapters(fits, creep_results, joint), select_friction(fits, joint), entry, out)
    if json:
        not_joined = list(loops_not_joined(fits)) if joint else []
        data = {
            "loops": [_to_dict(fit) for fit in fits],
            "joint": [_joint_to_dict(fit) for fit in joint],
            "not_joined": not_joined,
        }
        print_json({**data, "creep": creep_results, "written": str(path or "")})
        return
    _print(fits, creep_results)
    _print_joint(joint, loops_not_joined(fits))
    _print_files(path, out, of_all_runs=bool(joint))


def _print_files(path: Path | None, out: Path, *, of_all_runs: bool) -> None:
    of_all = " for all runs together" if of_all_runs else ""
    echo(f"{path.stem}: {path}" if path else f"no friction file: no model that a plant can use is justified{of_all}")
    echo(f"report: {out / 'report.html'}")


def _with_option_names(fit: LoopFit) -> LoopFit:
    """The fits whose reasons of failure name options instead of Python arguments."""
    failed = {name: in_options(reason, "hysteresis") for name, reason in fit.failed.items()}
    return dataclasses.replace(fit, failed=failed)


def _fit_creep(recordings: Sequence[Recording]) -> list[str]:
    """The result of a creep fit to the longest hold phase of each recording, in one sentence."""
    results = []
    for recording in recordings:
        hold = max(find_holds(recording), key=lambda hold: len(hold.interval), default=None)
        if hold is None:
            results.append(
                f"{recording.origin}: no hold phase of 12 rows or more, with constant pressure and constant force or "
                "length."
            )
            continue
        rows = f"{hold.interval.start + 1} to {hold.interval.stop}"
        verdict = fit_creep(recording.rows(hold.interval.rows), hold.quantity).verdict
        results.append(f"{recording.origin}, {hold.quantity} in rows {rows}: {verdict}")
    return results


def _write(
    chapters: Sequence[Chapter], selected: SelectedFriction | None, entry: Entry | None, out: Path
) -> Path | None:
    """Write the report and, for a selected friction, the muscle or friction file; returns the path of that file."""
    name = None if selected is None else "friction.toml" if entry is None else "muscle.toml"
    with atomic_folder(out) as folder:
        write_into(folder, chapters, title="Friction")
        if selected is not None and entry is not None:
            save(_with_friction(entry, selected), folder / "muscle.toml")
        elif selected is not None:
            text = f"# {selected.verdict}\n{part_toml('friction', selected.friction)}"
            (folder / "friction.toml").write_text(text, encoding="utf-8")
    return out / name if name else None


def _with_friction(entry: Entry, selected: SelectedFriction) -> Entry:
    """The muscle with the friction; its checks are kept, because they apply to the characteristic alone."""
    note = f"{entry.note} Friction from {selected.origin}: {selected.verdict}".strip()
    return dataclasses.replace(entry, name="muscle", friction=selected.friction, note=note)


def _print(fits: Sequence[LoopFit], creep: Sequence[str]) -> None:
    for fit in fits:
        echo(f"{fit.loop.recording.origin}: {fit.loop.description}. {describe_row_counts(fit.loop)}")
        rows = [
            (type(f.friction).__name__, f"{f.rmse_without_friction:.3g} to {f.rmse:.3g} N", _second_run_errors(f),
             f"{0.0 - f.aicc_reduction:.4g}", _p_value(f.p_value), "yes" if f.justified else "no")
            for f in fit.fits
        ]  # fmt: skip
        headers = ("model", "rms error", "on second run", "difference in AICc", "p-value (F test)", "justified")
        print_table(headers, rows, right=headers[3:5])
        best = fit.recommended
        echo(str(best) if best is not None else "The data justify no friction model for this loop.")
        if best is not None and not fit.usable_in_plant:
            echo("note: friction driven by pressure describes isometric loops only; a plant cannot use it.")
        for name, reason in fit.failed.items():
            echo(f"note: {name} was not fitted: {reason}")
        echo()
    for text in creep:
        echo(f"creep: {text}")


def _print_joint(joint: Sequence[JointFit], not_joined: Sequence[str]) -> None:
    if not joint:
        return
    echo("All runs together, each with its own static curve:")
    rows = [
        (fit.name, "no" if fit.law is fit.friction else "yes", f"{fit.rmse_without_friction:.3g} to {fit.rmse:.3g} N",
         f"{0.0 - fit.aicc_reduction:.4g}", str(sum(run.disagrees for run in fit.agreement)),
         "yes" if fit.justified else "no")
        for fit in joint
    ]  # fmt: skip
    headers = ("model", "depends on pressure", "rms error", "difference in AICc", "runs that disagree", "justified")
    print_table(headers, rows, right=headers[3:5])
    best = next((fit for fit in joint if fit.justified), joint[0])
    for sentence in (*map(str, best.agreement), *not_joined, str(best)):
        echo(sentence)
    echo()


def _p_value(probability: float) -> str:
    return "< 0.001" if probability < 0.001 else f"{probability:.2g}"


def _second_run_errors(fit: HysteresisFit) -> str:
    """The rms errors on the second run, without and with friction; empty without a second run."""
    return (
        f"{fit.repeat_rmse_without_friction:.3g} to {fit.repeat_rmse:.3g} N" if math.isfinite(fit.repeat_rmse) else ""
    )


def _to_dict(fit: LoopFit) -> dict[str, Any]:
    """A loop with its fits as plain data, all numbers SI."""
    return {
        "origin": fit.loop.recording.origin,
        "run": fit.loop.run.kind.name,
        "first_row": fit.loop.run.interval.start + 1,
        "last_row": fit.loop.run.interval.stop,
        "constant": fit.loop.run.constant_column,
        "value": fit.loop.run.constant_value,
        "recommended": type(fit.recommended.friction).__name__ if fit.recommended else None,
        "usable_in_plant": fit.usable_in_plant,
        "models": [
            {
                "model": type(f.friction).__name__, "parameters": {p.path: p.value for p in leaves(f.friction)},
                "rmse": f.rmse, "rmse_without": f.rmse_without_friction, "gap": f.residual_gap, "gap_without": f.gap,
                "repeat_rmse": f.repeat_rmse, "repeat_rmse_without": f.repeat_rmse_without_friction,
                "repeatability": f.repeatability, "aicc_difference": 0.0 - f.aicc_reduction, "p_value": f.p_value,
                "justified": f.justified, "undetermined": list(f.undetermined),
            }
            for f in fit.fits
        ],
        "failed": dict(fit.failed),
    }  # fmt: skip


def _joint_to_dict(fit: JointFit) -> dict[str, Any]:
    """A joint fit as plain data, all numbers SI."""
    return {
        "model": fit.name, "parameters": {p.path: p.value for p in leaves(fit.friction)}, "rmse": fit.rmse,
        "rmse_without": fit.rmse_without_friction, "aicc_difference": 0.0 - fit.aicc_reduction, "p_value": fit.p_value,
        "pressure_p_value": fit.scale_p_value, "repeat_rmse": fit.repeat_rmse,
        "repeat_rmse_without": fit.repeat_rmse_without_friction, "justified": fit.justified,
        "undetermined": list(fit.undetermined), "reservations": list(fit.reservations),
        "runs": [{**dataclasses.asdict(run), "disagrees": run.disagrees} for run in fit.agreement],
    }  # fmt: skip
