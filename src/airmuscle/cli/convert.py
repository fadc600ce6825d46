"""`airmuscle convert`: one model into another, with the error that stays."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from .initial_law import start_of
from .options import Json, Name
from .terminal import print_json, print_table

if TYPE_CHECKING:
    from ..characteristic.validity_range import ValidityRange
    from ..identify.conversion import ModelConversion
    from ..library.entry import Entry

BANDS = 6
"""Parts of the validity range, by pressure, whose errors are printed."""
Model = Annotated[
    str, typer.Argument(metavar="MODEL", help="The other law: ContractileSurface, Sarosi2012, or an entry made of it.")
]
Out = Annotated[Path | None, typer.Option("--out", metavar="FILE", help="Muscle file for the other law.")]
Pressure = Annotated[
    str | None, typer.Option(metavar="QUANTITY", help="End of the validity range; else that of the muscle.")
]
Contraction = Annotated[
    str | None, typer.Option(metavar="QUANTITY", help="End of the validity range; else that of the muscle.")
]


def convert(
    name: Name,
    model: Model,
    out: Out = None,
    min_pressure: Pressure = None,
    max_pressure: Pressure = None,
    min_contraction: Contraction = None,
    max_contraction: Contraction = None,
    degree: Annotated[int, typer.Option(min=1, max=9, help="Total degree of a ContractileSurface.")] = 5,
    json: Json = False,
) -> None:
    """Bring another model as near to a muscle's law as it comes, and say how near that is.

    \b
    Compared in force, where the first law pulls, over the validity range of the muscle or the one that you state.
    With --out, FILE is a muscle with the other law and all other parts as they were.

    \b
    Examples:
      airmuscle convert dmsp-20-300 ContractileSurface --degree 5 --out surface.toml
      airmuscle convert fit/muscle.toml Sarosi2012 --max-pressure "5 bar"
    """
    from ..identify import convert as converted
    from ..identify.conversion import GRID_POINTS, sample_on_grid
    from ..library.catalogue import load_law
    from ..library.write import save

    entry = load_law(name)
    validity_range = _validity_range(entry, (min_pressure, max_pressure, min_contraction, max_contraction))
    grid = sample_on_grid(entry.characteristic, validity_range, GRID_POINTS)
    rest = getattr(entry.geometry, "resting_length", None)
    start = start_of(model, [grid if rest is None else grid.with_constants(resting_length=rest)], degree, "MODEL")
    found = converted(entry.characteristic, start.entry.characteristic, validity_range)
    if out is not None:
        save(_changed(entry, found, validity_range), out)
    if json:
        print_json(_as_data(found, validity_range))
        return
    _print(entry, found, validity_range)
    if out is not None:
        typer.echo(f"muscle: {out}")


def _validity_range(entry: Entry, given: tuple[str | None, str | None, str | None, str | None]) -> ValidityRange:
    """The muscle's validity range, with the ends that were given put in."""
    from ..characteristic.validity_range import ValidityRange
    from ..core.errors import ParameterError
    from ..core.units import quantity
    from ..report.isobar_plot import validity_range_of

    names = ("min_pressure", "max_pressure", "min_contraction", "max_contraction")
    own = validity_range_of(entry.characteristic, entry.validity_range)
    ends: dict[str, float] = {} if own is None else {name: getattr(own, name) for name in names}
    for name, text, unit in zip(names, given, ("Pa", "Pa", "1", "1"), strict=True):
        if text is not None:
            ends[name] = quantity(text, unit, where=f"--{name.replace('_', '-')}")
    lacking = [f"--{name.replace('_', '-')}" for name in names if name not in ends]
    if lacking:
        raise ParameterError(f"{entry.name} states no validity range to convert it on; give {', '.join(lacking)}.")
    return ValidityRange(**ends)


def _changed(entry: Entry, found: ModelConversion, validity_range: ValidityRange) -> Entry:
    """The muscle with the other law; its checks were of the first."""
    import dataclasses

    title = f"{type(found.model).__name__} in place of {type(entry.characteristic).__name__}: {entry.title}"
    note = f"Converted from {entry.name}: {found}. {entry.note}".strip()
    return dataclasses.replace(
        entry,
        name="muscle",
        title=title,
        provenance="fitted",
        note=note,
        characteristic=found.model,
        validity_range=validity_range,
        checks=(),
    )


def _by_pressure(found: ModelConversion, validity_range: ValidityRange) -> list[dict[str, float]]:
    """Errors in parts of the validity range by pressure."""
    import numpy as np

    edges = np.linspace(*validity_range.pressure, BANDS + 1)
    rows = []
    for low, high in itertools.pairwise(edges):
        here = (found.check_points["pressure"] >= low) & (found.check_points["pressure"] <= high)
        if here.any():
            error, force = found.check_points["error"][here], found.check_points["force"][here]
            rows.append({"min_pressure": float(low), "max_pressure": float(high),
                         "rms": float(np.sqrt(np.mean(error**2))), "max": float(np.abs(error).max()),
                         "max_force": float(force.max())})  # fmt: skip
    return rows


def _as_data(found: ModelConversion, validity_range: ValidityRange) -> dict[str, Any]:
    import dataclasses

    from ..core.tree import leaves

    return {
        "model": type(found.model).__name__,
        "parameters": {leaf.path: leaf.value for leaf in leaves(found.model)},
        "validity_range": dataclasses.asdict(validity_range),
        "rms": found.rmse,
        "max": found.max_error,
        "greatest_at": {"pressure": found.max_error_pressure, "contraction": found.max_error_contraction},
        "by_pressure": _by_pressure(found, validity_range),
    }


def _print(entry: Entry, found: ModelConversion, validity_range: ValidityRange) -> None:
    (p0, p1), (c0, c1) = validity_range.pressure, validity_range.contraction
    typer.echo(f"{entry.name}, {type(entry.characteristic).__name__}, over {p0 / 1e3:.4g} to {p1 / 1e3:.4g} kPa and "
               f"{c0:.2%} to {c1:.2%}")  # fmt: skip
    typer.echo(f"{found}\n")
    rows = [
        (f"{row['min_pressure'] / 1e3:.4g} to {row['max_pressure'] / 1e3:.4g}",
         *(f"{row[key]:.4g}" for key in ("rms", "max", "max_force")))
        for row in _by_pressure(found, validity_range)
    ]  # fmt: skip
    heads = ("pressure [kPa]", "rms error [N]", "greatest error [N]", "greatest force [N]")
    print_table(heads, rows, right=heads[1:])
