"""`airmuscle hysteresis`: identification of friction models from hysteresis loops."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ..core import leaves
from ..identify.hysteresis import HysteresisFit, LoopFit, find_holds, find_loops, fit_creep, fit_loop
from ..library.catalogue import load_law
from ..library.entry import Entry
from ..library.write import part_toml, save
from ..recording import Recording
from ..report.hysteresis_chapter import describe_row_counts, hysteresis_chapters
from ..report.output_folder import atomic_folder, check_writable
from ..report.write import write_into
from .bench_files import AmbientPressure, Files, Length, Units, read_recordings
from .option_hints import in_options
from .options import Folder, Json, Mapping
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


def hysteresis(
    files: Files,
    muscle: Muscle = None,
    use_characteristic: UseCharacteristic = False,
    degree: Degree = 3,
    all_rows: AllRows = False,
    elements: Elements = 8,
    creep: Creep = False,
    out: Folder = Path("hysteresis"),
    resting_length: Length = None,
    ambient: AmbientPressure = None,
    unit: Units = None,
    mapping: Mapping = None,
    json: Json = False,
) -> None:
    """Fit friction models to hysteresis loops.

    \b
    The type of a run (isobaric, isometric) is detected; a second run at the same level validates the first.
    Statistical tests decide whether the data justify a friction model.
    Writes DIR/report.html. If a model that a plant can use is justified, it is written to DIR/muscle.toml (with
    --muscle) or to DIR/friction.toml.

    \b
    Examples:
      airmuscle hysteresis loop1.csv loop2.csv --resting-length "200 mm" --out friction
      airmuscle hysteresis loops/*.csv --muscle fit/muscle.toml --mapping rig.toml --creep
    """
    if use_characteristic and muscle is None:
        raise typer.BadParameter("--use-characteristic requires --muscle")
    recordings = read_recordings(files, unit, mapping=mapping, resting_length=resting_length, ambient=ambient)
    entry = None if muscle is None else load_law(muscle)
    law = entry.characteristic if entry is not None and use_characteristic else None
    loops = find_loops(recordings, characteristic=law, degree=degree, all_rows=all_rows)
    check_writable(out)
    progress = None if json else lambda name: echo(f"  {name}", err=True)
    fits = [_with_option_names(fit_loop(loop, elements=elements, progress=progress)) for loop in loops]
    creep_results = _fit_creep(recordings) if creep else []
    path = _write(fits, creep_results, _select(fits), entry, out)
    if json:
        print_json({"loops": [_to_dict(fit) for fit in fits], "creep": creep_results, "written": str(path or "")})
        return
    _print(fits, creep_results)
    echo(f"{path.stem}: {path}" if path else "no friction file: no model that a plant can use is justified")
    echo(f"report: {out / 'report.html'}")


def _with_option_names(fit: LoopFit) -> LoopFit:
    """The fits whose reasons of failure name options instead of Python arguments."""
    failed = {name: in_options(reason, "hysteresis") for name, reason in fit.failed.items()}
    return dataclasses.replace(fit, failed=failed)


def _select(fits: Sequence[LoopFit]) -> HysteresisFit | None:
    """The friction to write: of the loop with the largest effective number of rows, among those a plant can use."""
    usable = [fit.recommended for fit in fits if fit.recommended is not None and fit.usable_in_plant]
    return max(usable, key=lambda fit: fit.effective_sample_size, default=None)


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
    fits: Sequence[LoopFit], creep: Sequence[str], selected: HysteresisFit | None, entry: Entry | None, out: Path
) -> Path | None:
    """Write the report and, for a selected friction, the muscle or friction file; returns the path of that file."""
    name = None if selected is None else "friction.toml" if entry is None else "muscle.toml"
    with atomic_folder(out) as folder:
        write_into(folder, hysteresis_chapters(fits, creep), title="Friction")
        if selected is not None and entry is not None:
            save(_with_friction(entry, selected), folder / "muscle.toml")
        elif selected is not None:
            text = f"# {selected.verdict}\n{part_toml('friction', selected.friction)}"
            (folder / "friction.toml").write_text(text, encoding="utf-8")
    return out / name if name else None


def _with_friction(entry: Entry, fit: HysteresisFit) -> Entry:
    """The muscle with the friction; its checks are kept, because they apply to the characteristic alone."""
    note = f"{entry.note} Friction from {fit.series.origin}: {fit.verdict}".strip()
    return dataclasses.replace(entry, name="muscle", friction=fit.friction, note=note)


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
