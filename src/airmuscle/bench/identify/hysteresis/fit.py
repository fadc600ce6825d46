"""Friction from inflating and deflating branches: `fit_hysteresis`."""

import abc
import dataclasses
import inspect

import numpy as np

from ....core import Array, Hint, IdentificationError, check_whole, model, parameter
from ....physics import Characteristic, Friction, LoopScales
from ....physics.muscle import friction
from ....recording import Recording
from ...segment import Mask, motion_direction
from .limits import MILLIMETRES, Axis, data_limits, resolved_stiffness
from .result import HysteresisFit, assess_fit
from .search import LoopSeries, free_parameters, search_parameters


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
        length = recording.constants.get("resting_length")
        if not isinstance(length, float | int):
            raise IdentificationError(
                f"{recording.origin}: friction against shortening needs the resting length.",
                hint=Hint("To state it", "resting_length", function="ColumnMapping"),
            )
        return np.asarray(recording["contraction"] * float(length))


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
        by_displacement = 1.0 / self.displacement_per_pressure
        return Axis("gauge pressure [kPa]", 1e-3 / self.displacement_per_pressure, "Pa", by_displacement)


class StaticCurve(abc.ABC):
    """The force without friction: a known part, and columns whose coefficients are fitted with the friction."""

    def known_force(self, recording: Recording) -> Array:
        """The known part of the force [N] at every row, shape (N,); 0 unless overridden."""
        return np.zeros(len(recording))

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
    degree: int

    def design_matrix(self, recording: Recording) -> Array:
        scale = 1e5 if self.column == "pressure" else 0.1  # so that the coefficients have similar magnitudes
        return np.vander(recording[self.column] / scale, self.degree + 1)


def initial_friction_laws(path: Array, force: Array, elements: int = 8) -> tuple[Friction, ...]:
    """Every law of `friction` with a `guess`, its initial parameters scaled by a path [m] and the forces [N] along it.

    `elements` is the number of elements of MaxwellSlip and PrandtlIshlinskii. Raises IdentificationError for a constant
    path.
    """
    check_whole("initial_friction_laws", "elements", elements, 1)
    scales = LoopScales.of(path, force, elements)
    classes = (getattr(friction, name) for name in dir(friction))
    started = (cls.guess(scales) for cls in classes if inspect.isclass(cls) and issubclass(cls, Friction))
    return tuple(law for law in started if law is not None)


def fit_hysteresis(
    friction: Friction, recording: Recording, *, static_curve: StaticCurve,
    friction_path: FrictionPath = ContractionPath(), fitted_rows: Mask | None = None,
    repeat: tuple[Recording, Mask | None] | None = None,
) -> HysteresisFit:  # fmt: skip
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
    second_run = make_loop_series(repeat[0], static_curve, friction_path, repeat[1]) if repeat else None
    return fit_series(friction, run, second_run)


def fit_series(friction: Friction, run: LoopSeries, second_run: LoopSeries | None) -> HysteresisFit:
    """The fit of `fit_hysteresis` to the series of a run, and of a second run of the same loop."""
    free = free_parameters(friction)
    if run.fitted_rows.sum() <= free + run.design_matrix.shape[1] + 2 or not np.ptp(run.path) > 0:
        raise IdentificationError(
            f"{run.origin}: {int(run.fitted_rows.sum())} fitted rows along a path of {np.ptp(run.path):.3g} m "
            f"cannot determine {free} parameters of {type(friction).__name__} and {run.design_matrix.shape[1]} of "
            "the static curve. Give a run with a rising and a falling branch, or include more rows."
        )
    fitted, undetermined = search_parameters(friction, (run,))
    return assess_fit(fitted, undetermined, run, second_run)


def make_loop_series(
    recording: Recording, static_curve: StaticCurve, friction_path: FrictionPath, fitted_rows: Mask | None
) -> LoopSeries:
    """The arrays of a run for a fit of friction."""
    target = recording["force"] - static_curve.known_force(recording)
    finite = np.isfinite(target)
    rows = finite if fitted_rows is None else np.asarray(fitted_rows, dtype=bool) & finite
    path, time = friction_path.displacement(recording), recording.columns.get("time")
    matrix, limits = static_curve.design_matrix(recording), data_limits(recording["force"], path, time, rows)
    series = LoopSeries(
        recording.origin, path, time, target, matrix, rows, motion_direction(path, time), limits,
        recording.columns.get("pressure"), friction_path.axis,
    )  # fmt: skip
    stiffness = resolved_stiffness(path[rows], series.fitted_residuals(None))
    return dataclasses.replace(series, limits=dataclasses.replace(series.limits, stiffness=stiffness))
