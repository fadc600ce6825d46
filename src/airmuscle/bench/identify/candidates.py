"""Candidates of a model comparison: laws that start themselves from measured points, and laws of partial pooling."""

from __future__ import annotations

import dataclasses
import inspect
from collections.abc import Sequence

from ...core.errors import IdentificationError
from ...core.short_repr import ShortRepr
from ...physics.muscle import characteristic
from ...physics.muscle.characteristic import Characteristic, ContractileSurface, LogarithmicLength, PooledLengthLaw
from ...physics.muscle.characteristic.data_scales import DataScales
from ...recording import Recording

MIN_POOLED = 3
"""Minimum number of specimens for partial pooling (chosen): the term in ln L0 takes up the difference of two."""
POOLED_DEGREES = ((2, 1), (3, 1), (4, 1), (3, 2), (3, 3))
"""Degrees of the population law and of its change with the length in laws of partial pooling (chosen)."""
UNREACHED_FORCE = 1e6
"""Upper clamp [N] of a surface inside another law: above the force of any muscle."""


@dataclasses.dataclass(frozen=True, repr=False)
class Candidate(ShortRepr):
    """A law to be compared: its structure and initial values, and the names of the parameters that are not fitted."""

    name: str
    law: Characteristic
    fixed: tuple[str, ...] = ()


def standard_candidates(recordings: Sequence[Recording]) -> tuple[Candidate, ...]:
    """Every law whose initial values follow from the data: those of all classes of `characteristic` that define `guess`
    or `variants`, and laws of partial pooling for three specimens or more."""
    return _started(DataScales.of(recordings))[0]


def unavailable_candidates(recordings: Sequence[Recording]) -> tuple[tuple[str, str, str], ...]:
    """The standard candidates whose initial values do not follow from the data: name, reason and cause."""
    return _started(DataScales.of(recordings))[1]


def _started(scales: DataScales) -> tuple[tuple[Candidate, ...], tuple[tuple[str, str, str], ...]]:
    """The candidates, and the classes that these data do not start."""
    candidates, missing = list[Candidate](), list[tuple[str, str, str]]()
    for name in dir(characteristic):
        cls = getattr(characteristic, name)
        if inspect.isclass(cls) and issubclass(cls, Characteristic):
            try:
                laws = cls.variants(scales, blank_surface)
            except IdentificationError as error:
                missing.append((name, error.message, error.cause))
            else:
                candidates += [Candidate(each, law, cls.redundant) for each, law in laws.items()]
    return (*candidates, *_pooled_laws(scales)), tuple(missing)


def blank_surface(degree: int, max_force: float = UNREACHED_FORCE) -> ContractileSurface:
    """A surface with coefficients of zero, clamped above all measured forces."""
    return ContractileSurface.blank(degree, max_force=max(max_force, 1.0))


def _pooled_laws(scales: DataScales) -> list[Candidate]:
    """Laws of partial pooling: a population law with a term in ln L0, and specimen effects of degree 2 or 3."""
    if scales.length_count < 2 or scales.specimen_count < MIN_POOLED:
        return []
    length, candidates = scales.resting_length, []
    for degree, change in POOLED_DEGREES:
        population = LogarithmicLength(blank_surface(degree), blank_surface(change), length, length)
        for effects in (2, 3):
            name = f"pooled, ln L0, degree {degree}, change of degree {change}, effects of degree {effects}"
            candidates.append(Candidate(name, PooledLengthLaw(population, (blank_surface(effects),))))
    return candidates
