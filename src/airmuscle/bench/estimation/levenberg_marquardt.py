"""Levenberg-Marquardt method with bounds: the one least-squares search of the bench, which can be
interrupted and continued.

    |T s + q|^2 + lambda |D s|^2 -> min,   J = Q T, q = Q^T r,   D the maximum norms of the columns
                                           of J so far

An unknown on its bound, with a gradient that points beyond it, is fixed for that step. An unknown
that the step would move beyond a bound is set to that bound, and the step of the others is computed
again. The same holds for the maximum change of an unknown in one step: an unknown with little
effect so far, and thus a large step, does not shorten the steps of the others. The damping follows
the ratio of the actual to the predicted reduction. The triangle T of the Jacobian, instead of its
normal equations, keeps the digits of unknowns that are hard to tell apart.

Reference: Moré, J. J., The Levenberg-Marquardt algorithm: implementation and theory, Lecture Notes
in Mathematics 630, Springer 1978 (scaling by D, step from the triangle); Nielsen, H. B., Damping
parameter in Marquardt's method, IMM-REP-1999-05, DTU 1999.
"""

import abc
from typing import NamedTuple, Self

import numpy as np

from ...core import Array
from .search import Checkpoint, goes_on

INITIAL_DAMPING = 1e-3
MIN_DAMPING = 1e-12
MAX_DAMPING = 1e30
MIN_DAMPING_OF_NORMAL = 1e-7
"""Damping, relative to the squares of the columns, from which the normal equations have enough
digits for a step (chosen)."""
RELATIVE_STEP_LIMIT = 0.7
MIN_STEP_LIMIT = 0.25
"""Maximum change of an unknown in one short step: this fraction of its value, or of its scale or
bounds if that is larger. Chosen: far from the optimum a long step leads to plants that cannot be
simulated, or only with tiny time steps, and to frictions without an effect."""


class Accuracy(NamedTuple):
    """The digits of a sum of squares, and where its search ends."""

    tolerance: float
    """Predicted relative reduction below which the search ends, and relative step likewise."""
    noise: float
    """Relative jump of the sum of squares that is no change of the model. A step with a predicted
    reduction below a tenth of it is accepted if the sum of squares increases by no more than it:
    the Jacobian still gives the direction, the sum no longer does. Such a step ends the search
    unless its predicted reduction is less than half of the last one."""
    has_short_steps: bool = False
    """Whether the change of an unknown in one step is limited."""


EXACT = Accuracy(1e-14, 1e-13)
"""Of a formula (chosen: above the rounding of a sum of a million squares)."""
EDGES = Accuracy(1e-9, 1e-7, has_short_steps=True)
"""Of a path with kinks, whose Jacobian is one of differences (chosen)."""
SIMULATED = Accuracy(1e-10, 1e-5, has_short_steps=True)
"""Of a simulation, whose step-size control makes the sum of squares jump (chosen)."""


class Evaluations(abc.ABC):
    """What a search minimises: a sum of squares, or of the loss of residuals, of P unknowns."""

    memory: tuple[float, ...] = ()
    """What the results depend on beside the unknowns, numbers that a checkpoint keeps."""

    @abc.abstractmethod
    def cost(self, x: Array) -> float:
        """The sum at unknowns (P,); infinite or NaN where it cannot be computed."""

    @abc.abstractmethod
    def linearise(self) -> "Linearisation":
        """The sum of squares that is tangent to the sum at the unknowns of the last `cost`."""


class Linearisation(NamedTuple):
    """Residuals (R,) and Jacobian (R, P) of a sum of squares; norms (P,) of the columns by which
    steps are damped, by default those of the Jacobian."""

    residuals: Array
    jacobian: Array
    norms: Array | None = None


class _Tangent(NamedTuple):
    """The sum, the triangle (P, P) and Q^T r (P,) of the sum of squares that is tangent, and the
    norms of its columns."""

    cost: float
    triangle: Array
    projected: Array
    norms: Array


class SearchState(NamedTuple):
    """All that determines how a search goes on."""

    x: Array
    cost: float
    triangle: Array
    projected: Array
    scale: Array
    damping: float
    growth: float
    rejected_step: Array
    predicted: float
    evaluations: int
    is_finished: bool
    memory: tuple[float, ...]


class LevenbergMarquardt:
    """A search from one initial guess, which can be interrupted and continued: unknowns `x` (P,),
    the sum there, `cost`, and whether it is `finished`. The sum is infinite where it cannot be
    computed at the initial guess. With a checkpoint it goes on from the state that an earlier call
    has kept."""

    def __init__(
        self,
        evaluations: Evaluations,
        start: Array,
        low: Array,
        high: Array,
        *,
        name: str = "search",
        accuracy: Accuracy = SIMULATED,
        checkpoint: Checkpoint | None = None,
    ) -> None:
        self._evaluations = evaluations
        self._low = low
        self._high = high
        self._name = name
        self._accuracy = accuracy
        self._checkpoint = checkpoint
        state = None if checkpoint is None else checkpoint.load()
        if state is not None:
            self._restore(SearchState(*state))
            return
        size = start.size
        self._scale = np.zeros(size)
        self._damping = INITIAL_DAMPING
        self._growth = 2.0
        self._rejected_step = np.full(size, np.nan)
        self._predicted = np.inf
        self._count = 1
        x = np.clip(start, low, high)
        cost = evaluations.cost(x)
        tangent = self._tangent(cost) if cost < np.inf else None
        nothing = _Tangent(np.inf, np.zeros((size, size)), np.zeros(size), np.zeros(size))
        self._accept(x, tangent or nothing)
        self.finished = tangent is None

    def run(self, max_evaluations: int) -> Self:
        """Search until convergence, or until the sum was evaluated `max_evaluations` times in
        total.
        """
        while not self.finished and self._count < max_evaluations:
            if not goes_on(self._name, self._count / max_evaluations):
                break
            self._step()
            if self._checkpoint is not None:
                self._checkpoint.save(self._state, last=self.finished)
        return self

    def _state(self) -> SearchState:
        return SearchState(
            self.x,
            self.cost,
            self._triangle,
            self._projected,
            self._scale,
            self._damping,
            self._growth,
            self._rejected_step,
            self._predicted,
            self._count,
            self.finished,
            tuple(self._evaluations.memory),
        )

    def _restore(self, state: SearchState) -> None:
        self.x = state.x
        self.cost = state.cost
        self._triangle = state.triangle
        self._projected = state.projected
        self._scale = state.scale
        self._damping = state.damping
        self._growth = state.growth
        self._rejected_step = state.rejected_step
        self._predicted = state.predicted
        self._count = state.evaluations
        self.finished = state.is_finished
        if state.memory:
            self._evaluations.memory = tuple(state.memory)

    def _tangent(self, cost: float) -> _Tangent | None:
        """The tangent at the unknowns that were evaluated last; None where it is not finite or
        overflows when squared.
        """
        residuals, jacobian, norms = self._evaluations.linearise()
        size = jacobian.shape[1]
        with np.errstate(over="ignore", invalid="ignore"):
            squares = np.einsum("rp,rp->p", jacobian, jacobian)
            if not np.isfinite(squares).all():
                return None
        matrix = np.concatenate([jacobian, residuals[:, None]], axis=1)
        triangle = np.asarray(np.linalg.qr(matrix, mode="r"))
        if len(triangle) < size:
            triangle = np.vstack([triangle, np.zeros((size - len(triangle), size + 1))])
        norms = np.sqrt(squares) if norms is None else norms
        return _Tangent(cost, triangle[:size, :size], triangle[:size, size], norms)

    def _accept(self, x: Array, tangent: _Tangent) -> None:
        self.x = x
        self.cost, self._triangle, self._projected, norms = tangent
        self._scale = np.maximum(self._scale, norms)

    def _step(self) -> None:
        """Propose steps until one is no repetition, evaluate it, and accept or reject it."""
        step, predicted = self._propose_step()
        while not (converged := self._is_converged(step, predicted)) and (
            not predicted > 0 or (step == self._rejected_step).all()
        ):
            self._reject(step)
            step, predicted = self._propose_step()
        if converged:
            self.finished = True
            return
        cost = self._evaluations.cost(self.x + step)
        self._count = self._count + 1
        noise = self._accuracy.noise
        small = predicted <= noise / 10 * self.cost and self._damping < 1
        within_noise = small and cost <= (1 + noise) * self.cost
        if within_noise and cost >= self.cost and predicted > self._predicted / 2:
            self.finished = True
            return
        tangent = self._tangent(cost) if within_noise or cost < self.cost else None
        if tangent is None:
            self._reject(step)
            return
        ratio = (self.cost - cost) / predicted if cost < self.cost else 1.0
        self._accept(self.x + step, tangent)
        self._damping = max(self._damping * max(1 / 3, 1 - (2 * ratio - 1) ** 3), MIN_DAMPING)
        self._growth = 2.0
        self._predicted = predicted

    def _reject(self, step: Array) -> None:
        """Increase the damping, and remember the rejected step."""
        self._damping = self._damping * self._growth
        self._growth = 2 * self._growth
        self._rejected_step = step

    def _propose_step(self) -> tuple[Array, float]:
        """A step, and the predicted reduction of the sum."""
        x = self.x
        low = self._low
        high = self._high
        if self._accuracy.has_short_steps:
            least = MIN_STEP_LIMIT * np.minimum(high - low, 1.0)
            limit = np.maximum(RELATIVE_STEP_LIMIT * np.abs(x), least)
            low = np.maximum(low, x - limit)
            high = np.minimum(high, x + limit)
        damping = self._damping * np.where(self._scale > 0, self._scale, 1.0) ** 2
        step = bounded_step(self._triangle, self._projected, damping, x, low, high)
        moved = self._triangle @ step
        return step, -float(moved @ (2 * self._projected + moved))

    def _is_converged(self, step: Array, predicted: float) -> bool:
        """Whether the step or its predicted reduction is negligible, or the damping exceeds its
        maximum.
        """
        tolerance = self._accuracy.tolerance
        if (
            0 <= predicted <= tolerance * self.cost and self._damping < 1
        ) or not self._damping < MAX_DAMPING:
            return True
        scaled_step = self._scale * step
        scaled_x = self._scale * self.x
        return bool(scaled_step @ scaled_step <= tolerance**2 * (scaled_x @ scaled_x))


def bounded_step(
    triangle: Array, projected: Array, damping: Array, x: Array, low: Array, high: Array
) -> Array:
    """The step s (P,) from x with the least |triangle s + projected|^2 + damping s^2; unknowns that
    it would move beyond a bound are set to it, the others recomputed.
    """
    gradient = triangle.T @ projected
    free = ~(((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0)))
    roots = np.sqrt(damping)
    if free.all():
        step = _damped_step(triangle, projected, roots)
        target = x + step
        if ((target >= low) & (target <= high)).all():
            return step
    step = np.zeros(x.size)
    while free.any():
        right = projected + triangle[:, ~free] @ step[~free]
        step[free] = _damped_step(triangle[:, free], right, roots[free])
        target = x + step
        beyond = free & ((target < low) | (target > high))
        if not beyond.any():
            break
        step[beyond] = (np.clip(target, low, high) - x)[beyond]
        free &= ~beyond
    return step


def _damped_step(columns: Array, right: Array, roots: Array) -> Array:
    """The step s (F,) with the least |columns s + right|^2 + |roots s|^2."""
    normal = columns.T @ columns
    norms = normal.diagonal() + roots * roots
    if (roots * roots > MIN_DAMPING_OF_NORMAL * norms).all():
        normal.flat[:: len(normal) + 1] = norms
        return np.asarray(np.linalg.solve(normal, -(columns.T @ right)))
    scales = np.sqrt(np.where(norms > 0, norms, 1.0))
    matrix = np.concatenate([columns / scales, np.diag(roots / scales)])
    target = np.concatenate([-right, np.zeros(roots.size)])
    orthogonal, triangle = np.linalg.qr(matrix)
    try:
        return np.asarray(np.linalg.solve(triangle, orthogonal.T @ target) / scales)
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(matrix, target, rcond=None)[0] / scales)
