"""What records cannot tell apart: directions of parameters along which nothing that was measured moves.

The design is scaled: residuals in standard deviations, parameters in fractions of their size. The standard deviation
along a right singular vector is 1/s; where it is large that combination of parameters is not determined.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ...core.arrays import Array

OPEN = 0.5
"""A combination whose standard deviation exceeds this fraction of its size counts as not determined; chosen."""
PART = 0.1
"""A parameter takes part in a direction from this share of the greatest on; chosen."""
RANK_TOLERANCE = 1e-7
"""Singular values below this fraction of the greatest are zero where slopes come from a run; chosen."""
EXACT = 1e-13
"""The same where slopes are exact to rounding; chosen."""

VOLUMES = ("volume", "rest_volume", "growth_volume", "radius", "resting_length", "braid_angle", "coefficients")
ADVICE: tuple[tuple[tuple[str, ...], tuple[str, ...], str], ...] = (
    (("conductance",), VOLUMES,
     "measure the volume by itself (weigh the water that fills the muscle), or fill a rigid vessel of known volume "
     "through the same valve"),
    (("critical_ratio",), ("pressure", "conductance"),
     "record the supply pressure during the run, and let the fill come to its end"),
    (("mass",), ("damping", "damping_slope", "stiffness"),
     "weigh the moving parts, or release the muscle with two loads that differ by a known mass"),
    (("exponent",), (*VOLUMES, "conductance"),
     "fill once quickly and once through a throttle, slowly enough to stay at room temperature"),
    (("start time",), ("conductance", *VOLUMES), "record the valve's command beside the pressure, on the same clock"),
    (("damping",), ("damping_slope",), "release at two pressures that lie well apart"),
)  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Undetermined:
    """One combination of parameters that the records leave open, and the experiment that would determine it."""

    shares: tuple[tuple[str, float], ...]
    """Parameters that take part, each with its relative change when the greatest changes by one."""
    deviation: float
    """Standard deviation along the combination, a fraction of the parameters' size; infinite where nothing moves."""
    experiment: str

    def __str__(self) -> str:
        names = [name for name, _ in self.shares]
        if len(names) == 1:
            return f"the records hardly depend on {names[0]} ({self._size()}). To determine it, {self.experiment}."
        moves = ", ".join(f"{name} {share:+.2f} %" for name, share in self.shares)
        return (
            f"the records cannot tell apart {' and '.join([', '.join(names[:-1]), names[-1]])} ({self._size()}): they "
            f"stay the same when these change together ({moves}). To separate them, {self.experiment}."
        )

    def _size(self) -> str:
        if not np.isfinite(self.deviation):
            return "not at all determined"
        return (
            f"open to {self.deviation:.0%} of their size" if len(self.shares) > 1 else f"open to {self.deviation:.0%}"
        )


@dataclasses.dataclass(frozen=True, eq=False)
class Identifiability:
    """Singular values of the scaled design, greatest first, its right singular vectors as rows, and what stays open."""

    singular: Array
    directions: Array
    undetermined: tuple[Undetermined, ...]
    tolerance: float

    @property
    def rank(self) -> int:
        """Directions along which the records move at all."""
        return int(np.count_nonzero(_counts(self.singular, self.tolerance)))

    @property
    def condition(self) -> float:
        """Greatest over least singular value."""
        least = float(self.singular[-1]) if self.singular.size else 1.0
        return float(self.singular[0]) / least if least > 0 else float("inf")

    def inverse(self) -> Array:
        """(J^T J)^-1 of the scaled design; NaN for parameters that take part in a direction without any trace."""
        counts = _counts(self.singular, self.tolerance)
        kept = self.directions[counts]
        found = (kept.T / self.singular[counts] ** 2) @ kept
        lost = (np.abs(self.directions[~counts]) > 1e-3).any(axis=0)
        found[lost, :] = np.nan
        found[:, lost] = np.nan
        return np.asarray(found)


def identifiable(
    slopes: Array, names: Sequence[str], scales: Array, scatter: float = 1.0, tolerance: float = RANK_TOLERANCE
) -> Identifiability:
    """What a design determines: slopes (R, P) of residuals in standard deviations by parameters of these sizes.

    `scatter` is the residuals' own standard deviation, where it is not 1; singular values below `tolerance` times the
    greatest count as zero.
    """
    design = slopes * scales
    triangle = np.linalg.qr(design, mode="r")
    short = design.shape[1] - len(triangle)
    _, singular, directions = np.linalg.svd(np.vstack([triangle, np.zeros((short, design.shape[1]))]))
    counts = _counts(singular, tolerance)
    deviations = np.where(counts, scatter / np.where(counts, singular, 1.0), np.inf)
    open_ones = [_undetermined(v, d, names) for v, d in zip(directions, deviations, strict=True) if d > OPEN]
    return Identifiability(singular, directions, tuple(reversed(open_ones)), tolerance)


def _counts(singular: Array, tolerance: float) -> npt.NDArray[np.bool_]:
    return np.asarray(singular > tolerance * singular[:1])


def _undetermined(direction: Array, deviation: float, names: Sequence[str]) -> Undetermined:
    share = direction / direction[np.argmax(np.abs(direction))]
    order = [int(i) for i in np.argsort(-np.abs(share)) if abs(share[i]) >= PART]
    parts = tuple((names[i], float(share[i])) for i in order)
    return Undetermined(parts, float(deviation), _advice([name for name, _ in parts]))


def _advice(names: Sequence[str]) -> str:
    kinds = {name.partition(" of record")[0].rpartition(".")[2].partition("[")[0] for name in names}
    for first, second, experiment in ADVICE:
        if len(kinds) > 1 and kinds & set(first) and kinds & set(second):
            return experiment
    if len(names) == 1:
        return "hold it at a value measured otherwise, or record a quantity that it acts on"
    return "measure one of them by itself and hold it fixed, or record a further quantity that they act on differently"
