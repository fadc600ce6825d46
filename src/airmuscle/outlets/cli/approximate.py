"""`airmuscle approximate`: approximation of one characteristic by another, with the remaining error."""

import dataclasses
from pathlib import Path
from typing import Annotated

import typer

from ...bench.identify import ModelApproximation
from ...bench.identify import approximate as approximate_law
from ...bench.identify.approximation import GRID_POINTS, sample_on_grid
from ...core import ParameterError
from ...files.library import Entry, find_initial_law, load_law, save
from ...physics.muscle.characteristic import ValidityRange, validity_range_of
from ..requests.declaration import option, request
from .delivery import print_result
from .options import Json, Name, complete_law, with_requests

LIMIT = "Limit of the validity range; default: that of the muscle."
LIMITS = ("min_pressure", "max_pressure", "min_contraction", "max_contraction")
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


@request
class ApproximateRequest:
    """Range and degree of an approximation."""

    min_pressure: float | None = option(LIMIT, unit="Pa", default=None)
    max_pressure: float | None = option(LIMIT, unit="Pa", default=None)
    min_contraction: float | None = option(LIMIT, unit="1", default=None)
    max_contraction: float | None = option(LIMIT, unit="1", default=None)
    degree: int = option("Total degree of a ContractileSurface.", default=5, bounds=(1, 9))

    def validity_range(self, entry: Entry) -> ValidityRange:
        """The validity range of the muscle with the given limits. Raises ParameterError."""
        default = validity_range_of(entry.characteristic, entry.validity_range)
        limits = {name: getattr(self, name) for name in LIMITS}
        limits = {name: getattr(default, name, None) if value is None else value for name, value in limits.items()}
        missing = [f"--{name.replace('_', '-')}" for name, value in limits.items() if value is None]
        if missing:
            raise ParameterError(
                f"{entry.name} has no validity range for the approximation; give {', '.join(missing)}."
            )
        return ValidityRange(**limits)


@with_requests
def approximate(name: Name, model: Model, request: ApproximateRequest, out: Out = None, json: Json = False) -> None:
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
    limits = request.validity_range(entry)
    grid = sample_on_grid(entry.characteristic, limits, GRID_POINTS)
    length = getattr(entry.geometry, "resting_length", None)
    data = grid if length is None else grid.with_constants(resting_length=length)
    initial = find_initial_law(model, [data], request.degree, "MODEL")
    found = approximate_law(entry.characteristic, initial.entry.characteristic, limits)
    if out is not None:
        save(_approximate_entry(entry, found), out)
    chapter = found.chapter()
    title = f"{entry.name}, {type(entry.characteristic).__name__}, by {chapter.title}"
    print_result([dataclasses.replace(chapter, title=title)], {} if out is None else {"muscle": out}, json)


def _approximate_entry(entry: Entry, found: ModelApproximation) -> Entry:
    """The muscle with the other characteristic, without the checks of the original one."""
    title = f"{type(found.model).__name__} in place of {type(entry.characteristic).__name__}: {entry.title}"
    note = f"Approximated from {entry.name}: {found.summary}. {entry.note}".strip()
    return dataclasses.replace(
        entry, name="muscle", title=title, provenance="fitted", note=note, characteristic=found.model,
        validity_range=found.validity_range, checks=(),
    )  # fmt: skip
