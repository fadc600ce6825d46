"""Standard candidate laws of a model comparison, with initial values scaled by the data."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from ...core.short_repr import ShortRepr
from ...physics.muscle.characteristic import (
    ChouHannaford1996,
    ContractileSurface,
    EffectiveLength,
    Hunt2017,
    InverseLength,
    LogarithmicLength,
    MartensBoblan2017,
    PooledLengthLaw,
    Reynolds2003,
    Sarosi2012,
    Serres2009,
    TonduLopez2000,
)
from ...physics.muscle.characteristic.base import Characteristic
from ...physics.muscle.geometry.braid import Braid
from ...recording import Recording
from .cross_validation import specimen_name

MIN_POOLED = 3
"""Minimum number of specimens for partial pooling (chosen): the term in ln L0 takes up the difference of two."""
UNREACHED_FORCE = 1e6
"""Upper clamp [N] of a surface inside another law: above the force of any muscle."""
_INITIAL_BRAID_ANGLE = 0.45
"""Initial braid angle [rad]; the angles of fluidic muscles lie within 0.15 of it."""


@dataclasses.dataclass(frozen=True, repr=False)
class Candidate(ShortRepr):
    """A law to be compared: its structure and initial values, and the names of the parameters that are not fitted."""

    name: str
    law: Characteristic
    fixed: tuple[str, ...] = ()


@dataclasses.dataclass(frozen=True)
class DataScales:
    """Maxima of the data, by which initial values are scaled; all SI."""

    force: float
    pressure: float
    contraction: float
    max_length: float | None
    """Maximum resting length [m]; None unless every recording states one."""
    length_count: int
    """Number of different resting lengths; 0 unless every recording states one."""

    @classmethod
    def from_recordings(cls, recordings: Sequence[Recording]) -> DataScales:
        """The scales of all rows of all recordings."""
        force, pressure, contraction = (
            max(float(np.nanmax(run[name])) for run in recordings) for name in ("force", "pressure", "contraction")
        )
        lengths = [run.constants.get("resting_length") for run in recordings]
        known = {float(length) for length in lengths if length is not None}
        complete = len(lengths) > 0 and None not in lengths
        return cls(force, pressure, contraction, max(known) if complete else None, len(known) if complete else 0)

    @property
    def braid_radius(self) -> float:
        """Radius [m] of a braid that exerts the maximum force at the maximum pressure, limited to 0.2 to 100 mm."""
        angle = _INITIAL_BRAID_ANGLE
        area = math.pi * self.pressure * (3 / math.tan(angle) ** 2 - 1 / math.sin(angle) ** 2)
        return min(max(math.sqrt(max(self.force, 1.0) / area), 2e-4), 0.1)


def standard_candidates(recordings: Sequence[Recording]) -> tuple[Candidate, ...]:
    """Every law whose initial values follow from the data; laws with a length only if the recordings state one."""
    scales = DataScales.from_recordings(recordings)
    candidates = [Candidate(f"surface of degree {n}", blank_surface(n, 2 * scales.force)) for n in range(1, 7)]
    candidates += [_sarosi2012(scales), _hunt2017(scales)]
    if scales.max_length is not None:
        candidates += _laws_with_length(scales, scales.max_length)
    if scales.length_count > 1 and scales.max_length is not None:
        candidates += _length_families(scales.max_length)
        if len({specimen_name(run) for run in recordings}) >= MIN_POOLED:
            candidates += _pooled_laws(scales.max_length)
    return tuple(candidates)


def unavailable_candidates(recordings: Sequence[Recording]) -> tuple[tuple[str, str, str], ...]:
    """The standard candidates whose initial values do not follow from the data: name, reason and cause."""
    scales, missing = DataScales.from_recordings(recordings), []
    if scales.max_length is None:
        names = [candidate.name for candidate in _laws_with_length(scales, 0.2)]
        cause = "not every recording states its resting length"
        missing += [(name, f"{cause[0].upper()}{cause[1:]}. State the resting length.", cause) for name in names]
    if scales.length_count < 2:
        cause = "they need recordings of two resting lengths or more"
        missing.append(("laws for muscles of any length", f"{cause[0].upper()}{cause[1:]}.", cause))
    return tuple(missing)


def blank_surface(degree: int, max_force: float = UNREACHED_FORCE) -> ContractileSurface:
    """A surface with coefficients of zero, clamped above all measured forces."""
    return ContractileSurface.blank(degree, max_force=max(max_force, 1.0))


def _sarosi2012(scales: DataScales) -> Candidate:
    factor = scales.force / 1500.0  # relative to a DMSP-20, whose measured map these values fit
    by_pressure = factor * 6e5 / scales.pressure
    return Candidate(
        "Sarosi2012",
        Sarosi2012(
            1.2e-4 * by_pressure, 420 * factor, -57.0, -8.7e-3 * by_pressure, 2.7e-3 * by_pressure, -310 * factor
        ),
    )


def _hunt2017(scales: DataScales) -> Candidate:
    factor = 450.0 / scales.force  # the published values are of a 10 mm muscle, with a maximum force of about 450 N
    max_contraction = min(max(scales.contraction, 0.02), 0.5)
    law = Hunt2017(max_contraction, span_by_force=0.331e-3 * factor * max_contraction / 0.17, by_force=1.23e3 * factor)
    return Candidate("Hunt2017", law)


def _laws_with_length(scales: DataScales, length: float) -> list[Candidate]:
    braid = Braid(scales.braid_radius, _INITIAL_BRAID_ANGLE, length)
    # The modulus of a DMSP-10 in terms of L/L_0. The wall thickness only multiplies it and is therefore fixed.
    modulus = (74.085e6, -172.3e6 / length, 114.8e6 / length**2, -13.26e6 / length**3)
    return [
        Candidate("ChouHannaford1996", ChouHannaford1996(braid)),
        Candidate("TonduLopez2000", TonduLopez2000(braid, 1.1)),
        Candidate("MartensBoblan2017", MartensBoblan2017(braid, 1.8e-3, *modulus), ("wall_thickness",)),
        Candidate("Reynolds2003", Reynolds2003(length)),
        Candidate("Serres2009", Serres2009(length)),
    ]


def _length_families(length: float) -> list[Candidate]:
    candidates = []
    for degree in range(2, 6):
        inner = blank_surface(degree)
        candidates.append(Candidate(f"effective length, degree {degree}", EffectiveLength(inner, length, 0.005)))
        for change in range(1, min(degree, 3) + 1):
            degrees = f"degree {degree}, change of degree {change}"
            args = (inner, blank_surface(change), length, length)
            candidates.append(Candidate(f"term in 1/L0, {degrees}", InverseLength(*args)))
            candidates.append(Candidate(f"term in ln L0, {degrees}", LogarithmicLength(*args)))
    return candidates


def _pooled_laws(length: float) -> list[Candidate]:
    """Laws of partial pooling: a population law with a term in ln L0, and specimen effects of degree 2 or 3."""
    candidates = []
    for degree, change in ((2, 1), (3, 1), (4, 1), (3, 2), (3, 3)):
        population = LogarithmicLength(blank_surface(degree), blank_surface(change), length, length)
        for effects in (2, 3):
            name = f"pooled, ln L0, degree {degree}, change of degree {change}, effects of degree {effects}"
            candidates.append(Candidate(name, PooledLengthLaw(population, (blank_surface(effects),))))
    return candidates
