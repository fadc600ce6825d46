"""`airmuscle fit`: a muscle from a bench file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .bench_files import Files, Length, Surroundings, Units, measured
from .fit_output import as_data, echo, fitted, write
from .initial_law import start_of
from .options import Folder, Json, Map
from .terminal import print_json

if TYPE_CHECKING:
    from ..characteristic.base import Characteristic
    from ..identify.result import Fit
    from ..recording import Recording
    from .fit_options import FitRequest
    from .initial_law import InitialLaw

Law = Annotated[
    str | None,
    typer.Option(
        "--characteristic",
        metavar="NAME",
        help="Where to start: a library entry, a muscle's TOML file, or ContractileSurface, which needs no start.",
    ),
]
Fixed = Annotated[
    list[str] | None, typer.Option("--fix", metavar="PARAMETER", help="Leave this parameter as it starts; repeat it.")
]
Robust = Annotated[
    str | None, typer.Option(metavar="QUANTITY", help="Errors beyond this count less (Huber): '10 N', '0.5 %'.")
]
Uncensored = Annotated[
    bool, typer.Option("--uncensored", help="Take rows at zero force as measured; else they are bounds only.")
]

EqualWeights = Annotated[
    bool, typer.Option("--equal-weights", help="All rows count alike, whatever the sensors of several rigs resolve.")
]
Compare = Annotated[bool, typer.Option("--compare", help="Fit every law that the data determine, and rank them.")]
LeftOut = Annotated[
    str | None,
    typer.Option(
        metavar="PART",
        help="What a comparison leaves out and a bootstrap draws: run, specimen, contraction, pressure, block.",
    ),
]
Refits = Annotated[
    int | None, typer.Option(min=20, max=100_000, metavar="N", help="Refit N times to parts of the data drawn anew.")
]
Profiled = Annotated[
    list[str] | None,
    typer.Option(
        metavar="PARAMETER",
        help="Profile likelihood of this parameter; 'weak' takes all that are nearly not determined. Repeat it.",
    ),
]
Shape = Annotated[
    bool,
    typer.Option("--shape", help="A ContractileSurface that neither falls with pressure nor rises with contraction."),
]
Free = Annotated[
    list[str] | None,
    typer.Option(
        metavar="PRESSURE=CONTRACTION", help="With --shape: where the muscle hangs free, '3 bar=18 %'. Repeat it."
    ),
]


def fit(
    files: Files,
    characteristic: Law = None,
    compare: Compare = False,
    leave_out: LeftOut = None,
    bootstrap: Refits = None,
    profile: Profiled = None,
    shape: Shape = False,
    free: Free = None,
    out: Folder = Path("fit"),
    resting_length: Length = None,
    ambient: Surroundings = None,
    unit: Units = None,
    mapping: Map = None,
    degree: Annotated[int, typer.Option(min=1, max=9, help="Total degree of a ContractileSurface.")] = 5,
    fix: Fixed = None,
    robust: Robust = None,
    uncensored: Uncensored = False,
    equal_weights: EqualWeights = False,
    json: Json = False,
) -> None:
    """Fit a characteristic to measured points, or compare all.

    \b
    Writes DIR/muscle.toml, which every command takes as NAME, and DIR/report.html with figures and data.
    FILES may also be data sets of the library (airmuscle list).

    \b
    Examples:
      airmuscle fit bench.csv --characteristic ContractileSurface --resting-length "300 mm" --out fit
      airmuscle fit bench.csv --characteristic dmsp-20-300 --unit pressure=bar --fix wall_thickness
      airmuscle fit dmsp-20-300 --characteristic ContractileSurface --degree 4 --robust "10 N"
      airmuscle fit runs/*.csv --characteristic dmsp-20-300 --bootstrap 1000 --profile weak
      airmuscle fit bench.csv --characteristic ContractileSurface --shape --free "3 bar=18 %"
      airmuscle fit runs/*.xlsx --mapping rig.toml --compare --leave-out run
      airmuscle solve fit/muscle.toml --pressure "3 bar" --force "100 N"
    """
    from .fit_options import FitOptions, FitRequest

    if characteristic is None and not compare:
        raise typer.BadParameter("name a law to fit with --characteristic, or let --compare find one")
    more = FitOptions.of(bootstrap, profile, leave_out, shape, free, compare)
    asked = FitRequest(more, tuple(fix or ()), degree, robust, uncensored, equal_weights, out, json)
    recordings = measured(files, unit, mapping=mapping, resting_length=resting_length, ambient=ambient)
    if characteristic is not None and not compare:
        _one(files, recordings, characteristic, asked)
        return
    from .fit_compare import compared

    compared(files, recordings, characteristic, asked)


def _one(files: list[Path], recordings: list[Recording], characteristic: str, asked: FitRequest) -> None:
    """Fit the law that was named."""
    from ..report.output_folder import check_writable

    start = start_of(characteristic, recordings, asked.degree)
    check_writable(asked.out)
    result = _identified(start, recordings, asked)
    found = asked.more.find(result, recordings)
    entry = fitted(result, start.entry, files)
    write(result, found.shaped_entry(entry), recordings, asked.out, found.chapters())
    if asked.json:
        print_json(as_data(result) | found.as_data())
        return
    echo([str(result), *found.lines()], asked.out)


def _identified(start: InitialLaw, recordings: list[Recording], asked: FitRequest) -> Fit:
    from ..identify import UNCENSORED
    from ..identify import fit as identify

    return identify(
        start.entry.characteristic,
        recordings,
        loss=loss_of(asked.robust, start.entry.characteristic),
        censoring=UNCENSORED if asked.uncensored else None,
        sigma=1.0 if asked.equal_weights else None,
        fixed=(*asked.fixed, *start.fixed),
    )


def loss_of(robust: str | None, law: Characteristic) -> Any:
    from ..core.units import quantity
    from ..identify import Huber, LeastSquares
    from ..identify.problem import fitted_quantity_of

    if robust is None:
        return LeastSquares()
    return Huber(quantity(robust, fitted_quantity_of(law).unit, where="--robust"))
