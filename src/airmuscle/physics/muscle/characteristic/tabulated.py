"""Characteristic interpolated from a table of force over contraction at several pressures, without
overshoot.
"""

import functools
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from ....core import Array, ParameterError, SolveError, Value, model, parameter
from .base import Characteristic
from .calls import Slopes
from .solve import as_arrays, describe_range

_BISECTIONS = 60
"""Number of bisections; 2^-60 of the contraction range is below the rounding of its limits."""


@model
class Tabulated(Characteristic):
    """Interpolated table: monotone cubic (PCHIP) in contraction on each isobar, linear in pressure
    between isobars.

    The rows (p_i, eps_i, F_i) may be in any order. On an isobar the force must not increase with
    contraction, and it must not decrease from one isobar to the next, so that each quantity is
    uniquely determined by the other two. Isobars may cover different contraction ranges; between
    two of them the table covers their common range. Points outside the table raise SolveError. The
    slope with respect to pressure is discontinuous at the isobars: it is that of the interval
    above, or of the one below where the next isobar does not cover the contraction. A plant uses
    the table through `as_force_law`. Reference for the cubic: Fritsch and Carlson, SIAM J. Numer.
    Anal. 17:238 (1980).
    """

    traceable: ClassVar[bool] = False
    refuses_beyond: ClassVar[bool] = True

    pressures: tuple[float, ...] = parameter(
        "Pa", "p_i", "gauge pressures of the rows", fitted=False
    )
    contractions: tuple[float, ...] = parameter(
        "1", "eps_i", "contractions of the rows", fitted=False
    )
    forces: tuple[float, ...] = parameter("N", "F_i", "forces of the rows", fitted=False)

    def check(self) -> None:
        if len({len(self.pressures), len(self.contractions), len(self.forces)}) > 1:
            raise ParameterError(
                f"Tabulated: {len(self.pressures)} pressures, {len(self.contractions)} contractions"
                f" and {len(self.forces)} forces; each row requires all three."
            )
        table = self._isobars
        steps = np.diff(table.forces(np.array(self.contractions)), axis=0)
        if (steps < 0).any():
            contraction = self.contractions[int(np.argwhere(steps < 0)[0, 1])]
            raise ParameterError(
                f"Tabulated: at a contraction of {100 * contraction:.4g} % the force decreases with"
                " pressure. Correct the rows, or fit a surface to them."
            )

    @functools.cached_property
    def _isobars(self) -> "_IsobarTable":
        return _IsobarTable(self)

    @property
    def pressure_range(self) -> tuple[float, float]:
        return (min(self.pressures), max(self.pressures))

    @property
    def contraction_range(self) -> tuple[float, float]:
        return (min(self.contractions), max(self.contractions))

    def force(self, pressure: Value, contraction: Value) -> Value:
        return self._isobars.evaluate(pressure, contraction)[0][()]

    def slopes(self, pressure: Value, contraction: Value) -> Slopes:
        _, by_pressure, by_contraction = self._isobars.evaluate(pressure, contraction)
        return Slopes(by_pressure[()], by_contraction[()])

    def pressure(self, contraction: Value, force: Value) -> Value:
        table = self._isobars
        c, load = as_arrays(contraction, force)
        forces = table.forces(c)
        between = (forces[:-1] <= load) & (load <= forces[1:])
        _check_solvable(between.any(axis=0), self._no_pressure_message, (c, load), forces)
        j = between.argmax(axis=0)
        low, high = (
            np.take_along_axis(side, j[None], axis=0)[0] for side in (forces[:-1], forces[1:])
        )
        fraction = np.where(high > low, (load - low) / np.where(high > low, high - low, 1.0), 0.0)
        return (table.levels[j] + fraction * (table.levels[j + 1] - table.levels[j]))[()]

    def contraction(self, pressure: Value, force: Value) -> Value:
        table = self._isobars
        p, load = as_arrays(pressure, force)
        low, high = table.contraction_limits(p)
        ends = np.array([table.evaluate(p, low)[0], table.evaluate(p, high)[0]])
        _check_solvable(
            (load <= ends[0]) & (load >= ends[1]), self._no_contraction_message, (p, load), ends
        )
        for _ in range(_BISECTIONS):
            middle = (low + high) / 2
            above = table.evaluate(p, middle)[0] > load
            low = np.where(above, middle, low)
            high = np.where(above, high, middle)
        start = table.contraction_limits(p)[0]
        return np.where(ends[0] <= load, start, high)[()]


class _IsobarTable:
    """Preprocessed table: pressures of the isobars, their curves and their contraction ranges."""

    def __init__(self, law: Tabulated) -> None:
        rows = np.array([law.pressures, law.contractions, law.forces])
        self.levels: Array = np.unique(rows[0])
        if self.levels.size < 2:
            raise ParameterError("Tabulated: the table must contain at least two pressures.")
        self.curves = [_curve(p, *rows[1:, rows[0] == p]) for p in self.levels]
        self.last = [rows[2, rows[0] == p].min() for p in self.levels]
        self.slopes = [curve.derivative() for curve in self.curves]
        self.starts = np.array([curve.x[0] for curve in self.curves])
        self.ends = np.array([curve.x[-1] for curve in self.curves])

    def forces(self, contraction: Array) -> Array:
        """Force [N] of every isobar (first axis) at each contraction [1]; NaN outside its
        contraction range.
        """
        rows = zip(self.curves, self.ends, self.last, strict=True)
        # At its right end a cubic is exact only to rounding, which would exclude the last row of
        # the table.
        return np.array(
            [np.where(contraction == end, last, curve(contraction)) for curve, end, last in rows]
        )

    def evaluate(self, pressure: Any, contraction: Any) -> tuple[Array, Array, Array]:
        """Force [N] and its derivatives by pressure and contraction. Raises SolveError outside the
        table.
        """
        p, c = as_arrays(pressure, contraction)
        start, end = self.contraction_limits(p)
        outside = ~((c >= start) & (c <= end))
        if outside.any():
            at = np.unravel_index(int(np.argmax(outside)), outside.shape)
            point = f"{p[at] / 1e3:.4g} kPa"
            if not np.isnan(c[at]):
                point += f" and a contraction of {100 * c[at]:.4g} %"
            limits = f"{describe_range(100 * start[at], 100 * end[at], '%')} at this pressure"
            if np.isnan(start[at]):
                limits = describe_range(self.levels[0] / 1e3, self.levels[-1] / 1e3, "kPa")
            raise SolveError(f"Tabulated: {point} is outside the table, which covers {limits}.")
        j, fraction = self._bracketing_isobars(p)
        forces = self.forces(c)
        by_pressure = np.diff(forces, axis=0) / np.diff(self.levels).reshape(-1, *(1,) * c.ndim)
        above, below = (
            np.take_along_axis(by_pressure, k[None], axis=0)[0] for k in (j, np.maximum(j - 1, 0))
        )
        low, high = (np.take_along_axis(forces, k[None], axis=0)[0] for k in (j, j + 1))
        by_c = np.array([slope(c) for slope in self.slopes])
        low_by_c, high_by_c = (np.take_along_axis(by_c, k[None], axis=0)[0] for k in (j, j + 1))
        slope = np.where(np.isnan(above) & (fraction == 0), below, above)
        return _interpolate(fraction, low, high), slope, _interpolate(fraction, low_by_c, high_by_c)

    def contraction_limits(self, pressure: Array) -> tuple[Array, Array]:
        """Contraction limits of the table at each pressure [Pa]; NaN for pressures outside it."""
        j, fraction = self._bracketing_isobars(pressure)
        inside = (fraction >= 0) & (fraction <= 1)
        start = np.where(inside, np.maximum(self.starts[j], self.starts[j + 1]), np.nan)
        end = np.where(inside, np.minimum(self.ends[j], self.ends[j + 1]), np.nan)
        for on_isobar, k in ((fraction == 0, j), (fraction == 1, j + 1)):
            start = np.where(on_isobar, self.starts[k], start)
            end = np.where(on_isobar, self.ends[k], end)
        return start, end

    def _bracketing_isobars(self, pressure: Array) -> tuple[npt.NDArray[np.intp], Array]:
        """Index of the isobar below each pressure, and the fraction of the interval to the next
        isobar.
        """
        j = np.clip(
            np.searchsorted(self.levels, pressure, side="right") - 1, 0, self.levels.size - 2
        )
        return j, (pressure - self.levels[j]) / (self.levels[j + 1] - self.levels[j])


def _curve(pressure: float, contractions: Array, forces: Array) -> Any:
    """Return the PCHIP interpolant of one isobar. Raises ParameterError."""
    order = np.argsort(contractions)
    c = contractions[order]
    f = forces[order]
    if c.size < 2 or (np.diff(c) == 0).any() or (np.diff(f) > 0).any():
        raise ParameterError(
            f"Tabulated: the isobar at {pressure / 1e3:.4g} kPa must have at least two"
            " contractions, all different, and a force that does not increase with contraction."
            " Correct the rows, or fit a surface to them."
        )
    from scipy.interpolate import PchipInterpolator  # slow to import and rarely needed

    return PchipInterpolator(c, f, extrapolate=False)


def _interpolate(fraction: Array, low: Array, high: Array) -> Array:
    """Linear interpolation between two isobars; on an isobar its own value, even if its neighbour
    is undefined.
    """
    mixed: Array = np.where(
        fraction == 0, low, np.where(fraction == 1, high, low + fraction * (high - low))
    )
    return mixed


def _check_solvable(
    solvable: npt.NDArray[np.bool_],
    message: Callable[[float, float], str],
    given: tuple[Array, Array],
    forces: Array,
) -> None:
    """Raise SolveError for the first point without a solution, with the range of the tabulated
    forces [N] there.
    """
    if not solvable.all():
        first = int(np.argmin(solvable.reshape(-1)))
        column = forces.reshape(len(forces), -1)[:, first]
        known = "The table does not cover this point."
        if not np.isnan(column).all():
            known = (
                "Tabulated forces at this point:"
                f" {describe_range(np.nanmin(column), np.nanmax(column), 'N')}."
            )
        raise SolveError(message(*(values.flat[first] for values in given)) + known)
