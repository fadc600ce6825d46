"""Stochastic Gauss-Newton descent: least squares of many groups of rows, of which each iteration
evaluates a sample.

Normal matrix and gradient are running averages over the iterations. The result is the mean of
`CHECKED` iterates in turn with the smallest cost over a fixed sample.
"""

import abc
import dataclasses
import functools
import json
from typing import ClassVar, NamedTuple

import numpy as np
import numpy.typing as npt

from ...core import Array
from .problem import SimulatedProblem
from .search import Checkpoint, goes_on

MEMORY = 0.9
RATE = 0.3
DAMPING = 1e-2
LATE_DAMPING = 1e-3
MAX_CHANGE = 0.4
"""Share of the past in the running averages, step, damping and that of the second half of a stage,
without which a search stops far up a valley of two parameters that act alike; greatest relative
change of a parameter (chosen)."""
CHECKED = 10
LOST = 1.5
"""Iterations after which the cost of their mean is checked, and its ratio to the best one from
which the search has lost its way (chosen)."""


@dataclasses.dataclass(frozen=True)
class SearchStage:
    """Iterations with groups of `rows` rows, or of all if they have fewer, `batch` groups each."""

    rows: int
    iterations: int
    batch: int


class SampledProblem(SimulatedProblem):
    """A problem whose rows are in groups, of which a part can be evaluated."""

    clip: ClassVar[float]
    """Residual from which a row counts less."""

    @property
    @abc.abstractmethod
    def group_count(self) -> int:
        """Number of groups."""

    @abc.abstractmethod
    def linearise(
        self, values: Array, groups: npt.NDArray[np.intp], rows: int
    ) -> tuple[Array, Array]:
        """Residuals (N, rows) of these groups and their derivatives (N, rows, P); both 0 in rows
        that are left out.
        """

    @abc.abstractmethod
    def cost(self, values: Array, rows: int) -> float:
        """The robust mean square over a fixed sample of the groups."""


class DescentState(NamedTuple):
    """All that determines how a stage goes on."""

    step: int
    values: Array
    spread: float
    rate: float
    normal: Array
    slope: Array
    iterates: list[Array]
    """The last iterates, of which the mean is checked next."""
    best: Array
    cost: float
    random: str = ""
    """State of the generator of random numbers, as JSON; empty where it is that of the search."""


class SampledDescent:
    """A search that is run stage by stage; `values` (P,) are those reached."""

    def __init__(self, values: Array, seed: int) -> None:
        self.values = values
        self._random = np.random.default_rng(seed)
        self._spread = 0.1

    def run(self, problem: SampledProblem, stage: SearchStage, name: str) -> float:
        """Descend, and return the cost of the best mean of `CHECKED` iterates, at which `values`
        are then; a search that has lost its way goes on from that mean with half the step.

        name  of the search, for its progress
        """
        checkpoint = Checkpoint(__name__, (problem, stage, self.values, self._spread, self._drawn))
        stored = checkpoint.load()
        if stored is None:
            state = self._start(problem, stage)
        else:
            state = DescentState(*stored)
            self._random.bit_generator.state = json.loads(state.random)
        while state.step < stage.iterations and goes_on(name, state.step / stage.iterations):
            state = self._iterate(problem, stage, state)
            if state.step % CHECKED == 0:
                state = self._check(problem, stage.rows, state)
                reached = functools.partial(state._replace, random=self._drawn)
                checkpoint.save(reached, last=state.step == stage.iterations)
        self.values = state.best
        self._spread = state.spread
        return state.cost

    @property
    def _drawn(self) -> str:
        """The state of the generator of random numbers, as JSON."""
        return json.dumps(self._random.bit_generator.state)

    def _start(self, problem: SampledProblem, stage: SearchStage) -> DescentState:
        count = self.values.size
        return DescentState(
            step=0,
            values=self.values,
            spread=self._spread,
            rate=RATE,
            normal=np.zeros((count, count)),
            slope=np.zeros(count),
            iterates=[],
            best=self.values.copy(),
            cost=problem.cost(self.values, stage.rows),
        )

    def _iterate(
        self, problem: SampledProblem, stage: SearchStage, state: DescentState
    ) -> DescentState:
        """One Gauss-Newton step from a sample of the groups."""
        groups = np.sort(self._random.permutation(problem.group_count)[: stage.batch])
        error, gradient = problem.linearise(state.values, groups, stage.rows)
        size = max(float(np.sqrt(np.mean(error**2))), 1e-3)
        spread = 0.9 * state.spread + 0.1 * size
        weighted = gradient / np.sqrt(1.0 + (error / problem.clip) ** 2)[..., None]
        count = state.values.size
        flat = weighted.reshape(-1, count).T
        normal = MEMORY * state.normal + (1 - MEMORY) * (
            flat @ gradient.reshape(-1, count) / spread**2
        )
        slope = MEMORY * state.slope + (1 - MEMORY) * (flat @ error.ravel() / spread**2)
        step = state.step + 1
        late = step / stage.iterations
        damping = DAMPING if late <= 0.5 else LATE_DAMPING
        rate = 0.4 * state.rate if late > 0.7 else state.rate
        values = _moved(problem, state.values, normal, slope, rate, damping)
        return state._replace(
            step=step,
            values=values,
            spread=spread,
            normal=normal,
            slope=slope,
            iterates=[*state.iterates, values][-CHECKED:],
        )

    def _check(self, problem: SampledProblem, rows: int, state: DescentState) -> DescentState:
        """The state with the mean of the last iterates as the best, if it is."""
        mean = np.mean(state.iterates, axis=0)
        reached = problem.cost(mean, rows)
        if reached < state.cost:
            return state._replace(best=mean, cost=reached)
        if not reached < LOST * state.cost:
            return state._replace(values=state.best.copy(), rate=0.5 * state.rate)
        return state


def _moved(
    problem: SampledProblem,
    values: Array,
    normal: Array,
    slope: Array,
    rate: float,
    damping: float,
) -> Array:
    """The values after a damped step within the bounds, with the pull of the prior."""
    sizes = problem.coordinates.sizes
    priors = problem.priors
    pull = priors.jacobian(values)
    slope = slope + pull.T @ priors.residuals(values)
    normal = normal + pull.T @ pull
    scale = np.sqrt(np.diag(normal))
    scale = scale + 1e-6 * np.max(scale * sizes) / sizes
    damped = normal / np.outer(scale, scale) + damping * np.eye(len(slope))
    change = -np.linalg.solve(damped, slope / scale) / scale
    limit = MAX_CHANGE * np.maximum(np.abs(values), sizes)
    moved = values + np.clip(rate * change, -limit, limit)
    return np.asarray(np.clip(moved, *problem.bounds))
