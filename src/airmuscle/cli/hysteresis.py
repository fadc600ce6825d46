"""`airmuscle hysteresis`: friction from loops."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .bench_files import Files, Length, Surroundings, Units, measured
from .options import Folder, Json, Map
from .terminal import print_json, print_table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..identify.hysteresis import HysteresisFit, LoopFit
    from ..library.entry import Entry
    from ..recording import Recording

Muscle = Annotated[
    str | None, typer.Option(metavar="NAME", help="The muscle that gets the friction: a library entry, a TOML file.")
]
Given = Annotated[
    bool, typer.Option("--given", help="The muscle's own law, with an offset, is the curve without friction.")
]
Degree = Annotated[int, typer.Option(min=0, max=9, help="Degree of the curve without friction in what is swept.")]
AllRows = Annotated[bool, typer.Option("--all-rows", help="Rows in which pressure or length move quickly count too.")]
Elements = Annotated[int, typer.Option(min=1, max=30, help="Elements of MaxwellSlip and PrandtlIshlinskii.")]
Creep = Annotated[bool, typer.Option("--creep", help="Also fit creep to the longest hold of every file.")]


def hysteresis(
    files: Files,
    muscle: Muscle = None,
    given: Given = False,
    degree: Degree = 3,
    all_rows: AllRows = False,
    elements: Elements = 8,
    creep: Creep = False,
    out: Folder = Path("hysteresis"),
    resting_length: Length = None,
    ambient: Surroundings = None,
    unit: Units = None,
    mapping: Map = None,
    json: Json = False,
) -> None:
    """Fit friction laws to inflating and deflating branches, and say whether the data justify any.

    \b
    Runs are told by what they hold; a second run at the same level judges the first.
    Writes DIR/report.html, and DIR/muscle.toml where --muscle names one, else DIR/friction.toml,
    if the data justify a friction that a plant can take.

    \b
    Examples:
      airmuscle hysteresis loop1.csv loop2.csv --resting-length "200 mm" --out friction
      airmuscle hysteresis loops/*.csv --muscle fit/muscle.toml --mapping rig.toml --creep
    """
    from ..identify.hysteresis import find_loops, fit_loop
    from ..library.catalogue import load_law
    from ..report.output_folder import check_writable

    if given and muscle is None:
        raise typer.BadParameter("--given takes the law of the muscle that --muscle names")
    recordings = measured(files, unit, mapping=mapping, resting_length=resting_length, ambient=ambient)
    entry = None if muscle is None else load_law(muscle)
    law = entry.characteristic if entry is not None and given else None
    loops = find_loops(recordings, characteristic=law, degree=degree, all_rows=all_rows)
    check_writable(out)
    said = None if json else lambda name: typer.echo(f"  {name}", err=True)
    found = [fit_loop(loop, elements=elements, progress=said) for loop in loops]
    crept = _creep(recordings) if creep else []
    chosen = _chosen(found)
    written = _write(found, crept, chosen, entry, out)
    if json:
        print_json({"loops": [_as_data(each) for each in found], "creep": crept, "written": str(written or "")})
        return
    _print(found, crept)
    typer.echo(
        f"{written.stem}: {written}" if written else "no friction to write: none that a plant takes is justified"
    )
    typer.echo(f"report: {out / 'report.html'}")


def _chosen(found: Sequence[LoopFit]) -> HysteresisFit | None:
    """The friction to write: that of the loop with most independent rows among those a plant can take."""
    usable = [each.recommended for each in found if each.recommended is not None and each.usable_in_plant]
    return max(usable, key=lambda fit: fit.effective_sample_size, default=None)


def _creep(recordings: Sequence[Recording]) -> list[str]:
    """What is to be said of creep in each recording's longest hold."""
    from ..identify.hysteresis import find_holds, fit_creep

    said = []
    for recording in recordings:
        found = max(find_holds(recording), key=lambda hold: len(hold.interval), default=None)
        if found is None:
            said.append(f"{recording.origin}: pressure and load, or pressure and length, are never held for 12 rows.")
            continue
        rows = f"{found.interval.start + 1} to {found.interval.stop}"
        verdict = fit_creep(recording.rows(found.interval.rows), found.quantity).verdict
        said.append(f"{recording.origin}, {found.quantity} in rows {rows}: {verdict}")
    return said


def _write(
    found: Sequence[LoopFit], creep: Sequence[str], chosen: HysteresisFit | None, entry: Entry | None, out: Path
) -> Path | None:
    from ..library.write import part_toml, save
    from ..report.hysteresis_chapter import hysteresis_chapters
    from ..report.output_folder import atomic_folder
    from ..report.write import write_into

    name = None if chosen is None else "friction.toml" if entry is None else "muscle.toml"
    with atomic_folder(out) as place:
        write_into(place, hysteresis_chapters(found, creep), title="Friction")
        if chosen is not None and entry is not None:
            save(_with_friction(entry, chosen), place / "muscle.toml")
        elif chosen is not None:
            text = f"# {chosen.verdict}\n\n{part_toml('friction', chosen.friction)}"
            (place / "friction.toml").write_text(text, encoding="utf-8")
    return out / name if name else None


def _with_friction(entry: Entry, chosen: HysteresisFit) -> Entry:
    """The muscle with what was found; checks of the muscle without friction stay, being of its law."""
    import dataclasses

    note = f"{entry.note} Friction from {chosen.series.origin}: {chosen.verdict}".strip()
    return dataclasses.replace(entry, name="muscle", friction=chosen.friction, note=note)


def _print(found: Sequence[LoopFit], creep: Sequence[str]) -> None:
    from ..report.hysteresis_chapter import describe_row_counts

    for each in found:
        typer.echo(f"{each.loop.recording.origin}: {each.loop.description}. {describe_row_counts(each.loop)}")
        rows = [
            (type(f.friction).__name__, f"{f.rmse_without_friction:.3g} to {f.rmse:.3g} N", _judge(f),
             f"{f.aicc_reduction:.4g}", "< 1e-300" if f.p_value < 1e-300 else f"{f.p_value:.2g}",
             "yes" if f.justified else "no")
            for f in each.fits
        ]  # fmt: skip
        heads = ("law", "rms error", "on second run", "AICc falls by", "by chance", "justified")
        print_table(heads, rows, right=heads[3:5])
        best = each.recommended
        typer.echo(str(best) if best is not None else "The data justify no friction in this loop.")
        if best is not None and not each.usable_in_plant:
            typer.echo("note: friction on the pressure describes isometric loops only; it does not enter a plant.")
        for name, why in each.failed.items():
            typer.echo(f"note: {name} was not fitted: {why}")
        typer.echo("")
    for text in creep:
        typer.echo(f"creep: {text}")


def _judge(fit: HysteresisFit) -> str:
    import math

    return (
        f"{fit.repeat_rmse_without_friction:.3g} to {fit.repeat_rmse:.3g} N" if math.isfinite(fit.repeat_rmse) else ""
    )


def _as_data(found: LoopFit) -> dict[str, Any]:
    """A loop with its fits as plain data, all numbers SI."""
    from ..core.tree import leaves

    return {
        "origin": found.loop.recording.origin,
        "run": found.loop.run.kind.name,
        "held": found.loop.run.constant_column,
        "value": found.loop.run.constant_value,
        "recommended": type(found.recommended.friction).__name__ if found.recommended else None,
        "enters_a_plant": found.usable_in_plant,
        "laws": [
            {
                "law": type(f.friction).__name__, "parameters": {p.path: p.value for p in leaves(f.friction)},
                "rmse": f.rmse, "plain_rmse": f.rmse_without_friction, "gap": f.gap, "gap_left": f.residual_gap,
                "repeat_rmse": f.repeat_rmse, "plain_repeat_rmse": f.repeat_rmse_without_friction,
                "repeatability": f.repeatability, "aicc_gain": f.aicc_reduction, "chance": f.p_value,
                "justified": f.justified, "not_determined": list(f.undetermined),
            }
            for f in found.fits
        ],
        "failed": dict(found.failed),
    }  # fmt: skip
