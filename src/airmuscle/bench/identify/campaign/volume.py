"""Enclosed volume over contraction: its change from the static characteristic by virtual work, its value from fills."""

import dataclasses
from typing import Any

import numpy as np

from ....core import Array, PhysicsError
from ....physics import ChebyshevGeometry, ForceLaw

GRID, MIN_FORCE = 25, 0.02
"""Number of contractions, and of pressures, at which the slope of the force is evaluated, and minimum force of a point
for the slope, as a fraction of the maximum force (chosen)."""
DEGREE = 4
"""Degree of the polynomial of the volume (chosen)."""
MIN_RANGE = 0.02
"""Minimum range of the contractions of the fills from which the volume follows (chosen)."""


@dataclasses.dataclass(frozen=True, eq=False)
class VolumeChange:
    """Change of the enclosed volume [m3] from zero contraction, as a polynomial of the contraction.

    By virtual work the part of the force that is proportional to the pressure is -dV/dL, so that
    V(eps) = V(0) + L0 Int dF/dp deps (Chou and Hannaford, IEEE Trans. Robot. Autom. 12:90 (1996)).
    """

    coefficients: tuple[float, ...]
    """Of the powers of the contraction from 1 on [m3]."""
    resting_length: float
    max_contraction: float
    min_contraction: float = -0.02

    def __call__(self, contraction: Any) -> Any:
        """The change at a contraction, shape of the contraction [m3]."""
        eps = np.asarray(contraction, dtype=float)
        return sum(c * eps**power for power, c in enumerate(self.coefficients, 1))

    def geometry(self, volume_at_rest: float) -> ChebyshevGeometry:
        """The geometry with this volume at zero contraction [m3]."""
        low, high, degree = self.min_contraction, self.max_contraction, len(self.coefficients)
        middle, half = (low + high) / 2, (high - low) / 2
        values = np.polynomial.chebyshev.chebinterpolate(lambda x: volume_at_rest + self(middle + half * x), degree)
        return ChebyshevGeometry(tuple(values.tolist()), low, high, self.resting_length)


def volume_change(
    law: ForceLaw, resting_length: float, pressure: tuple[float, float], contraction: tuple[float, float]
) -> VolumeChange | None:
    """The change of volume of a muscle with this law in a range of pressure [Pa] and contraction; None if the force
    does not increase with the pressure there."""
    pressures = np.linspace(*pressure, GRID)
    contractions, slopes = [], []
    greatest = _force(law, np.array([pressure[1]]), max(contraction[0], 0.0))[0]
    for eps in np.linspace(max(contraction[0], 0.0), contraction[1], GRID).tolist():
        force = _force(law, pressures, eps)
        taut = force > MIN_FORCE * greatest
        if np.count_nonzero(taut) >= GRID // 3:
            contractions.append(eps)
            slopes.append(float(np.polyfit(pressures[taut], force[taut], 1)[0]))
    if len(slopes) < DEGREE or not min(slopes) > 0:
        return None
    slope = np.polynomial.polynomial.polyfit(contractions, slopes, DEGREE - 1)
    coefficients = tuple(float(resting_length * c / (k + 1)) for k, c in enumerate(slope))
    return VolumeChange(coefficients, resting_length, contractions[-1])


def _force(law: ForceLaw, pressures: Array, contraction: float) -> Array:
    try:
        return np.asarray(law.force(pressures, np.full(pressures.size, contraction)), dtype=float)
    except PhysicsError:
        return np.zeros(pressures.size)


@dataclasses.dataclass(frozen=True)
class VolumeEstimate:
    """Factor s of the volumes that a fit found for an assumed conductance, and the volume at rest [m3].

    s v_i = V(0) + dV(eps_i): a fill determines the ratio of volume and conductance, and fills at several lengths, whose
    change of volume is known, determine both.
    """

    scale: float
    scale_stderr: float
    volume_at_rest: float
    volume_stderr: float
    residual: float
    """Root mean square residual of the volumes [m3]; 0 for two fills."""


def relate_volumes(
    relative: Array, standard_errors: Array, contractions: Array, change: VolumeChange
) -> VolumeEstimate | None:
    """The volume at rest and the scale of the relative volumes; None unless the contractions differ enough."""
    if relative.size < 2 or float(np.ptp(contractions)) < MIN_RANGE:
        return None
    matrix = np.column_stack([relative, -np.ones(relative.size)])
    target = np.asarray(change(contractions))
    inverse = np.linalg.pinv(matrix)
    scale, volume = inverse @ target
    if not (scale > 0 and volume > 0):
        return None
    residuals = matrix @ np.array([scale, volume]) - target
    freedom = relative.size - 2
    variance = (scale * standard_errors) ** 2
    if freedom:  # what the fills do not explain is an error of the curve, equal for all of them
        explained = float(variance @ (1.0 - np.sum(matrix * inverse.T, axis=1)))
        variance = variance + max(float(residuals @ residuals) - explained, 0.0) / freedom
    errors = np.sqrt(np.square(inverse) @ variance)
    rms = float(np.sqrt(np.mean(residuals**2))) if freedom else 0.0
    return VolumeEstimate(float(scale), float(errors[0]), float(volume), float(errors[1]), rms)
