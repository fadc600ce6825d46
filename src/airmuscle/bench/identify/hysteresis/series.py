"""LoopSeries: path, target force and design matrix of one run of a loop."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import numpy.typing as npt

from ....core.arrays import Array
from ....physics.muscle.friction import Friction
from .axis import MILLIMETRES, Axis
from .limits import DataLimits


@dataclasses.dataclass(frozen=True, eq=False)
class LoopSeries:
    """One run of a loop as a fit of friction uses it; N rows, C coefficients of the static curve."""

    origin: str
    path: Array
    """Displacement of the friction [m], shape (N,)."""
    time: Array | None
    """Time [s], shape (N,), if the recording has one."""
    target: Array
    """Force [N] to be explained by the static curve and the friction, shape (N,)."""
    design_matrix: Array
    """Columns of the static curve, shape (N, C)."""
    fitted_rows: npt.NDArray[np.bool_]
    """Mask of the rows whose residuals are minimised."""
    direction: Array
    """1 where the path rises, -1 where it falls."""
    limits: DataLimits
    """Maximum force and range of the speed of the fitted rows."""
    pressure: Array | None = None
    """Gauge pressure [Pa], shape (N,), of a friction that depends on the pressure; None if it is not recorded."""
    axis: Axis = MILLIMETRES
    transient_rows: int = 0
    """Number of fitted rows in which the pressure changes quickly."""

    def coefficients(self, friction: Friction | None) -> Array:
        """Least-squares coefficients of the static curve with this friction, or without friction; shape (C,)."""
        return self._coefficients(self._friction_force(friction))

    def residuals(self, friction: Friction | None, coefficients: Array) -> Array:
        """Measured - modelled force [N] at every row, shape (N,)."""
        return self._residuals(self._friction_force(friction), coefficients)

    def fitted_residuals(self, friction: Friction | None) -> Array:
        """Residuals [N] at the fitted rows, with the least-squares coefficients of the static curve."""
        force = self._friction_force(friction)
        return self._residuals(force, self._coefficients(force))[self.fitted_rows]

    def friction_force(self, friction: Friction) -> Array:
        """Friction force [N] at every row and its pressure, shape (N,)."""
        force = np.asarray(friction.force_along(self.path, self.time))
        return force if self.pressure is None else np.asarray(friction.pressure_factor(self.pressure) * force)

    def _friction_force(self, friction: Friction | None) -> Array | None:
        return None if friction is None else self.friction_force(friction)

    def _coefficients(self, friction_force: Array | None) -> Array:
        rows = self.fitted_rows
        target = self.target if friction_force is None else self.target + friction_force
        return np.asarray(self._pseudoinverse @ target[rows])

    @functools.cached_property
    def _pseudoinverse(self) -> Array:
        """Pseudoinverse of the design matrix at the fitted rows, shape (C, fitted rows)."""
        return np.asarray(np.linalg.pinv(self.design_matrix[self.fitted_rows]))

    def _residuals(self, friction_force: Array | None, coefficients: Array) -> Array:
        difference = self.target - self.design_matrix @ coefficients
        return difference if friction_force is None else difference + friction_force
