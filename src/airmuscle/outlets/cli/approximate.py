"""`airmuscle approximate`: a characteristic by another one."""

import dataclasses
from pathlib import Path
from typing import Annotated, Any

from ...bench.statics import approximate as approximate_law
from ...bench.statics.approximation import GRID_POINTS, sample_on_grid
from ...core import ParameterError
from ...files.library import find_initial_law, load_law, save
from ...physics.muscle.characteristic import ValidityRange, validity_range_of
from ..requests.declaration import option, optional, request
from .options import Json, Name, complete_law
from .parser import Argument, CommandOption
from .printing import print_result
from .requested import with_requests

LIMIT = "Limit of the validity range; default: that of the muscle."
LIMITS = ("min_pressure", "max_pressure", "min_contraction", "max_contraction")
MODEL = "The other model: ContractileSurface, Sarosi2012, or a library entry of it."
Model = Annotated[str, Argument("MODEL", MODEL, complete_law)]
OUT = "Muscle file to write, with the other characteristic."
Out = Annotated[Path | None, CommandOption("--out", OUT, "FILE")]


@request
class ApproximateRequest:
    """Range and degree of an approximation."""

    min_pressure: float | None = optional(LIMIT, unit="Pa")
    max_pressure: float | None = optional(LIMIT, unit="Pa")
    min_contraction: float | None = optional(LIMIT, unit="1")
    max_contraction: float | None = optional(LIMIT, unit="1")
    degree: int = option("Total degree of a ContractileSurface.", default=5, bounds=(1, 9))


@with_requests
def approximate(
    name: Name, model: Model, request: ApproximateRequest, out: Out = None, json: Json = False
) -> None:
    """Approximate one characteristic by another.

    \b
    The error is the difference in force, where the original force is positive, over the validity
    range of the muscle or the range given by the options. With --out, FILE is the muscle with the
    other characteristic; its other parts are unchanged.

    \b
    Examples:
      airmuscle approximate dmsp-20-300 ContractileSurface --degree 5 --out surface.toml
      airmuscle approximate fit/muscle.toml Sarosi2012 --max-pressure "5 bar"
    """
    entry = load_law(name)
    stated: Any = {name: getattr(request, name) for name in LIMITS}
    default = validity_range_of(entry.characteristic, entry.validity_range)
    stated = {
        n: getattr(default, n, None) if value is None else value for n, value in stated.items()
    }
    if missing := [
        f"--{name.replace('_', '-')}" for name, value in stated.items() if value is None
    ]:
        raise ParameterError(
            f"{entry.name} has no validity range for the approximation; give {', '.join(missing)}."
        )
    limits = ValidityRange(**stated)
    grid = sample_on_grid(entry.characteristic, limits, GRID_POINTS)
    length = getattr(entry.geometry, "resting_length", None)
    data = grid if length is None else grid.with_constants(resting_length=length)
    initial, _ = find_initial_law(model, [data], request.degree, "MODEL")
    approximation = approximate_law(entry.characteristic, initial.characteristic, limits)
    chapter = approximation.chapter()
    original = type(entry.characteristic).__name__
    if out is not None:
        note = f"Approximated from {entry.name}: {approximation.summary}. {entry.note}".strip()
        approximated = dataclasses.replace(
            entry,
            name="muscle",
            title=f"{type(approximation.model).__name__} in place of {original}: {entry.title}",
            provenance="fitted",
            note=note,
            characteristic=approximation.model,
            validity_range=approximation.validity_range,
            checks=(),
        )
        save(approximated, out)
    title = f"{entry.name}, {original}, by {chapter.title}"
    print_result(
        [dataclasses.replace(chapter, title=title)], {} if out is None else {"muscle": out}, json
    )
