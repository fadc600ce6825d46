"""Levenberg-Marquardt within bounds, for residuals whose slopes come with them at little cost.

    (N + lambda D^2) s = -g,   N = J^T J, g = J^T r,   D the greatest norms of J's columns so far

An unknown on its bound, which the descent would push beyond, is held for that step; one that the step would carry
beyond goes to its bound, and the others are found anew. So it is with how far an unknown may go in one step: one that
hardly matters yet, and would go far, does not keep the others from going. The damping follows the ratio of actual to
promised descent.

Reference: Moré, J. J., The Levenberg-Marquardt algorithm: implementation and theory, Lecture Notes in Mathematics 630,
Springer 1978 (scaling by D); Nielsen, H. B., Damping parameter in Marquardt's method, IMM-REP-1999-05, DTU 1999.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...core.arrays import Array

Residuals = Callable[[Array], tuple[Array, Array] | None]
"""Residuals (R,) and slopes (R, P) at unknowns (P,); None where they cannot be had."""
INITIAL_DAMPING, MIN_DAMPING, MAX_DAMPING = 1e-3, 1e-12, 1e30
RELATIVE_STEP_LIMIT, MIN_STEP_LIMIT = 0.7, 0.25
"""How far an unknown may go in one step: by this share of itself, or of its scale or bounds where that is more. Chosen:
far from the optimum a step that promises much leads to plants that cannot be run, or only in tiny steps of time."""
TOLERANCE = 1e-10
"""A promised relative descent below which the search ends, and likewise a step."""
COST_NOISE = 1e-5
"""Share of a sum of squares by which it may jump, as runs of a stated tolerance change the number of their steps;
chosen. A step that promises less than a tenth of it, and finds the sum greater by no more than it, is taken: the slopes
still tell where to go, the sum no longer does. It ends the search unless it promises less than half of the last."""


class SearchState(NamedTuple):
    """Where a search stands: unknowns, the sum of squares there, and whether it came to its end."""

    x: Array
    cost: float
    finished: bool


class _NormalEquations(NamedTuple):
    """A sum of squares, the normal matrix and half the gradient."""

    cost: float
    normal: Array
    gradient: Array


def _normal_equations(found: tuple[Array, Array] | None) -> _NormalEquations | None:
    """None also where residuals or slopes are not finite, or too large to be squared."""
    if found is None:
        return None
    r, j = found
    with np.errstate(over="ignore", invalid="ignore"):
        squares = _NormalEquations(float(r @ r), j.T @ j, j.T @ r)
    return squares if squares.cost < np.inf and np.isfinite(squares.normal).all() else None


class LevenbergMarquardt:
    """A descent from `begin`, which can be left where it stands and taken up again.

    The sum of squares is infinite where the residuals cannot be had at `begin` itself.
    """

    def __init__(self, residuals: Residuals, begin: Array, low: Array, high: Array) -> None:
        self._residuals, self._low, self._high = residuals, low, high
        self._scale, self._damping, self._growth = np.zeros(begin.size), INITIAL_DAMPING, 2.0
        self._refused, self._promised, self._asked = np.full(begin.size, np.nan), np.inf, 1
        self.x = np.clip(begin, low, high)
        found = _normal_equations(residuals(self.x))
        self.ended = found is None
        self._accept(
            self.x, found or _NormalEquations(np.inf, np.zeros((begin.size, begin.size)), np.zeros(begin.size))
        )

    def run(self, most: int) -> None:
        """Search until the end, or until residuals were asked for `most` times in all."""
        while not self.ended and self._asked < most:
            self._step()

    def _accept(self, x: Array, found: _NormalEquations) -> None:
        self.x, (self.cost, self._normal, self._gradient) = x, found
        self._scale = np.maximum(self._scale, np.sqrt(self._normal.diagonal()))

    def _step(self) -> None:
        step, promised = self._propose_step()
        while not (done := self._is_converged(step, promised)) and (not promised > 0 or (step == self._refused).all()):
            self._reject(step)
            step, promised = self._propose_step()
        self.ended = done
        if not done:
            self._try_step(step, promised)

    def _try_step(self, step: Array, promised: float) -> None:
        """Take a step, or refuse it."""
        tried, self._asked = _normal_equations(self._residuals(self.x + step)), self._asked + 1
        new = np.inf if tried is None else tried.cost
        near = promised <= COST_NOISE / 10 * self.cost and self._damping < 1 and new <= (1 + COST_NOISE) * self.cost
        if near and new >= self.cost and promised > self._promised / 2:
            self.ended = True
        elif tried is not None and (near or new < self.cost):
            ratio = (self.cost - new) / promised if new < self.cost else 1.0
            self._accept(self.x + step, tried)
            self._damping = max(self._damping * max(1 / 3, 1 - (2 * ratio - 1) ** 3), MIN_DAMPING)
            self._growth, self._promised = 2.0, promised
        else:
            self._reject(step)

    def _reject(self, refused: Array) -> None:
        self._damping, self._growth, self._refused = self._damping * self._growth, 2 * self._growth, refused

    def _propose_step(self) -> tuple[Array, float]:
        """A step, and the descent that it promises."""
        x, scale = self.x, self._scale
        reach = np.maximum(RELATIVE_STEP_LIMIT * np.abs(x), MIN_STEP_LIMIT * np.minimum(self._high - self._low, 1.0))
        low, high = np.maximum(self._low, x - reach), np.minimum(self._high, x + reach)
        damping = self._damping * np.where(scale > 0, scale, 1.0) ** 2
        step = bounded_step(self._normal, self._gradient, damping, x, low, high)
        return step, -float(step @ (2 * self._gradient + self._normal @ step))

    def _is_converged(self, step: Array, promised: float) -> bool:
        """Whether a step is none any more, promises too little, or the damping is beyond all bounds."""
        if (0 <= promised <= TOLERANCE * self.cost and self._damping < 1) or not self._damping < MAX_DAMPING:
            return True
        far, at = self._scale * step, self._scale * self.x
        return bool(far @ far <= TOLERANCE**2 * (at @ at))

    @property
    def state(self) -> SearchState:
        """Where it stands."""
        return SearchState(self.x, self.cost, self.ended)


def minimise(residuals: Residuals, begin: Array, low: Array, high: Array, most: int) -> SearchState:
    """The search for a least sum of squares near `begin`, with residuals asked for at most `most` times."""
    search = LevenbergMarquardt(residuals, begin, low, high)
    search.run(most)
    return search.state


def bounded_step(normal: Array, gradient: Array, damping: Array, x: Array, low: Array, high: Array) -> Array:
    """The damped step; unknowns that it would carry beyond a bound go to that bound, and the others are found anew."""
    loose = ~(((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0)))
    step, matrix = np.zeros(x.size), normal + np.diag(damping)
    while loose.any():
        if loose.all():
            step[:] = np.linalg.solve(matrix, -gradient)
        else:
            right, free = gradient + normal @ np.where(loose, 0.0, step), np.flatnonzero(loose)
            step[free] = np.linalg.solve(matrix[free[:, None], free], -right[free])
        ahead = x + step
        beyond = loose & ((ahead < low) | (ahead > high))
        if not beyond.any():
            break
        step[beyond] = (np.clip(ahead, low, high) - x)[beyond]
        loose &= ~beyond
    return step
