"""Energy consistency of a muscle: Maxwell and virtual-work defects."""

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from ....core import Array, SolveError
from ..geometry.base import Geometry
from .base import Characteristic
from .modes import values_or_nan
from .validity_range import ValidityRange

_POINTS = 41
"""Points of the grid along each side of a validity range."""
Sides = Callable[[Array, Array], tuple[Array, Array]]
"""Two quantities that should be equal, at gauge pressures [Pa] and contractions [1]."""


@dataclasses.dataclass(frozen=True)
class EnergyDefect:
    """Maximum difference of two quantities that should be equal over a validity range, and its
    location.
    """

    worst: float
    unit: str
    pressure: float
    contraction: float
    relative: float
    """`worst` divided by the maximum magnitude of the quantity that follows from the volume of the
    muscle.

    NaN if the volume is constant.
    """
    slack: float
    """Fraction of the validity range that was excluded because the muscle is slack there."""

    def __str__(self) -> str:
        relative = "–" if math.isnan(self.relative) else f"{100 * self.relative:.2f}"
        return f"{self.worst:.4g} {self.unit} ({relative} %) {self.place}"

    @property
    def place(self) -> str:
        """Where the difference is a maximum, and the excluded share, in words."""
        return (
            f"at {self.pressure / 1e3:.4g} kPa and {100 * self.contraction:.2f} % of contraction;"
            f" slack on {100 * self.slack:.0f} % of the validity range"
        )


def maxwell_defect(
    characteristic: Characteristic, geometry: Geometry, validity_range: ValidityRange
) -> EnergyDefect:
    """Maximum |dF/dp + dV/dL| [m2] over the validity range; zero if force and volume derive from
    one potential.

    F(p, L) tension, V(L) volume, dV/dL = -(dV/deps)/L0. A muscle with a defect generates or loses
    energy on a closed path of pressure and length: the defect times the enclosed area. Slack states
    are excluded, because the volume of a slack muscle does not follow from its length, and straight
    fibres, whose dV/dL is infinite. Raises SolveError if the muscle is slack everywhere.
    """

    def sides(pressure: Array, contraction: Array) -> tuple[Array, Array]:
        by_pressure = characteristic.slopes(pressure, contraction).by_pressure
        return by_pressure, geometry.volume_derivative(contraction) / geometry.resting_length

    return _largest(characteristic, sides, validity_range, "m2")


def virtual_work_defect(
    characteristic: Characteristic, geometry: Geometry, validity_range: ValidityRange
) -> EnergyDefect:
    """Maximum |F + p dV/dL| [N] over the taut states of the validity range: forces of wall and
    ends, model errors.

    Zero for an ideal muscle, whose force is due to its volume only. A law may conserve energy and
    still differ by the energy stored in its wall; `maxwell_defect` distinguishes the two. Raises
    SolveError if the muscle is slack everywhere.
    """

    def sides(pressure: Array, contraction: Array) -> tuple[Array, Array]:
        ideal = pressure * geometry.volume_derivative(contraction) / geometry.resting_length
        return characteristic.force(pressure, contraction), ideal

    return _largest(characteristic, sides, validity_range, "N")


def _largest(
    law: Characteristic, sides: Sides, validity_range: ValidityRange, unit: str
) -> EnergyDefect:
    edges = (
        np.linspace(*limits, _POINTS)
        for limits in (validity_range.pressure, validity_range.contraction)
    )
    p, c = (side.reshape(-1) for side in np.meshgrid(*edges))
    force = values_or_nan(law.force, p, c)
    taut = force > 0
    slack = float(np.mean(force[np.isfinite(force)] <= 0)) if np.isfinite(force).any() else 1.0
    if not taut.any():
        raise SolveError(
            f"{type(law).__name__} is slack in its whole validity range; the defect is not defined."
        )
    p = p[taut]
    c = c[taut]
    with np.errstate(invalid="ignore"):  # zero pressure times the infinite dV/dL of straight fibres
        actual, expected = (np.broadcast_to(side, p.shape) for side in sides(p, c))
    p, c, actual, expected = (side[np.isfinite(expected)] for side in (p, c, actual, expected))
    difference = np.abs(actual - expected)
    at = int(np.argmax(difference))
    worst = float(difference[at])
    scale = float(np.abs(expected).max())
    relative = worst / scale if scale > 0 else math.nan
    return EnergyDefect(worst, unit, float(p[at]), float(c[at]), relative, slack=slack)
