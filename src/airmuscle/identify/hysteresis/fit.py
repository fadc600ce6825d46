"""Friction from inflating and deflating branches: `fit_hysteresis`."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ...characteristic.base import Characteristic
from ...core import tree
from ...core.arrays import Array
from ...core.declaration import model, parameter
from ...core.errors import IdentificationError
from ...core.tree import Leaf
from ...friction import BoucWen, Dahl, Friction, LuGre, MaxwellSlip, PrandtlIshlinskii
from ...recording import Recording
from ...recording.segment import motion_direction
from .result import MILLIMETRES, Axis, HysteresisFit, LoopSeries, assess_fit

RowMask = npt.NDArray[np.bool_]


class FrictionPath(abc.ABC):
    """What rubs: how far the friction has slid in each row of a recording."""

    @abc.abstractmethod
    def displacement(self, recording: Recording) -> Array:
        """Displacement [m] by row, shape (N,)."""

    @property
    def axis(self) -> Axis:
        """What figures draw instead of metres."""
        return MILLIMETRES


@model
class ContractionPath(FrictionPath):
    """x = eps L0: friction against shortening, which loops at constant pressure or load show."""

    def displacement(self, recording: Recording) -> Array:
        return np.asarray(recording["contraction"] * _resting_length(recording))


@model
class PressurePath(FrictionPath):
    """x = c p: friction of threads that shift as the pressure rises, which a muscle held at one length shows.

    Only k_i c, a force by pressure, is determined; c is chosen, 1 mm for each 100 kPa, so that the laws keep their
    units. Such a friction describes isometric loops and does not enter a plant.
    """

    displacement_per_pressure: float = parameter(
        "m/Pa", "c", "displacement of the threads by pressure", bounds=(1e-12, 1e-3), fitted=False, default=1e-8
    )

    def displacement(self, recording: Recording) -> Array:
        return self.displacement_per_pressure * recording["pressure"]

    @property
    def axis(self) -> Axis:
        return Axis("gauge pressure [kPa]", 1e-3 / self.displacement_per_pressure)


class StaticCurve(abc.ABC):
    """The force without friction: a known part, and columns whose coefficients are found along with the friction."""

    @abc.abstractmethod
    def known_force(self, recording: Recording) -> Array:
        """Force [N] by row that is not fitted."""

    @abc.abstractmethod
    def design_matrix(self, recording: Recording) -> Array:
        """Shape (N, coefficients)."""


@dataclasses.dataclass(frozen=True)
class FixedCharacteristic(StaticCurve):
    """A characteristic that stands, and a constant offset of the force beside it."""

    characteristic: Characteristic

    def known_force(self, recording: Recording) -> Array:
        return np.asarray(self.characteristic.force(recording["pressure"], recording["contraction"]), dtype=float)

    def design_matrix(self, recording: Recording) -> Array:
        return np.ones((len(recording), 1))


@dataclasses.dataclass(frozen=True)
class PolynomialCurve(StaticCurve):
    """A polynomial in one column, `pressure` in isometric runs and `contraction` in isobaric ones."""

    column: str
    degree: int = 3

    def known_force(self, recording: Recording) -> Array:
        return np.zeros(len(recording))

    def design_matrix(self, recording: Recording) -> Array:
        scale = 1e5 if self.column == "pressure" else 0.1  # coefficients of one size, whatever the run
        return np.vander(recording[self.column] / scale, self.degree + 1)


def initial_friction_laws(path: Array, force: Array, elements: int = 8) -> tuple[Friction, ...]:
    """A start for every friction law, sized by a path [m] and the forces [N] along it."""
    reach, size = float(np.ptp(path)), max(float(np.std(force)), 1e-3)
    if not reach > 0:
        raise IdentificationError("the path does not move, so that nothing rubs; give a run that goes up and down.")
    limits = tuple(reach * np.geomspace(0.01, 0.7, elements))
    stiffness, even = 10 * size / reach, (size / elements / reach,) * elements
    return (
        Dahl(stiffness, size),
        LuGre(stiffness, size, 0.2 * size, reach / 5.0),
        BoucWen(stiffness, size, 1.5, 0.6),
        MaxwellSlip(even, limits),
        PrandtlIshlinskii(even, limits, (0.1 * size, -0.1 * size), (0.0, 0.0)),
    )


def fit_hysteresis(
    friction: Friction,
    recording: Recording,
    *,
    static: StaticCurve,
    slide: FrictionPath = ContractionPath(),
    chosen: RowMask | None = None,
    repeat: tuple[Recording, RowMask | None] | None = None,
) -> HysteresisFit:
    """The friction that explains what a static curve leaves of a loop, and whether the data justify it.

    `friction` gives the law and its start; see `candidates`. The path is followed through every row from the first,
    where the bristles are relaxed; errors count in the `chosen` rows, the quasi-static ones where the muscle pulls.
    Coefficients of `static` are found together with the friction, and once more without it, for a fair comparison.
    `repeat` is a second run of the same loop with its chosen rows: it gives the floor of repeatability, and a judge.
    Raises IdentificationError where there are too few rows or the path does not move.
    """
    run = make_loop_series(recording, static, slide, chosen)
    free = [leaf for leaf in tree.leaves(friction) if leaf.declared.fitted]
    if run.fitted_rows.sum() <= len(free) + run.design_matrix.shape[1] + 2 or not np.ptp(run.path) > 0:
        raise IdentificationError(
            f"{recording.origin}: {int(run.fitted_rows.sum())} chosen rows along a path of {np.ptp(run.path):.3g} m cannot "
            f"determine {len(free)} parameters of {type(friction).__name__} and {run.design_matrix.shape[1]} of the static "
            "curve. Give a run that goes up and down, or choose more rows."
        )
    found = _fit_stiffnesses(friction, run) if friction.linear_in else _fit_iteratively(friction, run)
    other = make_loop_series(repeat[0], static, slide, repeat[1]) if repeat else None
    return assess_fit(found, len(free), run, other)


def make_loop_series(
    recording: Recording, static: StaticCurve, slide: FrictionPath, chosen: RowMask | None
) -> LoopSeries:
    """A run as a fit of friction sees it."""
    goal = recording["force"] - static.known_force(recording)
    rows = np.isfinite(goal) if chosen is None else np.asarray(chosen, dtype=bool) & np.isfinite(goal)
    time = recording.columns.get("time")
    path = slide.displacement(recording)
    way = motion_direction(path, time)
    return LoopSeries(recording.origin, path, time, goal, static.design_matrix(recording), rows, way, slide.axis)


def _fit_stiffnesses(friction: Any, run: LoopSeries) -> Friction:
    """Stiffnesses of elements with given limits: least squares without a search, none of them negative."""
    from scipy.optimize import lsq_linear

    terms = friction.terms(run.path)[run.fitted_rows]
    weight = np.linalg.norm(terms, axis=0)
    weight = np.where(weight > 0, weight, 1.0)
    design = np.hstack([run.design_matrix[run.fitted_rows], -terms / weight])
    lowest = np.concatenate([np.full(run.design_matrix.shape[1], -np.inf), np.zeros(terms.shape[1])])
    solved = lsq_linear(design, run.target[run.fitted_rows], (lowest, np.inf), method="bvls")
    stiffnesses = np.maximum(solved.x[run.design_matrix.shape[1] :], 0.0) / weight
    changed: Friction = dataclasses.replace(friction, **{friction.linear_in: tuple(stiffnesses)})
    return changed


def _fit_iteratively(friction: Friction, run: LoopSeries) -> Friction:
    """Least squares over the free parameters; the static curve is solved for at every step."""
    from scipy.optimize import least_squares

    all_leaves = list(tree.leaves(friction))
    free = [i for i, leaf in enumerate(all_leaves) if leaf.declared.fitted]
    scales = [_SearchCoordinate.from_leaf(all_leaves[i]) for i in free]

    def law(x: Sequence[float]) -> Friction:
        values = [leaf.value for leaf in all_leaves]
        for i, scale, coordinate in zip(free, scales, x, strict=True):
            values[i] = scale.parameter_value(float(coordinate))
        return tree.unflatten(friction, values)

    start = [s.start for s in scales]
    bounds = ([s.low for s in scales], [s.high for s in scales])
    solved = least_squares(lambda x: run.fitted_residuals(law(x)), start, bounds=bounds, x_scale=1.0, max_nfev=60)
    return tree.with_parameters(friction, [leaf.value for leaf in tree.leaves(law(solved.x))])


@dataclasses.dataclass(frozen=True)
class _SearchCoordinate:
    """A parameter as the search sees it: its logarithm where it is positive throughout, else by its size."""

    start: float
    low: float
    high: float
    size: float

    @classmethod
    def from_leaf(cls, leaf: Leaf) -> _SearchCoordinate:
        low, high = leaf.declared.bounds
        if low > 0:
            return cls(float(np.log(leaf.value)), float(np.log(low)), float(np.log(high)), 0.0)
        size = abs(leaf.value) or 1.0
        return cls(leaf.value / size, low / size, high / size, size)

    def parameter_value(self, coordinate: float) -> float:
        """The parameter for a coordinate of the search."""
        return coordinate * self.size if self.size else float(np.exp(coordinate))


def _resting_length(recording: Recording) -> float:
    length = recording.constants.get("resting_length")
    if not isinstance(length, float | int):
        raise IdentificationError(
            f"{recording.origin}: friction against shortening needs the resting length; give resting_length."
        )
    return float(length)
