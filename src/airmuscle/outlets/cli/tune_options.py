"""Options of `airmuscle tune`: ranges, objective and perturbations."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...core.errors import InputError, suggestion
from ...design.tuning import IntegralAbsoluteError, IntegralTimeAbsoluteError, RootMeanSquareError, TrackingIndex

INDICES: dict[str, type[TrackingIndex]] = {
    "rmse": RootMeanSquareError,
    "iae": IntegralAbsoluteError,
    "itae": IntegralTimeAbsoluteError,
}
"""Values of --index."""
ScenarioFile = Annotated[Path, typer.Argument(metavar="SCENARIO.toml", help="A scenario file with [input.controller].")]
Bounds = Annotated[
    list[str] | None,
    typer.Option(
        metavar="GAIN=MIN:MAX",
        help="Range of a gain, such as 'gain=5 1/m:500 1/m'; repeatable. Default: every gain and time that is not 0, "
        "from a tenth of its present value to ten times it.",
    ),
]
Index = Annotated[str, typer.Option(metavar="NAME", help=f"Tracking index of a run: {', '.join(INDICES)}.")]
Quantile = Annotated[
    float, typer.Option(metavar="NUMBER", help="Quantile of the index over the cases; 1: the worst case.")
]
QuantileWeight = Annotated[float, typer.Option(metavar="NUMBER", help="Weight of the quantile; that of the mean is 1.")]
AirWeight = Annotated[float, typer.Option(metavar="NUMBER", help="Weight of the mean air drawn [kg/s].")]
TravelWeight = Annotated[
    float, typer.Option(metavar="NUMBER", help="Weight of the mean travel of the commands [strokes/s].")
]  # fmt: skip
Loads = Annotated[str, typer.Option(metavar="FACTORS", help="Factors of the load; '' for none.")]
Supplies = Annotated[str, typer.Option(metavar="FACTORS", help="Factors of the supply pressure; '' for none.")]
Leak = Annotated[
    float, typer.Option(metavar="RATIO", help="Leak at each muscle, relative to the largest conductance; 0 for none.")
]
Delay = Annotated[
    int, typer.Option(min=0, max=1000, metavar="N", help="Dead time of the measurements in samples; 0 for none.")
]
Draws = Annotated[
    int, typer.Option(min=0, max=10_000, metavar="N", help="Draws of fitted parameters, from their covariance.")
]
Rules = Annotated[
    bool, typer.Option("--rules", help="Start from SIMC and AMIGO settings by a simulated step (PID only).")
]
Budget = Annotated[int, typer.Option(min=8, max=10_000_000, metavar="N", help="Maximum number of simulated loops.")]
Seed = Annotated[int, typer.Option(min=0, metavar="N", help="Seed of the optimiser and of the draws.")]
Save = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE.toml", help="Scenario with the tuned gains; default: SCENARIO-tuned.toml next to the scenario."
    ),
]


def read_factors(text: str, option: str) -> tuple[float, ...]:
    """Factors with commas between them. Raises InputError."""
    try:
        return tuple(float(part) for part in text.split(",") if part.strip())
    except ValueError:
        raise InputError(f"{option} is '{text}'; it must be factors with commas between them, such as 0.5,2.") from None


def read_index(name: str) -> TrackingIndex:
    """The tracking index of this name. Raises InputError."""
    if name not in INDICES:
        raise InputError(f"--index is '{name}'; there are {', '.join(INDICES)}.{suggestion(name, INDICES)}")
    return INDICES[name]()
