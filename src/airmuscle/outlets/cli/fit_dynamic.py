"""`airmuscle fit-dynamic`: identification of plant parameters from transient records."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from ...bench.identify.dynamic import DynamicFit
from ...bench.identify.dynamic.dynamic_chapter import dynamic_chapters
from ...bench.segment import inspect
from ...core import check_writable
from ...files.scenario.identification import DynamicFitSetup, load_dynamic_fit
from ...recording.recording import row_notes
from ..requests import WEAK, option, request
from .delivery import deliver
from .options import Folder, Json
from .request_options import with_requests
from .terminal import echo

Study = Annotated[
    Path, typer.Argument(metavar="STUDY.toml", help="A file with [plant], [observed], [fit] and [[record]].")
]


@request
class DynamicFitRequest:
    """What a dynamic fit is asked for beyond its file."""

    profile: tuple[str, ...] = option(
        "Profile likelihood of this parameter; 'weak': of all undetermined ones. Repeatable.",
        default=(),
        metavar="PARAMETER",
    )
    points: int = option("Values of a profile on either side of the estimate.", default=5, bounds=(2, 50))
    starts: int | None = option(
        "Number of initial guesses; default: that of the file.", default=None, bounds=(1, 10_000)
    )


@with_requests
def fit_dynamic(study: Study, request: DynamicFitRequest, out: Folder = Path("dynamic"), json: Json = False) -> None:
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
    if request.starts is not None:
        loaded = dataclasses.replace(loaded, starts=request.starts)
    check_writable(out)
    findings = _findings(loaded)
    if not json:
        counts = ((len(loaded.experiments), "record"), (loaded.starts, "start"))
        echo("  " + ", ".join(f"{count} {noun}{'s' * (count != 1)}" for count, noun in counts), err=True)
    fit = loaded.fit()
    cross = loaded.cross_predictions(fit)
    profiles = [fit.profile(name, request.points) for name in _profiled_names(fit, request.profile)]
    count = len(loaded.experiments)
    names = ["scenario.toml"] if count == 1 else [f"scenario-{i + 1}.toml" for i in range(count)]
    files = {name: loaded.scenario(fit, i, cross) for i, name in enumerate(names)}
    chapters = dynamic_chapters(fit, loaded.title, profiles, findings, cross)
    deliver("fit-dynamic", chapters, json=json, out=out, title="Dynamic fit", files=files)


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
