"""`airmuscle fit-dynamic`: identification of plant parameters from transient records."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from ...bench.identify.dynamic import CrossPrediction, DynamicFit, describe_cross_predictions
from ...bench.identify.dynamic.dynamic_chapter import dynamic_chapters
from ...bench.identify.dynamic.problem import DynamicProfile
from ...bench.segment import inspect
from ...core.atomic_output import atomic_folder, check_writable
from ...files.scenario.identification import DynamicFitSetup, load_dynamic_fit
from ...recording.row_notes import row_notes
from ...report.write import write_into
from .options import Folder, Json
from .terminal import echo, print_json

WEAK = "weak"
"""Value of --profile that stands for all parameters of the undetermined combinations."""

Study = Annotated[
    Path, typer.Argument(metavar="STUDY.toml", help="A file with [plant], [observed], [fit] and [[record]].")
]
Profiled = Annotated[
    list[str] | None,
    typer.Option(
        metavar="PARAMETER",
        help="Profile likelihood of this parameter; 'weak': of all undetermined ones. Repeatable.",
    ),
]
Points = Annotated[
    int, typer.Option(min=2, max=50, metavar="N", help="Values of a profile on either side of the estimate.")
]
Starts = Annotated[
    int | None,
    typer.Option(min=1, max=10_000, metavar="N", help="Number of initial guesses; default: that of the file."),
]


def fit_dynamic(
    study: Study,
    profile: Profiled = None,
    points: Points = 5,
    starts: Starts = None,
    out: Folder = Path("dynamic"),
    json: Json = False,
) -> None:
    """Identify plant parameters from transient records.

    \b
    Parameters of valves, gas, volume, damping, friction and mass are estimated from records of filling, discharge and
    release. Several records are cross-predicted: each by the common parameters of the others, which the output states
    first. Reports parameter combinations that the records do not determine, and the experiment that would.
    Writes DIR/report.html and the identified plant as a scenario, DIR/scenario.toml (DIR/scenario-1.toml and so on
    for several records).

    \b
    Examples:
      airmuscle fit-dynamic study.toml --out dynamic
      airmuscle fit-dynamic study.toml --profile gas.exponent --starts 20
      airmuscle simulate dynamic/scenario.toml
    """
    loaded = load_dynamic_fit(study)
    if starts is not None:
        loaded = dataclasses.replace(loaded, starts=starts)
    check_writable(out)
    findings = _findings(loaded)
    if not json:
        counts = ((len(loaded.experiments), "record"), (loaded.starts, "start"))
        echo("  " + ", ".join(f"{count} {noun}{'s' * (count != 1)}" for count, noun in counts), err=True)
    fit = loaded.fit()
    cross = loaded.cross_predictions(fit)
    profiles = [fit.profile(name, points) for name in _profiled_names(fit, profile or [])]
    scenarios = _write(loaded, fit, profiles, findings, cross, out)
    if json:
        print_json(_to_dict(fit, profiles, findings, cross))
        return
    for prediction in cross:
        echo(str(prediction))
    if cross:
        echo(describe_cross_predictions(cross))
        echo()
    echo(str(fit))
    for finding in findings:
        echo(f"note: {finding}")
    for each in profiles:
        echo(str(each))
    for path in scenarios:
        echo(f"{path.stem}: {path}")
    echo(f"report: {out / 'report.html'}")


def _findings(study: DynamicFitSetup) -> list[str]:
    """Rows of the records that were left out, and data-quality problems."""
    recordings = [experiment.recording for experiment in study.experiments]
    findings = [f"{each.origin}: {finding.text}" for each in recordings for finding in inspect(each).findings]
    return [*row_notes(recordings), *findings]


def _profiled_names(fit: DynamicFit, names: Sequence[str]) -> list[str]:
    """The parameters to profile; also allowed are estimates on a bound and undetermined ones."""
    weak = [name for each in fit.identifiability.undetermined for name, _ in each.shares]
    requested = [*(weak if WEAK in names else []), *(name for name in names if name != WEAK)]
    return [fit[name].name for name in dict.fromkeys(requested)]


def _write(
    study: DynamicFitSetup,
    fit: DynamicFit,
    profiles: Sequence[DynamicProfile],
    findings: Sequence[str],
    cross: Sequence[CrossPrediction],
    out: Path,
) -> list[Path]:
    """Write the report and one scenario per record; returns the paths of the scenarios."""
    names = []
    with atomic_folder(out) as folder:
        for i in range(len(study.experiments)):
            suffix = f"-{i + 1}" if len(study.experiments) > 1 else ""
            names.append(f"scenario{suffix}.toml")
            (folder / names[-1]).write_text(study.scenario(fit, i, cross), encoding="utf-8")
        write_into(folder, dynamic_chapters(fit, study.title, profiles, findings, cross), title="Dynamic fit")
    return [out / name for name in names]


def _to_dict(
    fit: DynamicFit, profiles: Sequence[DynamicProfile], findings: Sequence[str], cross: Sequence[CrossPrediction]
) -> dict[str, Any]:
    """A dynamic fit as plain data, all numbers SI."""
    return {
        "parameters": [dataclasses.asdict(estimate) for estimate in fit.estimates],
        "records": [
            {"origin": record.experiment.recording.origin, "rms": {n: fit.rms(n, i) for n in record.names}}
            for i, record in enumerate(fit.problem.record_models)
        ],
        "cross_predictions": [dataclasses.asdict(each) for each in cross],
        "residual_std": fit.residual_std,
        "rank": fit.identifiability.rank,
        "starts_at_optimum": fit.starts_at_optimum,
        "optima": [{"searches": o.searches, "cost": o.cost, "values": o.values} for o in fit.optima],
        "undetermined": [
            {"shares": dict(each.shares), "deviation": each.relative_stderr, "experiment": each.remedy}
            for each in fit.identifiability.undetermined
        ],
        "profiles": {
            p.name: {"values": p.values, "growth": p.cost_increase, "interval": list(p.interval)} for p in profiles
        },
        "notes": [*fit.notes, *findings],
    }
