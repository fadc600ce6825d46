"""Candidates of a model comparison, and the evaluation of their forces at slack rows."""

import dataclasses
import inspect
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import Array, HintedText, IdentificationError, ShortRepr, SolveError
from ...physics.muscle import characteristic
from ...physics.muscle.characteristic import (
    Characteristic,
    ContractileSurface,
    LogarithmicLength,
    PooledLengthLaw,
)
from ...physics.muscle.characteristic.base import ContractionLaw, ForceLaw
from ...physics.muscle.characteristic.calls import silent_beyond_range
from ...physics.muscle.characteristic.data_scales import DataScales
from ...recording import Recording

FORCE_MARGIN = 3.0
"""Limit of the force of laws that give contraction or pressure, in maxima of the measured force
(chosen).
"""
FORCE_GRID_POINTS = 801
"""Grid points between zero and the maximum force; the law is interpolated linearly between them."""

COARSE_STEP = 20
"""Every 20th point is evaluated first; a row whose deficit does not rise along these is evaluated
at every point.
"""


def evaluate_force(law: Any, pressure: Array, contraction: Array, max_force: float) -> Array:
    """Forces [N] at N points, shape (N,), defined at every point so that all laws are compared on
    the same rows. `max_force` [N] limits the force of laws that give contraction or pressure. Where
    such a law needs a higher pressure at zero load than is applied, the muscle is slack and the
    force is 0."""
    with np.errstate(all="ignore"), silent_beyond_range():
        if isinstance(law, ForceLaw):
            force = np.asarray(law.force(pressure, contraction), dtype=float) + np.zeros(
                pressure.size
            )
        # where the deficit first changes its sign: on a coarse grid, then on the fine grid in that
        # interval
        else:
            forces = np.linspace(0.0, max_force, FORCE_GRID_POINTS)
            coarse = _deficit(law, pressure[:, None], contraction[:, None], forces[::COARSE_STEP])
            rising = np.asarray((np.diff(coarse, axis=1) >= 0).all(axis=1))
            interval = np.minimum(np.maximum((coarse < 0).sum(axis=1) - 1, 0), coarse.shape[1] - 2)
            index = interval[:, None] * COARSE_STEP + np.arange(COARSE_STEP + 1)
            every = np.tile(np.arange(FORCE_GRID_POINTS), (int(np.count_nonzero(~rising)), 1))
            force = np.zeros(pressure.size)
            for rows, grid in ((rising, index[rising]), (~rising, every)):
                force[rows] = _first_crossing(law, pressure[rows], contraction[rows], forces[grid])
    return np.asarray(np.nan_to_num(force, nan=0.0, posinf=max_force, neginf=-max_force))


def slack_rows(law: Any, pressure: Array, contraction: Array) -> npt.NDArray[np.bool_]:
    """Mask (N,) of the points at which a law that is solved for the force is slack: it has no root,
    even at zero load. Always False for force laws. Raises IdentificationError where the law gives
    no force at a point without being slack."""
    if isinstance(law, ForceLaw) or _solve_error(law, pressure, contraction) is None:
        return np.zeros(pressure.size, dtype=bool)
    slack = np.asarray(_deficit(law, pressure, contraction, np.zeros(pressure.size)) > 0)
    if (error := _solve_error(law, pressure[~slack], contraction[~slack])) is not None:
        raise IdentificationError(
            HintedText("It gives no force at a measured point. ", error.message),
            cause="it gives no force at a measured point",
        )
    return slack


def _solve_error(law: Any, pressure: Array, contraction: Array) -> SolveError | None:
    try:
        law.force(pressure, contraction)
    except SolveError as error:
        return error
    return None


def _deficit(law: Any, pressure: Array, contraction: Array, force: Array) -> Array:
    """Negative where the muscle pulls more than the force: the contraction or the pressure that it
    lacks.
    """
    if isinstance(law, ContractionLaw):
        return np.asarray(contraction - law.contraction(pressure, force))
    return np.asarray(law.pressure(contraction, force) - pressure)


def _first_crossing(law: Any, pressure: Array, contraction: Array, forces: Array) -> Array:
    """The first force of each row of a grid (N, M) at which the deficit is not negative, by linear
    interpolation; the first force of the row where it is not negative there, the last one where it
    is negative everywhere.
    """
    deficit = _deficit(law, pressure[:, None], contraction[:, None], forces)
    crossed = np.asarray(deficit >= 0)
    crosses = crossed.any(axis=1)
    rows = np.arange(pressure.size)
    first = np.where(crosses, crossed.argmax(axis=1), forces.shape[1] - 1)
    previous = np.maximum(first - 1, 0)
    high = deficit[rows, first]
    low = deficit[rows, previous]
    with np.errstate(all="ignore"):
        fraction = np.where((first > 0) & crosses, -low / (high - low), 1.0)
    start = forces[rows, previous]
    return np.asarray(start + fraction * (forces[rows, first] - start))


MIN_POOLED = 3
"""Minimum number of specimens for partial pooling (chosen): the term in ln L0 takes up the
difference of two.
"""
POOLED_DEGREES = ((2, 1), (3, 1), (4, 1), (3, 2), (3, 3))
"""Degrees of the population law and of its change with the length in laws of partial pooling
(chosen).
"""
UNREACHED_FORCE = 1e6
"""Upper clamp [N] of a surface inside another law: above the force of any muscle."""


@dataclasses.dataclass(frozen=True, repr=False)
class Candidate(ShortRepr):
    """A law to be compared: its structure and initial values, and the names of the parameters that
    are not fitted.
    """

    name: str
    law: Characteristic
    fixed: tuple[str, ...] = ()


@dataclasses.dataclass(frozen=True)
class ExcludedModel:
    """A candidate whose parameters the data do not determine, or that gives no force at measured
    points, with the reason."""

    name: str
    reason: str
    """The complete reason, with what to do."""
    cause: str
    """The cause in one phrase."""
    error: float | None = None
    """Error in force [N] at which the cross-validation of a law that cannot be recommended was
    ended.
    """

    def __str__(self) -> str:
        return f"{self.name}: {self.cause}."


def standard_candidates(recordings: Sequence[Recording]) -> tuple[Candidate, ...]:
    """Every law whose initial values follow from the data: those of all classes of `characteristic`
    that define `guess` or `variants`, and laws of partial pooling for three specimens or more.
    Raises IdentificationError where the data have no value of pressure, contraction or force."""
    return started_candidates(recordings)[0]


def started_candidates(
    recordings: Sequence[Recording],
) -> tuple[tuple[Candidate, ...], tuple[ExcludedModel, ...]]:
    """The standard candidates, and those whose initial values do not follow from the data."""
    scales = DataScales.of(recordings)
    candidates = list[Candidate]()
    missing = list[ExcludedModel]()
    for name in dir(characteristic):
        cls = getattr(characteristic, name)
        if inspect.isclass(cls) and issubclass(cls, Characteristic):
            try:
                laws = cls.variants(scales, blank_surface)
            except IdentificationError as error:
                missing.append(ExcludedModel(name, error.message, error.cause))
            else:
                candidates += [Candidate(each, law, cls.redundant) for each, law in laws.items()]
    # Laws of partial pooling: a population law with a term in ln L0, and specimen effects of degree
    # 2 or 3.
    can_pool = scales.length_count >= 2 and scales.specimen_count >= MIN_POOLED
    for degree, change in POOLED_DEGREES if can_pool else ():
        surfaces = blank_surface(degree), blank_surface(change)
        population = LogarithmicLength(*surfaces, scales.resting_length, scales.resting_length)
        for effects in (2, 3):
            name = (
                f"surface of degree {degree} + length correction ln L0 of degree {change}"
                f" + muscle effects of degree {effects}"
            )
            candidates.append(
                Candidate(name, PooledLengthLaw(population, (blank_surface(effects),)))
            )
    return tuple(candidates), tuple(missing)


def blank_surface(degree: int, max_force: float = UNREACHED_FORCE) -> ContractileSurface:
    """A surface with coefficients of zero, clamped above all measured forces."""
    return ContractileSurface.blank(degree, max_force=max(max_force, 1.0))
