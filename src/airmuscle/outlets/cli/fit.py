"""`airmuscle fit`: identification of a characteristic from measurement files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ...bench.identify import UNCENSORED
from ...bench.identify import fit as fit_model
from ...bench.identify.problem import fitted_quantity_of
from ...bench.identify.specimen_errors import odd_specimen_notes, specimen_errors
from ...core.atomic_output import check_writable
from ...files.library.fitted_entry import fitted_entry, missing_geometry
from ...files.library.initial_law import find_initial_law
from ...recording import Recording
from .bench_files import Files, read_recordings
from .execution import DaskAddress, Execution, JoinedFolder, WorkerCount
from .fit_compare import compare_models
from .fit_geometry import parse_braid, with_braid
from .fit_options import FitOptions, FitRequest, robust_loss
from .fit_output import fit_to_dict, print_results, with_option_names, write_results
from .option_hints import in_options
from .options import Folder, Json
from .reading_options import NO_OPTIONS, ReadingOptions, with_reading_options
from .terminal import print_json

Law = Annotated[
    str | None,
    typer.Option(
        "--characteristic",
        metavar="NAME",
        help="Initial law: a library entry, a muscle file (TOML), or a model that needs no initial values, such as "
        "ContractileSurface.",
    ),
]
Fixed = Annotated[
    list[str] | None,
    typer.Option("--fix", metavar="PARAMETER", help="Keep this parameter at its initial value; repeatable."),
]
Robust = Annotated[
    str | None,
    typer.Option(
        metavar="QUANTITY",
        help="Threshold of the Huber loss, such as '10 N' or '0.5 %'; default: squared. With --compare: a force.",
    ),
]
Uncensored = Annotated[
    bool, typer.Option("--uncensored", help="Fit rows at zero force as measured values, not as censored data.")
]
EqualWeights = Annotated[
    bool, typer.Option("--equal-weights", help="Equal weights; default: by the sensor resolution of each test rig.")
]
Compare = Annotated[
    bool, typer.Option("--compare", help="Fit every characteristic that the data determine, and rank them.")
]
LeaveOut = Annotated[
    str | None,
    typer.Option(
        metavar="GROUP",
        help="Groups of rows for cross-validation (--compare) and resampling (--bootstrap): run, specimen, "
        "contraction, pressure, block.",
    ),
]
PurposeOption = Annotated[
    str | None,
    typer.Option(
        metavar="PURPOSE",
        help="Use of the law that --compare recommends: repeat (further runs of the measured muscles), length (other "
        "muscles of the type), both (one law for both). Default: both, if three specimens or more were each "
        "measured in several runs.",
    ),
]
LengthErrors = Annotated[
    list[str] | None,
    typer.Option(
        "--length-error",
        metavar="SPECIMEN",
        help="Estimate the error of the recorded resting length of this specimen together with the law. Repeatable.",
    ),
]
Refits = Annotated[
    int | None,
    typer.Option(min=20, max=100_000, metavar="N", help="Bootstrap with N refits to resampled groups of rows."),
]
Profiled = Annotated[
    list[str] | None,
    typer.Option(
        metavar="PARAMETER",
        help="Profile-likelihood interval of this parameter; 'weak': of all weakly determined ones. Repeatable.",
    ),
]
Shape = Annotated[
    bool,
    typer.Option(
        "--shape",
        help="Constrain a ContractileSurface: force must not decrease with pressure nor increase with contraction.",
    ),
]
BraidOption = Annotated[
    str | None,
    typer.Option(
        "--braid",
        metavar="SIZE",
        help="Braid at rest, such as 'radius=10 mm, angle=24.4 deg' (outer radius; angle between threads and axis): "
        "the [geometry] of a muscle whose law contains none. Requires the resting length.",
    ),
]
FreeContraction = Annotated[
    list[str] | None,
    typer.Option(
        metavar="PRESSURE=CONTRACTION",
        help="With --shape: a point of zero force (free contraction), such as '3 bar=18 %'. Repeatable.",
    ),
]


@with_reading_options
def fit(
    files: Files,
    characteristic: Law = None,
    compare: Compare = False,
    leave_out: LeaveOut = None,
    purpose: PurposeOption = None,
    bootstrap: Refits = None,
    profile: Profiled = None,
    length_error: LengthErrors = None,
    shape: Shape = False,
    free_contraction: FreeContraction = None,
    out: Folder = Path("fit"),
    reading: ReadingOptions = NO_OPTIONS,
    braid: BraidOption = None,
    degree: Annotated[int, typer.Option(min=1, max=9, metavar="N", help="Total degree of a ContractileSurface.")] = 5,
    fix: Fixed = None,
    robust: Robust = None,
    uncensored: Uncensored = False,
    equal_weights: EqualWeights = False,
    workers: WorkerCount = None,
    dask: DaskAddress = None,
    join: JoinedFolder = None,
    json: Json = False,
) -> None:
    """Fit a characteristic to measured points, or compare several.

    \b
    Writes DIR/muscle.toml, which every command accepts as NAME, and DIR/report.html with figures and data.
    FILES may also be data sets of the library (see airmuscle list).

    \b
    Examples:
      airmuscle fit bench.csv --characteristic ContractileSurface --resting-length "300 mm" --out fit
      airmuscle fit bench.csv --characteristic ContractileSurface --braid "radius=10 mm, angle=24.4 deg"
      airmuscle fit bench.csv --characteristic dmsp-20-300 --unit pressure=bar --fix wall_thickness
      airmuscle fit dmsp-20-300 --characteristic ContractileSurface --degree 4 --robust "10 N"
      airmuscle fit runs/*.csv --characteristic dmsp-20-300 --bootstrap 1000 --profile weak
      airmuscle fit bench.csv --characteristic ContractileSurface --shape --free-contraction "3 bar=18 %"
      airmuscle fit runs/*.xlsx --mapping rig.toml --compare --leave-out run
      airmuscle fit muscles/*.csv --mapping rig.toml --compare --purpose both --length-error "20 cm"
      airmuscle fit muscles/*.csv --mapping rig.toml --compare --join /shared/fit    (on each machine)
      airmuscle fit log_held*.csv --file-name "held{length [mm]}mm" --time uniform --resting-length "200 mm" --compare
      airmuscle evaluate fit/muscle.toml --pressure "3 bar" --force "100 N"
    """
    if characteristic is None and not compare:
        raise typer.BadParameter("give the characteristic to fit with --characteristic, or rank all with --compare")
    options = FitOptions.parse(bootstrap, profile, leave_out, shape, free_contraction, compare, purpose, length_error)
    execution = Execution(workers, dask, join)
    if (workers, dask, join) != (None, None, None) and not compare:
        raise typer.BadParameter("--workers, --dask and --join distribute the candidates of --compare")
    with execution.output(out) as folder:
        request = FitRequest(options, tuple(fix or ()), degree, robust, uncensored, equal_weights, folder, json,
                             parse_braid(braid), execution)  # fmt: skip
        recordings = read_recordings(files, reading)
        if characteristic is None or compare:
            compare_models(files, recordings, characteristic, request)
        else:
            _fit_one(files, recordings, characteristic, request)


def _fit_one(files: list[Path], recordings: list[Recording], characteristic: str, request: FitRequest) -> None:
    """Fit the named characteristic, print the result and write the muscle and the report."""
    initial = find_initial_law(characteristic, recordings, request.degree)
    check_writable(request.out)
    start = with_braid(initial.entry, request.braid, recordings)
    law = start.characteristic
    result = fit_model(
        law,
        recordings,
        loss=robust_loss(request.robust, fitted_quantity_of(law).unit),
        censoring=UNCENSORED if request.uncensored else None,
        sigma=1.0 if request.equal_weights else None,
        fixed=(*request.fixed, *initial.fixed),
    )
    extras = request.options.evaluate(result, recordings)
    errors = specimen_errors(result, recordings, (*request.fixed, *initial.fixed))
    entry = extras.constrained_entry(fitted_entry(result, start, files, recordings=recordings, errors=errors))
    write_results(result, entry, recordings, request.out, extras.chapters())
    notes = [*(in_options(note, "fit") for note in odd_specimen_notes(errors)), *missing_geometry(entry)]
    if request.json:
        data = fit_to_dict(result)
        print_json(data | {"notes": [*data["notes"], *notes]} | extras.to_dict())
        return
    print_results([str(with_option_names(result)), *extras.lines(), *(f"note: {note}" for note in notes)], request.out)
