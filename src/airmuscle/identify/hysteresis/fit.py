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
from ...core.hints import Hint
from ...core.tree import Leaf
from ...friction import BoucWen, Dahl, Friction, LuGre, MaxwellSlip, PrandtlIshlinskii
from ...recording import Recording
from ...recording.segment import motion_direction
from .result import HysteresisFit, assess_fit
from .series import MILLIMETRES, Axis, LoopSeries

RowMask = npt.NDArray[np.bool_]


class FrictionPath(abc.ABC):
    """The displacement along which the friction slides, as a function of the recorded columns."""

    @abc.abstractmethod
    def displacement(self, recording: Recording) -> Array:
        """Displacement [m] at every row, shape (N,)."""

    @property
    def axis(self) -> Axis:
        """The axis of figures."""
        return MILLIMETRES


@model
class ContractionPath(FrictionPath):
    """x = eps L0: friction against shortening, visible in loops at constant pressure or load."""

    def displacement(self, recording: Recording) -> Array:
        return np.asarray(recording["contraction"] * _resting_length(recording))


@model
class PressurePath(FrictionPath):
    """x = c p: friction of braid threads that shift with pressure, visible in a muscle at constant length.

    Only k_i c, a force by pressure, is determined; c is chosen as 1 mm for each 100 kPa, so that the friction laws keep
    their units. Such a friction describes isometric loops only and cannot be part of a plant.
    """

    displacement_per_pressure: float = parameter(
        "m/Pa", "c", "displacement of the threads by pressure", bounds=(1e-12, 1e-3), fitted=False, default=1e-8
    )

    def displacement(self, recording: Recording) -> Array:
        return self.displacement_per_pressure * recording["pressure"]

    @property
    def axis(self) -> Axis:
        return Axis(
            "gauge pressure [kPa]", 1e-3 / self.displacement_per_pressure, "Pa", 1.0 / self.displacement_per_pressure
        )


class StaticCurve(abc.ABC):
    """The force without friction: a known part, and columns whose coefficients are fitted with the friction."""

    @abc.abstractmethod
    def known_force(self, recording: Recording) -> Array:
        """The known part of the force [N] at every row, shape (N,)."""

    @abc.abstractmethod
    def design_matrix(self, recording: Recording) -> Array:
        """The columns whose coefficients are fitted, shape (N, coefficients)."""


@dataclasses.dataclass(frozen=True)
class FixedCharacteristic(StaticCurve):
    """A known characteristic with a fitted constant offset of the force."""

    characteristic: Characteristic

    def known_force(self, recording: Recording) -> Array:
        return np.asarray(self.characteristic.force(recording["pressure"], recording["contraction"]), dtype=float)

    def design_matrix(self, recording: Recording) -> Array:
        return np.ones((len(recording), 1))


@dataclasses.dataclass(frozen=True)
class PolynomialCurve(StaticCurve):
    """A fitted polynomial in one column: `pressure` in isometric runs, `contraction` in isobaric runs."""

    column: str
    degree: int = 3

    def known_force(self, recording: Recording) -> Array:
        return np.zeros(len(recording))

    def design_matrix(self, recording: Recording) -> Array:
        scale = 1e5 if self.column == "pressure" else 0.1  # so that the coefficients have similar magnitudes
        return np.vander(recording[self.column] / scale, self.degree + 1)


def initial_friction_laws(path: Array, force: Array, elements: int = 8) -> tuple[Friction, ...]:
    """Every friction law with initial parameters, scaled by a path [m] and the forces [N] along it.

    `elements` is the number of elements of MaxwellSlip and PrandtlIshlinskii. Raises IdentificationError for a constant
    path.
    """
    stroke, amplitude = float(np.ptp(path)), max(float(np.std(force)), 1e-3)
    if not stroke > 0:
        raise IdentificationError(
            "the displacement of the friction is constant, so it cannot be identified. Give a run with a rising and a "
            "falling branch."
        )
    limits = tuple(stroke * np.geomspace(0.01, 0.7, elements))
    stiffness, equal = 10 * amplitude / stroke, (amplitude / elements / stroke,) * elements
    return (
        Dahl(stiffness, amplitude),
        LuGre(stiffness, amplitude, 0.2 * amplitude, stroke / 5.0),
        BoucWen(stiffness, amplitude, 1.5, 0.6),
        MaxwellSlip(equal, limits),
        PrandtlIshlinskii(equal, limits, (0.1 * amplitude, -0.1 * amplitude), (0.0, 0.0)),
    )


def fit_hysteresis(
    friction: Friction,
    recording: Recording,
    *,
    static_curve: StaticCurve,
    friction_path: FrictionPath = ContractionPath(),
    fitted_rows: RowMask | None = None,
    repeat: tuple[Recording, RowMask | None] | None = None,
) -> HysteresisFit:
    """Fit a friction law to the difference between a loop and its static curve, and test whether the data justify it.

    friction       the law with its initial parameters, see `initial_friction_laws`
    static_curve   the force without friction; its coefficients are fitted with the friction, and once more without it
                   for a fair comparison
    friction_path  the displacement along which the friction slides
    fitted_rows    mask of the rows whose residuals are minimised: quasi-static rows with a positive force. The path
                   includes all rows from the first, where the bristles are relaxed
    repeat         a second run of the same loop with its mask, for the repeatability and the error on other data

    Raises IdentificationError where there are too few rows or the path is constant.
    """
    run = make_loop_series(recording, static_curve, friction_path, fitted_rows)
    free = [leaf for leaf in tree.leaves(friction) if leaf.declared.fitted]
    if run.fitted_rows.sum() <= len(free) + run.design_matrix.shape[1] + 2 or not np.ptp(run.path) > 0:
        raise IdentificationError(
            f"{recording.origin}: {int(run.fitted_rows.sum())} fitted rows along a path of {np.ptp(run.path):.3g} m "
            f"cannot determine {len(free)} parameters of {type(friction).__name__} and {run.design_matrix.shape[1]} of "
            "the static curve. Give a run with a rising and a falling branch, or include more rows."
        )
    fitted = _fit_stiffnesses(friction, run) if friction.linear_in else _fit_iteratively(friction, run)
    second_run = make_loop_series(repeat[0], static_curve, friction_path, repeat[1]) if repeat else None
    return assess_fit(fitted, len(free), run, second_run)


def make_loop_series(
    recording: Recording, static_curve: StaticCurve, friction_path: FrictionPath, fitted_rows: RowMask | None
) -> LoopSeries:
    """The arrays of a run for a fit of friction."""
    target = recording["force"] - static_curve.known_force(recording)
    finite = np.isfinite(target)
    rows = finite if fitted_rows is None else np.asarray(fitted_rows, dtype=bool) & finite
    time = recording.columns.get("time")
    path = friction_path.displacement(recording)
    matrix = static_curve.design_matrix(recording)
    direction = motion_direction(path, time)
    return LoopSeries(recording.origin, path, time, target, matrix, rows, direction, friction_path.axis)


def _fit_stiffnesses(friction: Any, run: LoopSeries) -> Friction:
    """Stiffnesses of elements with given limits, by non-negative linear least squares."""
    from scipy.optimize import lsq_linear

    terms = friction.element_deflections(run.path)[run.fitted_rows]
    norms = np.linalg.norm(terms, axis=0)
    norms = np.where(norms > 0, norms, 1.0)
    matrix = np.hstack([run.design_matrix[run.fitted_rows], -terms / norms])
    lower = np.concatenate([np.full(run.design_matrix.shape[1], -np.inf), np.zeros(terms.shape[1])])
    result = lsq_linear(matrix, run.target[run.fitted_rows], (lower, np.inf), method="bvls")
    stiffnesses = np.maximum(result.x[run.design_matrix.shape[1] :], 0.0) / norms
    fitted: Friction = dataclasses.replace(friction, **{friction.linear_in: tuple(stiffnesses)})
    return fitted


def _fit_iteratively(friction: Friction, run: LoopSeries) -> Friction:
    """Nonlinear least squares over the free parameters; the static curve is solved for at every evaluation."""
    from scipy.optimize import least_squares

    all_leaves = list(tree.leaves(friction))
    free = [i for i, leaf in enumerate(all_leaves) if leaf.declared.fitted]
    coordinates = [_SearchCoordinate.from_leaf(all_leaves[i]) for i in free]

    def law(x: Sequence[float]) -> Friction:
        values = [leaf.value for leaf in all_leaves]
        for i, coordinate, value in zip(free, coordinates, x, strict=True):
            values[i] = coordinate.parameter_value(float(value))
        return tree.unflatten(friction, values)

    start = [c.start for c in coordinates]
    bounds = ([c.low for c in coordinates], [c.high for c in coordinates])
    result = least_squares(lambda x: run.fitted_residuals(law(x)), start, bounds=bounds, x_scale=1.0, max_nfev=60)
    return tree.with_parameters(friction, [leaf.value for leaf in tree.leaves(law(result.x))])


@dataclasses.dataclass(frozen=True)
class _SearchCoordinate:
    """A parameter as a search coordinate: its logarithm if its lower bound is positive, else scaled by its size."""

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
        """The parameter for a value of the coordinate."""
        return coordinate * self.size if self.size else float(np.exp(coordinate))


def _resting_length(recording: Recording) -> float:
    length = recording.constants.get("resting_length")
    if not isinstance(length, float | int):
        raise IdentificationError(
            f"{recording.origin}: friction against shortening needs the resting length.",
            hint=Hint("To state it", "resting_length", function="read"),
        )
    return float(length)
