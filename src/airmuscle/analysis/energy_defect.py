"""Energy consistency of a muscle: Maxwell and virtual-work defects."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from ..characteristic.base import Characteristic
from ..characteristic.validity_range import ValidityRange
from ..core.arrays import Array
from ..core.errors import SolveError
from ..geometry.base import Geometry

_POINTS = 41
"""Points of the grid along each side of a validity range."""


@dataclasses.dataclass(frozen=True)
class EnergyDefect:
    """The largest difference of two sides that should be equal over a validity range, and where it stands."""

    worst: float
    unit: str
    pressure: float
    contraction: float
    relative: float
    """`worst` over the largest magnitude of the side that the muscle's volume gives."""
    slack: float
    """The part of the validity range that was left out because the muscle does not pull there."""

    def __str__(self) -> str:
        return (
            f"{self.worst:.4g} {self.unit} ({self.relative:.2%}) at {self.pressure / 1e3:.4g} kPa and "
            f"{self.contraction:.2%} of contraction; slack on {self.slack:.0%} of the validity range"
        )


def maxwell_defect(characteristic: Characteristic, geometry: Geometry, validity_range: ValidityRange) -> EnergyDefect:
    """The largest |dF/dp + dV/dL| [m2] over the validity range; zero where force and volume come from one potential.

    F(p, L) tension, V(L) volume, dV/dL = -(dV/deps)/L0. A muscle with a defect makes or loses energy on a closed
    path of pressure and length: the defect times the area of the path. Only where the muscle pulls: the volume of
    a slack one does not follow from its length.
    """

    def sides(pressure: Array, contraction: Array) -> tuple[Array, Array]:
        by_pressure = characteristic.slopes(pressure, contraction).by_pressure
        return by_pressure, geometry.volume_derivative(contraction) / geometry.resting_length

    return _largest(characteristic, sides, validity_range, "m2")


def virtual_work_defect(
    characteristic: Characteristic, geometry: Geometry, validity_range: ValidityRange
) -> EnergyDefect:
    """The largest |F + p dV/dL| [N] over the validity range, where it pulls: the part of wall, ends and assumptions.

    Zero for a muscle that is nothing but its volume. A law may keep energy and still differ, by the energy that its
    wall stores; `maxwell_defect` tells the two apart.
    """

    def sides(pressure: Array, contraction: Array) -> tuple[Array, Array]:
        ideal = pressure * geometry.volume_derivative(contraction) / geometry.resting_length
        return characteristic.force(pressure, contraction), ideal

    return _largest(characteristic, sides, validity_range, "N")


def _largest(
    law: Characteristic, sides: Callable[[Array, Array], tuple[Array, Array]], validity_range: ValidityRange, unit: str
) -> EnergyDefect:
    p, c = (
        side.reshape(-1)
        for side in np.meshgrid(
            np.linspace(*validity_range.pressure, _POINTS), np.linspace(*validity_range.contraction, _POINTS)
        )
    )
    taut = np.asarray(law.force(p, c)) > 0
    if not taut.any():
        raise SolveError(f"{type(law).__name__} pulls nowhere on the validity range, so that no defect can be told.")
    p, c = p[taut], c[taut]
    found, due = (np.broadcast_to(side, p.shape) for side in sides(p, c))
    difference = np.abs(found - due)
    at = int(np.argmax(difference))
    worst = float(difference[at])
    relative = worst / float(np.abs(due).max())
    return EnergyDefect(worst, unit, float(p[at]), float(c[at]), relative, slack=float(1 - taut.mean()))
