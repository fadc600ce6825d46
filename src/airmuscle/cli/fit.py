"""`airmuscle fit`: a muscle from a bench file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .options import Folder, Json, Map
from .terminal import print_json

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..characteristic.base import Characteristic
    from ..identify.result import Fit
    from ..library.entry import Entry
    from ..recording import Recording
    from ..report.chapter import Chapter

Files = Annotated[
    list[Path],
    typer.Argument(metavar="FILES", help="CSV, Excel, MAT, TDMS or MDF: pressure, contraction or length, force."),
]
Law = Annotated[
    str | None,
    typer.Option(
        "--characteristic",
        metavar="NAME",
        help="Where to start: a library entry, a muscle's TOML file, or ContractileSurface, which needs no start.",
    ),
]
Units = Annotated[
    list[str] | None,
    typer.Option("--unit", metavar="COLUMN=UNIT", help="The unit of a column whose heading states none; repeat it."),
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

Compare = Annotated[bool, typer.Option("--compare", help="Fit every law that the data determine, and rank them.")]
LeftOut = Annotated[
    str | None,
    typer.Option(metavar="PART", help="What a comparison leaves out: run, specimen, contraction, pressure, block."),
]
Length = Annotated[str | None, typer.Option(metavar="QUANTITY", help="Length unpressurised and unloaded: '300 mm'.")]
Surroundings = Annotated[
    str | None, typer.Option(metavar="QUANTITY", help="What absolute pressures are reduced by: '98 kPa'.")
]


def fit(
    files: Files,
    characteristic: Law = None,
    compare: Compare = False,
    leave_out: LeftOut = None,
    out: Folder = Path("fit"),
    resting_length: Length = None,
    ambient: Surroundings = None,
    unit: Units = None,
    mapping: Map = None,
    degree: Annotated[int, typer.Option(min=1, max=9, help="Total degree of a ContractileSurface.")] = 5,
    fix: Fixed = None,
    robust: Robust = None,
    uncensored: Uncensored = False,
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
      airmuscle fit runs/*.xlsx --mapping rig.toml --compare --leave-out run
      airmuscle solve fit/muscle.toml --pressure "3 bar" --force "100 N"
    """
    from ..report.staged import refuse_unwritable

    if characteristic is None and not compare:
        raise typer.BadParameter("name a law to fit with --characteristic, or let --compare find one")
    units = _by_column(unit)
    recordings = _measured(files, units=units, mapping=mapping, resting_length=resting_length, ambient=ambient)
    if compare or characteristic is None:
        from .fit_compare import compared

        refuse_unwritable(out)
        compared(files, recordings, characteristic=characteristic, fixed=tuple(fix or ()), leave_out=leave_out,
                 degree=degree, robust=robust, uncensored=uncensored, out=out, json=json)  # fmt: skip
        return
    start = start_of(characteristic, recordings, degree)
    refuse_unwritable(out)
    result = _identified(start, recordings, robust, uncensored, fix)
    write(result, fitted(result, start, files), recordings, out)
    if json:
        print_json(as_data(result))
        return
    typer.echo(str(result))
    typer.echo(f"muscle: {out / 'muscle.toml'}")
    typer.echo(f"report: {out / 'report.html'}")


def _identified(
    start: Entry, recordings: list[Recording], robust: str | None, uncensored: bool, fixed: list[str] | None
) -> Fit:
    from ..identify import UNCENSORED
    from ..identify import fit as identify

    return identify(
        start.characteristic,
        recordings,
        loss=loss_of(robust, start.characteristic),
        censoring=UNCENSORED if uncensored else None,
        fixed=fixed or (),
    )


def _measured(files: list[Path], **options: Any) -> list[Recording]:
    """The runs in files, read together so that contradictions show, then the data sets of the library."""
    from ..errors import ParameterError
    from ..library.catalogue import measured
    from ..recording import read

    here = {entry.name for entry in Path().iterdir()}
    names = [f for f in files if not f.suffix and len(f.parts) == 1 and f.name not in here]
    own = [f for f in files if f not in names]
    given = [name for name, value in options.items() if value]
    if names and given:
        raise ParameterError(
            f"{names[0]}: a data set of the library brings its units and constants along; leave out {', '.join(given)}."
        )
    return [*(read(own, **options) if own else ()), *(measured(str(name)) for name in names)]


def _by_column(texts: list[str] | None) -> dict[str, str]:
    parts = [text.partition("=") for text in texts or ()]
    if not all(name and sign for name, sign, _ in parts):
        raise typer.BadParameter(f"--unit wants COLUMN=UNIT, like pressure=bar, not {', '.join(texts or ())}")
    return {name.strip(): found.strip() for name, _, found in parts}


def start_of(name: str, recordings: list[Recording], degree: int) -> Entry:
    """The library entry to start from, or a bare one around a law that needs no start."""
    from ..errors import ParameterError
    from ..library.catalogue import load
    from ..library.entry import Entry
    from ..library.models import model_class, model_names

    if name not in model_names():
        return load(name)
    cls = model_class(name, "--characteristic")
    if not hasattr(cls, "blank"):
        raise ParameterError(
            f"--characteristic: {name} needs values to start from. Name a library entry made of it "
            "(airmuscle list shows which), or write a muscle file with your own."
        )
    # A clamp at twice what was measured cuts off no point, and still limits extrapolation.
    law = cls.blank(degree, greatest_force=2.0 * max(1.0, *(float(run["force"].max()) for run in recordings)))
    return Entry(name, name, "chosen", law)


def loss_of(robust: str | None, law: Characteristic) -> Any:
    from ..identify import Huber, LeastSquares
    from ..identify.problem import direction_of
    from ..units import quantity

    if robust is None:
        return LeastSquares()
    return Huber(quantity(robust, direction_of(law).unit, where="--robust"))


def fitted(result: Fit, start: Entry, files: list[Path]) -> Entry:
    """The fitted muscle with the parts of the one it started from; its checks and trust were of other numbers."""
    import dataclasses

    summary = dict(result.summary())
    names = ", ".join(f.name for f in files)
    note = f"Fitted to {names}: rms error {summary['rms error']}, greatest {summary['greatest error']}."
    title = f"{type(result.model).__name__} fitted to {', '.join(f.stem for f in files)}"
    return dataclasses.replace(
        start, name="muscle", title=title, trust="fitted", note=note, warning="", characteristic=result.model,
        box=result.box, checks=(),
    )  # fmt: skip


def as_data(result: Fit) -> dict[str, Any]:
    """A fit as plain data, all numbers SI."""
    import dataclasses

    return {
        "model": type(result.model).__name__,
        "quantity": result.direction.quantity,
        "unit": result.direction.unit,
        "parameters": [dataclasses.asdict(estimate) for estimate in result.estimates],
        "rmse": result.rmse,
        "greatest_error": dataclasses.asdict(result.greatest_error),
        "sigma": result.sigma,
        "r2": result.r2,
        "correlation_index": result.correlation_index,
        "rank": result.rank,
        "condition": result.condition,
        "rows_used": result.rows_used,
        "rows_censored": result.rows_censored,
        "rows_dropped": result.rows_dropped,
        "valid_for": result.ranges,
        "notes": list(result.notes),
    }


def write(result: Fit, entry: Entry, recordings: list[Recording], out: Path, chapters: Sequence[Chapter] = ()) -> None:
    """Muscle and report in one folder, whole or not at all; `chapters` stand before the fit's own."""
    from ..library.catalogue import save
    from ..report.fit_chapter import fit_chapter
    from ..report.staged import staged
    from ..report.write import fill

    with staged(out) as place:
        save(entry, place / "muscle.toml")
        notes = tuple(dict.fromkeys(note for run in recordings for note in run.notes))
        fill(place, [*chapters, fit_chapter(result, entry, notes)], title="Fit")
