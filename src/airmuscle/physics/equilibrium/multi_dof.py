"""Equilibria of a plant with several coordinates by Newton's method from many start points at once."""

import numpy as np
import numpy.typing as npt

from ...core import Array
from .statics import Rows, Statics

STARTS = 60
"""Number of start points, spread evenly over the permitted contractions of the muscles (chosen)."""
ITERATIONS = 40
RESIDUAL_TOLERANCE = 1e-8
"""Residual acceleration of an equilibrium, relative to the largest at the start points (chosen)."""
DISTINCT = 1e-6
"""Equilibria closer than this fraction of the nominal sizes of the coordinates are the same (chosen)."""


def equilibria_of_several_coordinates(statics: Statics) -> tuple[Rows, Array]:
    """Row of the plant and coordinates (d,) of every equilibrium, sorted by row and coordinates."""
    rows, places = [], []
    for row in range(len(statics.parameters)):
        equilibria = _equilibria(statics.of(np.array([row])))
        rows += [row] * len(equilibria)
        places += equilibria
    return np.array(rows, dtype=np.intp), np.array(places).reshape(len(rows), len(statics.plants.mechanism.coordinates))


def _equilibria(one: Statics) -> list[Array]:
    """All equilibria of one plant that the start points lead to, sorted by their coordinates."""
    sizes = one.nominal_sizes()
    x = starts(one)
    if not len(x):
        return []
    f = one.accelerations(x[None])[0]
    equilibria: list[Array] = []
    for place in _newton(one, x, f, sizes, RESIDUAL_TOLERANCE * np.abs(f).max()):
        if all(np.abs((place - other) / sizes).max() > DISTINCT for other in equilibria):
            equilibria.append(place)
    return sorted(equilibria, key=tuple)


def starts(one: Statics) -> Array:
    """Start points (K, d) within the permitted range of one plant: evenly spread contractions (additive recurrence)."""
    limits = [[float(np.asarray(end).flat[0]) for end in ends] for ends in one.contraction_limits]
    low, high = np.array(limits).T
    high = np.minimum(high, 0.5)  # at greater contractions a muscle is beyond its maximum volume
    root = 2.0
    for _ in range(30):
        root = (1.0 + root) ** (1.0 / (low.size + 1))
    steps = root ** -np.arange(1.0, low.size + 1)
    targets = low + (high - low) * ((0.5 + np.arange(STARTS)[:, None] * steps) % 1.0)
    x = _coordinates_of(one, targets)
    inside = one.within_reach(x[None])[0] & np.isfinite(one.accelerations(x[None])[0]).all(axis=1)
    permitted: Array = x[inside]
    return permitted


def _contractions(one: Statics, x: Array) -> Array:
    """Contractions (K, muscles) at coordinates (K, d)."""
    return np.stack([eps[0] for eps in one.contractions(x[None])], axis=-1)


def _coordinates_of(one: Statics, targets: Array) -> Array:
    """Coordinates (K, d) whose contractions are nearest to the targets (K, muscles)."""
    sizes: Array = one.nominal_sizes()
    x: Array = np.zeros((len(targets), sizes.size))
    for _ in range(4):
        at = _contractions(one, x)
        perturbed = [_contractions(one, x + 1e-6 * step) for step in np.diag(sizes)]
        slopes = np.stack([(value - at) / 1e-6 for value in perturbed], axis=-1)
        x = np.add(x, sizes * _least_squares(slopes, targets - at, 1e-15))
    return x


def _least_squares(matrices: Array, right: Array, rcond: float) -> Array:
    """Least-squares solutions (K, d) for matrices (K, r, d); NaN for matrices that are not finite."""
    solution: Array = np.full((len(matrices), matrices.shape[2]), np.nan)
    finite = np.isfinite(matrices).all(axis=(1, 2)) & np.isfinite(right).all(axis=1)
    solution[finite] = np.einsum("kdr,kr->kd", np.linalg.pinv(matrices[finite], rcond=rcond), right[finite])
    return solution


def _newton(one: Statics, x: Array, f: Array, sizes: Array, tolerance: float) -> list[Array]:
    """Equilibria that Newton's method finds from x (K, d); its steps are halved until the residual decreases."""
    equilibria = []
    for _ in range(ITERATIONS):
        step = _steps(one, x, f, sizes)
        following, after, decreased = _descend(one, x, f, step)
        ended = (np.abs(step / sizes).max(axis=1) < 1e-13) | ~decreased
        equilibria += list(x[ended & np.isfinite(step).all(axis=1) & (np.abs(f).max(axis=1) <= tolerance)])
        x, f = following[~ended], after[~ended]
        if not len(x):
            break
    return equilibria


def _descend(one: Statics, x: Array, f: Array, step: Array) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
    """Next points, their residuals, and for which of them a fraction of the step decreases the residual."""
    following, after, decreased = x.copy(), f.copy(), np.zeros(len(x), dtype=bool)
    waiting = np.flatnonzero(np.isfinite(step).all(axis=1))
    for part in 0.5 ** np.arange(12):
        if not waiting.size:
            break
        trial = x[waiting] + part * step[waiting]
        at = one.accelerations(trial[None])[0]
        with np.errstate(invalid="ignore"):
            better = np.abs(at).max(axis=1) < np.abs(f[waiting]).max(axis=1)
        better &= one.within_reach(trial[None])[0]
        rows = waiting[better]
        following[rows], after[rows], decreased[rows] = trial[better], at[better], True
        waiting = waiting[~better]
    return following, after, decreased


def _steps(one: Statics, x: Array, f: Array, sizes: Array) -> Array:
    """Newton's step (K, d) by central differences, one-sided at the ends of the range; NaN if it does not exist."""
    slopes = np.empty((len(x), f.shape[1], x.shape[1]))
    for k, perturbation in enumerate(np.diag(1e-5 * sizes)):
        ends = [np.where(one.within_reach(p[None])[0][:, None], p, x) for p in (x + perturbation, x - perturbation)]
        span = (ends[0] - ends[1])[:, k] / sizes[k]
        difference = one.accelerations(ends[0][None])[0] - one.accelerations(ends[1][None])[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            slopes[:, :, k] = difference / span[:, None]
    scale = np.abs(slopes).max(axis=2)
    scale[scale == 0.0] = 1.0
    return np.asarray(-sizes * _least_squares(slopes / scale[:, :, None], f / scale, 1e-14))
