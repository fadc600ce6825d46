"""The laws that a comparison tries where none are named, each with values to start from."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from ..characteristic import (
    ChouHannaford1996,
    ContractileSurface,
    EffectiveLength,
    Hunt2017,
    InverseLength,
    LogarithmicLength,
    MartensBoblan2017,
    Reynolds2003,
    Sarosi2012,
    Serres2009,
    TonduLopez2000,
)
from ..characteristic.base import Characteristic
from ..geometry.braid import Braid
from ..recording import Recording

_UNREACHED_FORCE = 1e6
"""Clamp [N] of a surface inside another law: beyond any muscle."""
_INITIAL_BRAID_ANGLE = 0.45
"""Angle of the braid [rad] that searches start from; those of fluidic muscles lie within 0.15 of it."""


@dataclasses.dataclass(frozen=True)
class Candidate:
    """A law to be compared: its structure and start values, and the parameters that stay as they are."""

    name: str
    law: Characteristic
    fixed: tuple[str, ...] = ()


@dataclasses.dataclass(frozen=True)
class DataScales:
    """What start values are scaled by."""

    force: float
    pressure: float
    contraction: float
    max_length: float | None
    """Resting length [m] of the longest muscle, where all are known."""
    length_count: int
    """How many different ones."""

    @classmethod
    def from_recordings(cls, recordings: Sequence[Recording]) -> DataScales:
        """Of all rows of all recordings."""
        force, pressure, contraction = (
            max(float(np.nanmax(run[name])) for run in recordings) for name in ("force", "pressure", "contraction")
        )
        given = [run.constants.get("resting_length") for run in recordings]
        known = {float(length) for length in given if length is not None}
        everywhere = len(given) > 0 and None not in given
        return cls(force, pressure, contraction, max(known) if everywhere else None, len(known) if everywhere else 0)

    @property
    def braid_radius(self) -> float:
        """That of a braid which would pull the greatest force at the greatest pressure."""
        area = (
            math.pi
            * self.pressure
            * (3 / math.tan(_INITIAL_BRAID_ANGLE) ** 2 - 1 / math.sin(_INITIAL_BRAID_ANGLE) ** 2)
        )
        return min(max(math.sqrt(max(self.force, 1.0) / area), 2e-4), 0.1)


def standard_candidates(recordings: Sequence[Recording]) -> tuple[Candidate, ...]:
    """Every law that can be started from data alone; those that need a length, where the recordings state it."""
    sizes = DataScales.from_recordings(recordings)
    found = [Candidate(f"surface of degree {n}", blank_surface(n, 2 * sizes.force)) for n in range(1, 7)]
    found += [_sarosi2012(sizes), _hunt2017(sizes)]
    if sizes.max_length is not None:
        found += _laws_with_length(sizes, sizes.max_length)
    if sizes.length_count > 1 and sizes.max_length is not None:
        found += _length_families(sizes.max_length)
    return tuple(found)


def blank_surface(degree: int, max_force: float = _UNREACHED_FORCE) -> ContractileSurface:
    """A surface without coefficients yet, and with no clamp among the points."""
    return ContractileSurface.blank(degree, max_force=max(max_force, 1.0))


def _sarosi2012(sizes: DataScales) -> Candidate:
    scale = sizes.force / 1500.0  # of a DMSP-20, whose measured map these values fit
    by_pressure = scale * 6e5 / sizes.pressure
    return Candidate(
        "Sarosi2012",
        Sarosi2012(1.2e-4 * by_pressure, 420 * scale, -57.0, -8.7e-3 * by_pressure, 2.7e-3 * by_pressure, -310 * scale),
    )


def _hunt2017(sizes: DataScales) -> Candidate:
    scale = 450.0 / sizes.force  # the printed values are of a 10 mm muscle, which pulls about so much
    greatest = min(max(sizes.contraction, 0.02), 0.5)
    law = Hunt2017(greatest, span_by_force=0.331e-3 * scale * greatest / 0.17, by_force=1.23e3 * scale)
    return Candidate("Hunt2017", law)


def _laws_with_length(sizes: DataScales, length: float) -> list[Candidate]:
    braid = Braid(sizes.braid_radius, _INITIAL_BRAID_ANGLE, length)
    # The modulus of a DMSP-10 in terms of L/L_0; the wall's thickness only multiplies it, so that it stays.
    modulus = (74.085e6, -172.3e6 / length, 114.8e6 / length**2, -13.26e6 / length**3)
    return [
        Candidate("ChouHannaford1996", ChouHannaford1996(braid)),
        Candidate("TonduLopez2000", TonduLopez2000(braid, 1.1)),
        Candidate("MartensBoblan2017", MartensBoblan2017(braid, 1.8e-3, *modulus), ("wall_thickness",)),
        Candidate("Reynolds2003", Reynolds2003(length)),
        Candidate("Serres2009", Serres2009(length)),
    ]


def _length_families(length: float) -> list[Candidate]:
    found = []
    for degree in range(2, 6):
        inner = blank_surface(degree)
        found.append(Candidate(f"effective length, degree {degree}", EffectiveLength(inner, length, 0.005)))
        for change in range(1, min(degree, 3) + 1):
            words = f"degree {degree}, its change {change}"
            args = (inner, blank_surface(change), length, length)
            found.append(Candidate(f"term in 1/L0, {words}", InverseLength(*args)))
            found.append(Candidate(f"term in ln L0, {words}", LogarithmicLength(*args)))
    return found
