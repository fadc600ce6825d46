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

MAX_RELATIVE_ERROR = 0.5
"""A combination whose standard deviation exceeds this fraction of its size counts as not determined; chosen."""
MIN_SHARE = 0.1
"""A parameter takes part in a direction from this share of the greatest on; chosen."""
RANK_TOLERANCE = 1e-7
"""Singular values below this fraction of the greatest are zero where slopes come from a run; chosen."""
EXACT_RANK_TOLERANCE = 1e-13
"""The same where slopes are exact to rounding; chosen."""

VOLUMES = ("volume", "rest_volume", "growth_volume", "radius", "resting_length", "braid_angle", "coefficients")
REMEDIES: tuple[tuple[tuple[str, ...], tuple[str, ...], str], ...] = (
    (("conductance",), VOLUMES,
     "measure the volume by itself (weigh the water that fills the muscle), or fill a rigid vessel of known volume "
     "through the same valve"),
    (("critical_ratio",), ("pressure", "conductance"),
     "record the supply pressure during the run, and let the fill come to its end"),
    (("mass",), ("damping", "growth", "stiffness"),
     "weigh the moving parts, or release the muscle with two loads that differ by a known mass"),
    (("exponent",), (*VOLUMES, "conductance"),
     "fill once quickly and once through a throttle, slowly enough to stay at room temperature"),
    (("start time",), ("conductance", *VOLUMES), "record the valve's command beside the pressure, on the same clock"),
    (("damping",), ("growth",), "release at two pressures that lie well apart"),
)  # fmt: skip


@dataclasses.dataclass(frozen=True)
class UndeterminedCombination:
    """One combination of parameters that the records leave open, and the experiment that would determine it."""

    shares: tuple[tuple[str, float], ...]
    """Parameters that take part, each with its relative change when the greatest changes by one."""
    relative_stderr: float
    """Standard deviation along the combination, a fraction of the parameters' size; infinite where nothing moves."""
    remedy: str

    def __str__(self) -> str:
        names = [name for name, _ in self.shares]
        if len(names) == 1:
            return (
                f"the records hardly depend on {names[0]} ({self._describe_error()}). To determine it, {self.remedy}."
            )
        moves = ", ".join(f"{name} {share:+.2f} %" for name, share in self.shares)
        return (
            f"the records cannot tell apart {' and '.join([', '.join(names[:-1]), names[-1]])} ({self._describe_error()}): they "
            f"stay the same when these change together ({moves}). To separate them, {self.remedy}."
        )

    def _describe_error(self) -> str:
        if not np.isfinite(self.relative_stderr):
            return "not at all determined"
        return (
            f"open to {self.relative_stderr:.0%} of their size"
            if len(self.shares) > 1
            else f"open to {self.relative_stderr:.0%}"
        )


@dataclasses.dataclass(frozen=True, eq=False)
class Identifiability:
    """Singular values of the scaled design, greatest first, its right singular vectors as rows, and what stays open."""

    singular_values: Array
    right_singular_vectors: Array
    undetermined: tuple[UndeterminedCombination, ...]
    tolerance: float

    @property
    def rank(self) -> int:
        """Directions along which the records move at all."""
        return int(np.count_nonzero(_is_nonzero(self.singular_values, self.tolerance)))

    @property
    def condition(self) -> float:
        """Greatest over least singular value."""
        least = float(self.singular_values[-1]) if self.singular_values.size else 1.0
        return float(self.singular_values[0]) / least if least > 0 else float("inf")

    def inverse(self) -> Array:
        """(J^T J)^-1 of the scaled design; NaN for parameters that take part in a direction without any trace."""
        counts = _is_nonzero(self.singular_values, self.tolerance)
        kept = self.right_singular_vectors[counts]
        found = (kept.T / self.singular_values[counts] ** 2) @ kept
        lost = (np.abs(self.right_singular_vectors[~counts]) > 1e-3).any(axis=0)
        found[lost, :] = np.nan
        found[:, lost] = np.nan
        return np.asarray(found)


def analyse_identifiability(
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
    counts = _is_nonzero(singular, tolerance)
    deviations = np.where(counts, scatter / np.where(counts, singular, 1.0), np.inf)
    open_ones = [
        _describe_combination(v, d, names)
        for v, d in zip(directions, deviations, strict=True)
        if d > MAX_RELATIVE_ERROR
    ]
    return Identifiability(singular, directions, tuple(reversed(open_ones)), tolerance)


def _is_nonzero(singular: Array, tolerance: float) -> npt.NDArray[np.bool_]:
    return np.asarray(singular > tolerance * singular[:1])


def _describe_combination(direction: Array, deviation: float, names: Sequence[str]) -> UndeterminedCombination:
    share = direction / direction[np.argmax(np.abs(direction))]
    order = [int(i) for i in np.argsort(-np.abs(share)) if abs(share[i]) >= MIN_SHARE]
    parts = tuple((names[i], float(share[i])) for i in order)
    return UndeterminedCombination(parts, float(deviation), _find_remedy([name for name, _ in parts]))


def _find_remedy(names: Sequence[str]) -> str:
    kinds = {name.partition(" of record")[0].rpartition(".")[2].partition("[")[0] for name in names}
    for first, second, experiment in REMEDIES:
        if len(kinds) > 1 and kinds & set(first) and kinds & set(second):
            return experiment
    if len(names) == 1:
        return "hold it at a value measured otherwise, or record a quantity that it acts on"
    return "measure one of them by itself and hold it fixed, or record a further quantity that they act on differently"
