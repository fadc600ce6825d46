"""`airmuscle approximate`: approximation of one characteristic by another, with the remaining error."""

from __future__ import annotations

import dataclasses
import itertools
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ...bench.identify import ModelApproximation
from ...bench.identify import approximate as approximate_law
from ...bench.identify.approximation import GRID_POINTS, sample_on_grid
from ...core import leaves
from ...core.errors import ParameterError
from ...core.units import quantity
from ...files.library.entry import Entry
from ...files.library.entry_file import load_law
from ...files.library.initial_law import find_initial_law
from ...files.library.write import save
from ...physics.muscle.characteristic import ValidityRange
from ...physics.muscle.characteristic.validity_range import validity_range_of
from .completion import complete_law
from .options import Json, Name
from .terminal import echo, percent, print_json, print_table

BANDS = 6
"""Pressure intervals of the validity range for which errors are printed."""
LIMIT_UNITS = {"min_pressure": "Pa", "max_pressure": "Pa", "min_contraction": "1", "max_contraction": "1"}

Model = Annotated[
    str,
    typer.Argument(
        metavar="MODEL",
        help="The other model: ContractileSurface, Sarosi2012, or a library entry of it.",
        autocompletion=complete_law,
    ),
]
Out = Annotated[
    Path | None, typer.Option("--out", metavar="FILE", help="Muscle file to write, with the other characteristic.")
]
Limit = Annotated[
    str | None, typer.Option(metavar="QUANTITY", help="Limit of the validity range; default: that of the muscle.")
]


def approximate(
    name: Name,
    model: Model,
    out: Out = None,
    min_pressure: Limit = None,
    max_pressure: Limit = None,
    min_contraction: Limit = None,
    max_contraction: Limit = None,
    degree: Annotated[int, typer.Option(min=1, max=9, metavar="N", help="Total degree of a ContractileSurface.")] = 5,
    json: Json = False,
) -> None:
    """Approximate one characteristic by another.

    \b
    The error is the difference in force, where the original force is positive, over the validity range of the muscle
    or the range given by the options. With --out, FILE is the muscle with the other characteristic; its other parts
    are unchanged.

    \b
    Examples:
      airmuscle approximate dmsp-20-300 ContractileSurface --degree 5 --out surface.toml
      airmuscle approximate fit/muscle.toml Sarosi2012 --max-pressure "5 bar"
    """
    entry = load_law(name)
    limits = (min_pressure, max_pressure, min_contraction, max_contraction)
    validity_range = _validity_range(entry, dict(zip(LIMIT_UNITS, limits, strict=True)))
    grid = sample_on_grid(entry.characteristic, validity_range, GRID_POINTS)
    length = getattr(entry.geometry, "resting_length", None)
    data = grid if length is None else grid.with_constants(resting_length=length)
    initial = find_initial_law(model, [data], degree, "MODEL")
    approximation = approximate_law(entry.characteristic, initial.entry.characteristic, validity_range)
    if out is not None:
        save(_approximate_entry(entry, approximation, validity_range), out)
    if json:
        print_json(_to_dict(approximation, validity_range))
        return
    _print(entry, approximation, validity_range)
    if out is not None:
        echo(f"muscle: {out}")


def _validity_range(entry: Entry, texts: dict[str, str | None]) -> ValidityRange:
    """The validity range of the muscle, with limits replaced by those of the options."""
    default = validity_range_of(entry.characteristic, entry.validity_range)
    limits: dict[str, float] = {} if default is None else {name: getattr(default, name) for name in LIMIT_UNITS}
    for name, text in texts.items():
        if text is not None:
            limits[name] = quantity(text, LIMIT_UNITS[name], where=_option(name))
    missing = [_option(name) for name in LIMIT_UNITS if name not in limits]
    if missing:
        raise ParameterError(f"{entry.name} has no validity range for the approximation; give {', '.join(missing)}.")
    return ValidityRange(**limits)


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _approximate_entry(entry: Entry, approximation: ModelApproximation, validity_range: ValidityRange) -> Entry:
    """The muscle with the other characteristic, without the checks of the original one."""
    title = f"{type(approximation.model).__name__} in place of {type(entry.characteristic).__name__}: {entry.title}"
    note = f"Approximated from {entry.name}: {approximation}. {entry.note}".strip()
    return dataclasses.replace(
        entry,
        name="muscle",
        title=title,
        provenance="fitted",
        note=note,
        characteristic=approximation.model,
        validity_range=validity_range,
        checks=(),
    )


def _errors_by_pressure(approximation: ModelApproximation, validity_range: ValidityRange) -> list[dict[str, float]]:
    """Errors [N] in intervals of pressure."""
    points = approximation.check_points
    rows = []
    for low, high in itertools.pairwise(np.linspace(*validity_range.pressure, BANDS + 1)):
        inside = (points["pressure"] >= low) & (points["pressure"] <= high)
        if inside.any():
            error, force = points["error"][inside], points["force"][inside]
            rows.append({"min_pressure": float(low), "max_pressure": float(high),
                         "rms": float(np.sqrt(np.mean(error**2))), "max": float(np.abs(error).max()),
                         "max_force": float(force.max())})  # fmt: skip
    return rows


def _to_dict(approximation: ModelApproximation, validity_range: ValidityRange) -> dict[str, Any]:
    """A approximation as plain data, all numbers SI."""
    return {
        "model": type(approximation.model).__name__,
        "parameters": {leaf.path: leaf.value for leaf in leaves(approximation.model)},
        "validity_range": dataclasses.asdict(validity_range),
        "rms": approximation.rmse,
        "max": approximation.max_error,
        "max_at": {"pressure": approximation.max_error_pressure, "contraction": approximation.max_error_contraction},
        "by_pressure": _errors_by_pressure(approximation, validity_range),
    }


def _print(entry: Entry, approximation: ModelApproximation, validity_range: ValidityRange) -> None:
    (p0, p1), (c0, c1) = validity_range.pressure, validity_range.contraction
    echo(f"{entry.name}, {type(entry.characteristic).__name__}, over {p0 / 1e3:.4g} to {p1 / 1e3:.4g} kPa and "
         f"{percent(c0)} to {percent(c1)}")  # fmt: skip
    echo(f"{approximation}\n")
    rows = [
        (f"{row['min_pressure'] / 1e3:.4g} to {row['max_pressure'] / 1e3:.4g}",
         *(f"{row[key]:.4g}" for key in ("rms", "max", "max_force")))
        for row in _errors_by_pressure(approximation, validity_range)
    ]  # fmt: skip
    headers = ("pressure [kPa]", "rms error [N]", "maximum error [N]", "maximum force [N]")
    print_table(headers, rows, right=headers[1:])
