"""`airmuscle fit-dynamic`: parameters of a plant from records of its motion."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .options import Folder, Json
from .terminal import print_json

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..identify.dynamic import DynamicFit
    from ..identify.dynamic.profile import DynamicProfile
    from ..scenario.identification import DynamicFitSetup

WEAK = "weak"
"""For --profile: all that take part in what the records do not determine."""


Study = Annotated[
    Path, typer.Argument(metavar="STUDY.toml", help="A file with [plant], [observed], [fit] and [[record]].")
]
Profiled = Annotated[
    list[str] | None,
    typer.Option(
        metavar="PARAMETER",
        help="How the error grows as this one is held at other values; 'weak': all not determined. Repeat it.",
    ),
]
Points = Annotated[int, typer.Option(min=2, max=50, help="Values of a profile to either side.")]
Starts = Annotated[int | None, typer.Option(min=1, max=10_000, help="Starts of the search, before the file's.")]


def fit_dynamic(
    study: Study,
    profile: Profiled = None,
    points: Points = 5,
    starts: Starts = None,
    out: Folder = Path("dynamic"),
    json: Json = False,
) -> None:
    """Find valve, gas, volume, damping, friction or mass from records of fill, discharge and release.

    \b
    Says what the records cannot tell apart, and the experiment that would.
    Writes DIR/report.html and DIR/scenario.toml with the numbers found, to simulate on; of several records
    DIR/scenario-1.toml and so on.

    \b
    Examples:
      airmuscle fit-dynamic study.toml --out dynamic
      airmuscle fit-dynamic study.toml --profile gas.exponent --starts 20
      airmuscle simulate dynamic/scenario.toml
    """
    import dataclasses

    from ..report.output_folder import check_writable
    from ..scenario.identification import load_dynamic_fit

    loaded = load_dynamic_fit(study)
    if starts is not None:
        loaded = dataclasses.replace(loaded, starts=starts)
    check_writable(out)
    remarks = _remarks(loaded)
    if not json:
        typer.echo(f"  {len(loaded.experiments)} records, {loaded.starts} starts", err=True)
    found = loaded.fit()
    profiles = [found.profile(name, points) for name in _profiled(found, profile or [])]
    written = _write(loaded, found, profiles, remarks, out)
    if json:
        print_json(_as_data(found, profiles, remarks))
        return
    typer.echo(str(found))
    for remark in remarks:
        typer.echo(f"note: {remark}")
    for each in profiles:
        typer.echo(str(each))
    for path in written:
        typer.echo(f"{path.stem}: {path}")
    typer.echo(f"report: {out / 'report.html'}")


def _remarks(study: DynamicFitSetup) -> list[str]:
    """What is wrong, or may be, with the records."""
    from ..recording.segment import inspect

    return [
        f"{experiment.recording.origin}: {finding.text}"
        for experiment in study.experiments
        for finding in inspect(experiment.recording).findings
    ]


def _profiled(found: DynamicFit, names: Sequence[str]) -> list[str]:
    """The unknowns to profile; a value on its bound, or one that nothing determines, has a profile too."""
    weak = [name for each in found.identifiability.undetermined for name, _ in each.shares]
    wanted = [*(weak if WEAK in names else []), *(name for name in names if name != WEAK)]
    return [found[name].name for name in dict.fromkeys(wanted)]


def _write(
    study: DynamicFitSetup, found: DynamicFit, profiles: Sequence[DynamicProfile], remarks: Sequence[str], out: Path
) -> list[Path]:
    from ..report.dynamic_chapter import dynamic_chapters
    from ..report.output_folder import atomic_folder
    from ..report.write import write_into

    names = []
    with atomic_folder(out) as place:
        for i in range(len(study.experiments)):
            suffix = f"-{i + 1}" if len(study.experiments) > 1 else ""
            names.append(f"scenario{suffix}.toml")
            (place / names[-1]).write_text(study.scenario(found, i), encoding="utf-8")
        write_into(place, dynamic_chapters(found, study.title, profiles, remarks), title="Dynamic fit")
    return [out / name for name in names]


def _as_data(found: DynamicFit, profiles: Sequence[DynamicProfile], remarks: Sequence[str]) -> dict[str, Any]:
    """A dynamic fit as plain data, all numbers SI."""
    import dataclasses

    return {
        "parameters": [dataclasses.asdict(estimate) for estimate in found.estimates],
        "records": [
            {"origin": course.experiment.recording.origin, "rms": {n: found.rms(n, i) for n in course.names}}
            for i, course in enumerate(found.problem.record_models)
        ],
        "scatter": found.residual_std,
        "rank": found.identifiability.rank,
        "starts_at_optimum": found.starts_at_optimum,
        "not_determined": [
            {"shares": dict(each.shares), "deviation": each.relative_stderr, "experiment": each.remedy}
            for each in found.identifiability.undetermined
        ],
        "profiles": {
            p.name: {"values": p.values, "growth": p.cost_increase, "interval": list(p.interval)} for p in profiles
        },
        "notes": [*found.notes, *remarks],
    }
