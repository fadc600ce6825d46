"""BenchLimits files as arguments of a command: where they are, and what they do not say of themselves."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..recording import Recording

Files = Annotated[
    list[Path],
    typer.Argument(metavar="FILES", help="CSV, Excel, MAT, TDMS or MDF: pressure, contraction or length, force."),
]
Units = Annotated[
    list[str] | None,
    typer.Option("--unit", metavar="COLUMN=UNIT", help="The unit of a column whose heading states none; repeat it."),
]
Length = Annotated[str | None, typer.Option(metavar="QUANTITY", help="Length unpressurised and unloaded: '300 mm'.")]
Surroundings = Annotated[
    str | None, typer.Option(metavar="QUANTITY", help="What absolute pressures are reduced by: '98 kPa'.")
]


def measured(files: list[Path], unit: list[str] | None, **options: Any) -> list[Recording]:
    """The runs in files, read together so that contradictions show, then the data sets of the library."""
    from ..core.errors import ParameterError
    from ..library.catalogue import load_data as data_set
    from ..recording import read
    from .progress import reading_progress

    options = {"units": pairs("--unit", unit), **options}
    here = {entry.name for entry in Path().iterdir()}
    names = [f for f in files if not f.suffix and len(f.parts) == 1 and f.name not in here]
    own = [f for f in files if f not in names]
    given = [name for name, value in options.items() if value]
    if names and given:
        raise ParameterError(
            f"{names[0]}: a data set of the library brings its units and constants along; leave out {', '.join(given)}."
        )
    with reading_progress() as progress:
        runs = read(own, progress=progress, **options) if own else ()
    _check_stated(runs)
    return [*runs, *(data_set(str(name)) for name in names)]


def _check_stated(recordings: Sequence[Recording]) -> None:
    """Refuse a run that is not what its file says, or a lone one in which nothing changes."""
    from ..recording.segment import AT_REST, check_swept, estimate_sensors, find_runs

    together = estimate_sensors(recordings) if recordings else {}
    for recording in recordings:
        found = find_runs(recording, {name: s for name, s in together.items() if name in recording.columns})
        if len(recordings) == 1 or all(run.kind is not AT_REST for run in found):
            check_swept(recording, found)


def pairs(option: str, texts: list[str] | None) -> dict[str, str]:
    """What an option like --unit COLUMN=UNIT gives, by name."""
    parts = [text.partition("=") for text in texts or ()]
    if not all(name.strip() and sign for name, sign, _ in parts):
        raise typer.BadParameter(f"{option} wants NAME=TEXT, not {', '.join(texts or ())}")
    return {name.strip(): found.strip() for name, _, found in parts}
