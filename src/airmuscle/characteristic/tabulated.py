"""A table of force over contraction at several pressures, interpolated without overshoot."""

from __future__ import annotations

import functools
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from ..core.arrays import Array
from ..core.declaration import model, parameter
from ..core.errors import ParameterError, SolveError
from ..core.ops import Value
from .base import Characteristic, Slopes

_BISECTIONS = 60
"""Bisections of a contraction: 2^-60 of the table's width lies below the rounding of its ends."""


@model
class Tabulated(Characteristic):
    """Each isobar a monotone cubic over contraction (PCHIP); between two isobars the force is linear in pressure.

    The rows (p_i, eps_i, F_i) may come in any order. Along an isobar the force must not rise with contraction,
    and it must not fall from an isobar to the next, so that each quantity follows from the other two without a
    choice. Isobars need not reach equally far: where one of two neighbours ends, so does the table between them,
    and a question beyond raises NoSolution. The slope by pressure steps at the isobars. A plant takes the table
    through `as_force_law`. Reference for the cubic: Fritsch and Carlson, SIAM J. Numer. Anal. 17:238 (1980).
    """

    traceable: ClassVar[bool] = False

    pressures: tuple[float, ...] = parameter("Pa", "p_i", "gauge pressures of the rows", fitted=False)
    contractions: tuple[float, ...] = parameter("1", "eps_i", "contractions of the rows", fitted=False)
    forces: tuple[float, ...] = parameter("N", "F_i", "forces of the rows", fitted=False)

    def check(self) -> None:
        if len({len(self.pressures), len(self.contractions), len(self.forces)}) > 1:
            raise ParameterError(
                f"Tabulated: {len(self.pressures)} pressures, {len(self.contractions)} contractions and "
                f"{len(self.forces)} forces; each row needs all three."
            )
        table = _isobars(self)
        steps = np.diff(table.forces(np.array(self.contractions)), axis=0)
        if (steps < 0).any():
            at = self.contractions[int(np.argwhere(steps < 0)[0, 1])]
            raise ParameterError(
                f"Tabulated: at a contraction of {at:.2%} the force falls from one pressure to the next. "
                "Sort out the rows, or fit a surface to them."
            )

    @property
    def contraction_range(self) -> tuple[float, float]:
        return (min(self.contractions), max(self.contractions))

    def force(self, pressure: Value, contraction: Value) -> Value:
        return _isobars(self).evaluate(pressure, contraction)[0][()]

    def slopes(self, pressure: Value, contraction: Value) -> Slopes:
        _, by_pressure, by_contraction = _isobars(self).evaluate(pressure, contraction)
        return Slopes(by_pressure[()], by_contraction[()])

    def pressure(self, contraction: Value, force: Value) -> Value:
        table = _isobars(self)
        c, load = np.broadcast_arrays(np.asarray(contraction, dtype=float), np.asarray(force, dtype=float))
        forces = table.forces(c)
        between = (forces[:-1] <= load) & (load <= forces[1:])
        found = between.any(axis=0)
        if not found.all():
            worst = int(np.argmin(found.reshape(-1)))
            column = forces.reshape(table.levels.size, -1)[:, worst]
            raise SolveError(
                self._no_pressure_message(c.flat[worst], load.flat[worst]) + _describe_force_limits(column)
            )
        j = between.argmax(axis=0)
        low, high = (np.take_along_axis(side, j[None], axis=0)[0] for side in (forces[:-1], forces[1:]))
        share = np.where(high > low, (load - low) / np.where(high > low, high - low, 1.0), 0.0)
        return (table.levels[j] + share * (table.levels[j + 1] - table.levels[j]))[()]

    def contraction(self, pressure: Value, force: Value) -> Value:
        table = _isobars(self)
        p, load = np.broadcast_arrays(np.asarray(pressure, dtype=float), np.asarray(force, dtype=float))
        low, high = table.contraction_limits(p)
        ends = np.array([table.evaluate(p, low)[0], table.evaluate(p, high)[0]])
        refused = ~((load <= ends[0]) & (load >= ends[1]))
        if refused.any():
            at = int(np.argmax(refused.reshape(-1)))
            raise SolveError(
                self._no_contraction_message(p.flat[at], load.flat[at])
                + _describe_force_limits(ends.reshape(2, -1)[:, at])
            )
        for _ in range(_BISECTIONS):
            middle = (low + high) / 2
            above = table.evaluate(p, middle)[0] > load
            low, high = np.where(above, middle, low), np.where(above, high, middle)
        start = table.contraction_limits(p)[0]
        return np.where(ends[0] <= load, start, high)[()]


class _IsobarTable:
    """The table made ready: the pressures of the isobars, their curves and the contractions these cover."""

    def __init__(self, law: Tabulated) -> None:
        rows = np.array([law.pressures, law.contractions, law.forces])
        self.levels: Array = np.unique(rows[0])
        if self.levels.size < 2:
            raise ParameterError("Tabulated: the table needs two pressures at least.")
        self.curves = [_curve(p, *rows[1:, rows[0] == p]) for p in self.levels]
        self.last = [rows[2, rows[0] == p].min() for p in self.levels]
        self.slopes = [curve.derivative() for curve in self.curves]
        self.starts = np.array([curve.x[0] for curve in self.curves])
        self.ends = np.array([curve.x[-1] for curve in self.curves])

    def forces(self, contraction: Array) -> Array:
        """Force [N] of every isobar, first axis, at each contraction; NaN where it does not reach."""
        rows = zip(self.curves, self.ends, self.last, strict=True)
        # A cubic meets its right end only to rounding, which would put the last row of the table outside of it.
        return np.array([np.where(contraction == end, last, curve(contraction)) for curve, end, last in rows])

    def evaluate(self, pressure: Any, contraction: Any) -> tuple[Array, Array, Array]:
        """Force [N] and its slopes by pressure and contraction. Raises NoSolution outside the table."""
        p, c = np.broadcast_arrays(np.asarray(pressure, dtype=float), np.asarray(contraction, dtype=float))
        start, end = self.contraction_limits(p)
        outside = ~((c >= start) & (c <= end))
        if outside.any():
            worst = int(np.argmax(outside.reshape(-1)))
            raise SolveError(self._outside_message(p.flat[worst], c.flat[worst], start.flat[worst], end.flat[worst]))
        j, share = self._bracketing_isobars(p)
        low, high = (np.take_along_axis(self.forces(c), k[None], axis=0)[0] for k in (j, j + 1))
        by_c = np.array([slope(c) for slope in self.slopes])
        low_by_c, high_by_c = (np.take_along_axis(by_c, k[None], axis=0)[0] for k in (j, j + 1))
        by_pressure = (high - low) / (self.levels[j + 1] - self.levels[j])
        return _interpolate(share, low, high), by_pressure, _interpolate(share, low_by_c, high_by_c)

    def contraction_limits(self, pressure: Array) -> tuple[Array, Array]:
        """The contractions that the table covers at each pressure; NaN at pressures outside it."""
        j, share = self._bracketing_isobars(pressure)
        inside = (share >= 0) & (share <= 1)
        start = np.where(inside, np.maximum(self.starts[j], self.starts[j + 1]), np.nan)
        end = np.where(inside, np.minimum(self.ends[j], self.ends[j + 1]), np.nan)
        for on_isobar, k in ((share == 0, j), (share == 1, j + 1)):
            start, end = np.where(on_isobar, self.starts[k], start), np.where(on_isobar, self.ends[k], end)
        return start, end

    def _bracketing_isobars(self, pressure: Array) -> tuple[npt.NDArray[np.intp], Array]:
        """The isobar below each pressure, and the share of the way to the next."""
        j = np.clip(np.searchsorted(self.levels, pressure, side="right") - 1, 0, self.levels.size - 2)
        return j, (pressure - self.levels[j]) / (self.levels[j + 1] - self.levels[j])

    def _outside_message(self, pressure: float, contraction: float, start: float, end: float) -> str:
        there = "" if np.isnan(contraction) else f" and {contraction:.2%} of contraction"
        question = f"Tabulated: {pressure / 1e3:.6g} kPa{there} lie outside the table"
        if np.isnan(start):
            return f"{question}, which holds {self.levels[0] / 1e3:.6g} to {self.levels[-1] / 1e3:.6g} kPa."
        return f"{question}, which holds {start:.2%} to {end:.2%} at this pressure."


@functools.lru_cache(maxsize=64)
def _isobars(law: Tabulated) -> _IsobarTable:
    return _IsobarTable(law)


def _curve(pressure: float, contractions: Array, forces: Array) -> Any:
    order = np.argsort(contractions)
    c, f = contractions[order], forces[order]
    if c.size < 2 or (np.diff(c) == 0).any() or (np.diff(f) > 0).any():
        raise ParameterError(
            f"Tabulated: the isobar of {pressure / 1e3:.6g} kPa needs two contractions at least, each once, and a "
            "force that does not rise with contraction. Sort out the rows, or fit a surface to them."
        )
    from scipy.interpolate import PchipInterpolator  # slow to import, and most laws do without

    return PchipInterpolator(c, f, extrapolate=False)


def _interpolate(share: Array, low: Array, high: Array) -> Array:
    """Linear between two isobars; on an isobar its own value, though its neighbour may not reach there."""
    mixed: Array = np.where(share == 0, low, np.where(share == 1, high, low + share * (high - low)))
    return mixed


def _describe_force_limits(forces: Array) -> str:
    if np.isnan(forces).all():
        return "The table does not reach there."
    return f"There the table holds {np.nanmin(forces):.6g} to {np.nanmax(forces):.6g} N."
