"""Identifiability: null directions of the sensitivity matrix.

The matrix is scaled: residuals in standard deviations, parameters in fractions of their magnitude.
The standard error along a right singular vector is 1/s, with s the singular value; where it is
large, that combination of parameters is not determined.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ...core import Array
from .ties import first_greatest, in_order

MAX_RELATIVE_ERROR = 0.5
"""Relative standard error above which a combination of parameters counts as undetermined;
chosen.
"""
MIN_SHARE = 0.1
"""Minimum component of a parameter in a direction, relative to the largest one, to be listed;
chosen.
"""
RANK_TOLERANCE = 1e-7
"""Relative singular value below which it counts as zero, for sensitivities from a simulation;
chosen.
"""
EXACT_RANK_TOLERANCE = 1e-13
"""The same for sensitivities that are exact to rounding; chosen."""

VOLUMES = (
    "volume",
    "rest_volume",
    "growth_volume",
    "radius",
    "resting_length",
    "braid_angle",
    "coefficients",
)
REMEDIES: tuple[tuple[tuple[str, ...], tuple[str, ...], str], ...] = (
    (
        ("conductance",),
        VOLUMES,
        (
            "measure the volume separately (weigh the water that fills the muscle), or fill a rigid"
            " vessel of known volume through the same valve"
        ),
    ),
    (
        ("critical_ratio",),
        ("pressure", "conductance"),
        (
            "record the supply pressure during the run, and record the fill until the pressure is"
            " steady"
        ),
    ),
    (
        ("mass",),
        ("damping", "growth", "stiffness"),
        "weigh the moving parts, or release the muscle with two loads that differ by a known mass",
    ),
    (
        ("exponent",),
        (*VOLUMES, "conductance"),
        "fill once fast and once through a throttle, slowly enough to stay at room temperature",
    ),
    (
        ("start time",),
        ("conductance", *VOLUMES),
        "record the valve command together with the pressure",
    ),
    (("damping",), ("growth",), "release at two clearly different pressures"),
    (
        ("stribeck_force", "stribeck_speed", "bristle_damping"),
        ("coulomb_force", "stribeck_force", "damping"),
        "measure loops at clearly different speeds",
    ),
)
"""Two groups of parameters that are often confounded, by the last part of their paths, and the
remedy.
"""


@dataclasses.dataclass(frozen=True)
class UndeterminedCombination:
    """A combination of parameters that the data do not determine, and an experiment that would
    determine it.
    """

    shares: tuple[tuple[str, float], ...]
    """Names of the parameters, each with its relative change when the largest one changes by 1."""
    relative_stderr: float
    """Standard error along the combination relative to the parameters; infinite where no output
    changes.
    """
    remedy: str

    def __str__(self) -> str:
        names = [name for name, _ in self.shares]
        error = "not determined at all"
        if np.isfinite(self.relative_stderr):
            error = (
                f"poorly determined (relative standard error {100 * self.relative_stderr:.0f} %)"
            )
        if len(names) == 1:
            return f"{names[0]} is {error}. To determine it, {self.remedy}."
        changes = ", ".join(f"{name} {share:+.2f} %" for name, share in self.shares)
        return (
            f"{', '.join(names[:-1])} and {names[-1]} are {error}: the modelled data stay the same"
            f" if they change together ({changes}). To separate them, {self.remedy}."
        )


@dataclasses.dataclass(frozen=True, eq=False)
class Identifiability:
    """Singular value decomposition of the scaled sensitivity matrix, and the undetermined
    combinations. `singular_values` are in decreasing order, `right_singular_vectors` are rows."""

    singular_values: Array
    right_singular_vectors: Array
    undetermined: tuple[UndeterminedCombination, ...]
    tolerance: float

    @property
    def rank(self) -> int:
        """Numerical rank of the sensitivity matrix."""
        return int(np.count_nonzero(self._nonzero))

    @property
    def _nonzero(self) -> npt.NDArray[np.bool_]:
        return np.asarray(self.singular_values > self.tolerance * self.singular_values[:1])

    @property
    def condition(self) -> float:
        """Condition number of the sensitivity matrix; infinite for a singular matrix."""
        smallest = float(self.singular_values[-1]) if self.singular_values.size else 1.0
        return float(self.singular_values[0]) / smallest if smallest > 0 else float("inf")

    def inverse(self) -> Array:
        """(J^T J)^-1 of the scaled matrix J, shape (P, P); NaN for parameters in the null space."""
        nonzero = self._nonzero
        vectors = self.right_singular_vectors[nonzero]
        inverse = (vectors.T / self.singular_values[nonzero] ** 2) @ vectors
        null = (np.abs(self.right_singular_vectors[~nonzero]) > 1e-3).any(axis=0)
        inverse[null, :] = inverse[:, null] = np.nan
        return np.asarray(inverse)


def singular_vectors(matrix: Array) -> tuple[Array, Array]:
    """The singular values (P,) and the right singular vectors (P, P), one a row, of a matrix (R,
    P). R of the QR factorisation of a tall matrix has the same ones, at less cost; of a wide matrix
    the last values are 0.
    """
    triangle = np.linalg.qr(matrix, mode="r")
    missing = np.zeros((matrix.shape[1] - len(triangle), matrix.shape[1]))
    _, singular, vectors = np.linalg.svd(np.vstack([triangle, missing]))
    return singular, vectors


def analyse_identifiability(
    sensitivities: Array,
    names: Sequence[str],
    scales: Array,
    residual_std: float = 1.0,
    tolerance: float = RANK_TOLERANCE,
) -> Identifiability:
    """The identifiability of parameters from a sensitivity matrix (R, P) of residuals in standard
    deviations.

    scales        magnitudes of the parameters, shape (P,)
    residual_std  standard deviation of the scaled residuals, if it is not 1
    tolerance     relative singular value below which it counts as zero
    """
    singular, vectors = singular_vectors(sensitivities * scales)
    nonzero = singular > tolerance * singular[:1]
    errors = np.where(nonzero, residual_std / np.where(nonzero, singular, 1.0), np.inf)
    undetermined = [
        _describe_combination(vector, error, names)
        for vector, error in zip(vectors, errors, strict=True)
        if error > MAX_RELATIVE_ERROR
    ]
    return Identifiability(singular, vectors, tuple(reversed(undetermined)), tolerance)


def _describe_combination(
    vector: Array, relative_stderr: float, names: Sequence[str]
) -> UndeterminedCombination:
    shares = vector / vector[first_greatest(np.abs(vector))]
    indices = [i for i in range(shares.size) if abs(shares[i]) >= MIN_SHARE]
    order = in_order(indices, lambda i: -abs(float(shares[i])), lambda i: i)
    listed = tuple((names[i], float(shares[i])) for i in order)
    kinds = {
        name.partition(" of record")[0].rpartition(".")[2].partition("[")[0] for name, _ in listed
    }
    general = (
        "measure and fix one of them, or record a further quantity on which they have different"
        " effects"
    )
    if len(listed) == 1:
        general = (
            "fix it at a value that was measured separately, or record a quantity on which it has"
            " an effect"
        )
    confounded = (
        remedy
        for first, second, remedy in REMEDIES
        if len(kinds) > 1 and kinds & set(first) and kinds & set(second)
    )
    return UndeterminedCombination(listed, float(relative_stderr), next(confounded, general))
