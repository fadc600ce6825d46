"""Search for the gains with the smallest objective, by an evolution strategy."""

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from typing import Any

import numpy as np

from ...core import Array, ParameterError, SimulationError, check_known, leaves
from ...engine.distribution import DistributedCalls
from ...engine.loop import ControlLaw
from ...engine.processes import Workers, process_pool
from ...engine.run.integrators import Integrator
from .case import GainRange, LoopCase, check_cases, gain_ranges, to_coordinates, to_gains
from .evaluation import Evaluator, group_cases, joined_metrics
from .objective import (
    CaseMetrics,
    Objective,
    RobustObjective,
    RootMeanSquareError,
    TrackingIndex,
    TuningHistory,
)
from .result import Tuning

FIRST_WIDTH = 0.25
"""Standard deviation of the first generation, in parts of the range (chosen)."""


class EvolutionStrategy:
    """Covariance matrix adaptation from a first mean (D,); points outside the unit cube are moved
    to its surface.

    A generation x_i = m + s N(0, C) is ranked. The mean m is the weighted mean of its better half;
    the covariance C follows the steps that led to them (rank mu) and the path of the mean (rank
    one), the step size s the length of that path. Only ranks count, so that a discontinuous
    objective, or one with failed runs, is permitted. Reference: Hansen (2016).
    """

    def __init__(self, mean: Array, random: np.random.Generator) -> None:
        d = mean.size
        self.mean = mean.copy()
        self._random = random
        self._step = FIRST_WIDTH
        self._covariance = np.eye(d)
        self._path = np.zeros(d)
        self._step_path = np.zeros(d)
        self._generations = 0
        # the number of points and parents, and the weights of the parents
        self.size = max(8, 4 + int(3 * math.log(d)))
        parents = self.size // 2
        # better parents count more, by the logarithm of their rank
        ranks = np.arange(1, parents + 1)
        largest = math.log(parents + 0.5)
        weights = largest - np.log(ranks)
        self._weights = weights / weights.sum()
        mass = 1.0 / float(np.sum(self._weights**2))
        self._mass = mass
        # the rates and the damping as Hansen (2016) recommends them, table 1
        self._path_rate = (4 + mass / d) / (d + 4 + 2 * mass / d)
        self._step_rate = (mass + 2) / (d + mass + 5)
        self._rank_one = 2 / ((d + 1.3) ** 2 + mass)
        rank_mu = 2 * (mass - 2 + 1 / mass) / ((d + 2) ** 2 + mass)
        self._rank_mu = min(1 - self._rank_one, rank_mu)
        excess = max(0.0, math.sqrt((mass - 1) / (d + 1)) - 1)
        self._damping = 1 + 2 * excess + self._step_rate
        # expected length of a normal random vector
        correction = 1 - 1 / (4 * d) + 1 / (21 * d * d)
        self._usual = math.sqrt(d) * correction

    @property
    def width(self) -> float:
        """The largest standard deviation of the present distribution."""
        return self._step * float(np.sqrt(np.linalg.eigvalsh(self._covariance)[-1]))

    def ask(self) -> Array:
        """The points (S, D) of the next generation."""
        values, axes = np.linalg.eigh(self._covariance)
        normal = self._random.standard_normal((self.size, self.mean.size))
        steps = self._step * (normal * np.sqrt(values))
        points: Array = self.mean + steps @ axes.T
        return np.clip(points, 0.0, 1.0)

    def tell(self, points: Array, values: Array) -> None:
        """Adapt the distribution to the values (S,) of a generation (S, D); smaller is better."""
        mass = self._mass
        parents = points[np.argsort(values)[: self._weights.size]]
        steps = (parents - self.mean) / self._step
        move = self._weights @ steps
        self.mean = self.mean + self._step * move
        self._generations = self._generations + 1
        eigenvalues, axes = np.linalg.eigh(self._covariance)
        whitened = axes @ ((axes.T @ move) / np.sqrt(eigenvalues))
        rate = self._step_rate
        gain = math.sqrt(rate * (2 - rate) * mass)
        self._step_path = (1 - rate) * self._step_path + gain * whitened
        length = float(np.linalg.norm(self._step_path))
        short = self._is_short(length)
        rate = self._path_rate
        gain = short * math.sqrt(rate * (2 - rate) * mass)
        self._path = (1 - rate) * self._path + gain * move
        lost = (1 - short) * self._rank_one * rate * (2 - rate)
        self._adapt_covariance(steps, lost)
        excess = length / self._usual - 1
        self._step *= math.exp(self._step_rate / self._damping * excess)

    def _adapt_covariance(self, steps: Array, lost: float) -> None:
        """Let the covariance follow the path of the mean and the steps (M, D) of the parents;
        `lost` is the share that a path which waits does not contribute.
        """
        remaining = (1 - self._rank_one - self._rank_mu + lost) * self._covariance
        by_path = self._rank_one * np.outer(self._path, self._path)
        weighted = steps.T * self._weights
        by_steps = self._rank_mu * (weighted @ steps)
        # the last term keeps the covariance positive definite in rounding
        least = 1e-14 * np.eye(self.mean.size)
        self._covariance = remaining + by_path + by_steps + least

    def _is_short(self, length: float) -> float:
        """1 unless the path of the step size is long, else 0.

        A long path shows a step size that is too small; the path of the mean then waits, lest the
        covariance grow in its place.
        """
        settled = math.sqrt(1 - (1 - self._step_rate) ** (2 * self._generations))
        longest = (1.4 + 2 / (self.mean.size + 1)) * self._usual
        return 1.0 if length / settled < longest else 0.0


SETS_OF_A_TASK = 4
"""Sets of gains of one task of an executor (chosen: a generation has eight or more)."""
MIN_SETS = 8
"""Smallest first generation, and smallest number of sets of gains of a search (chosen)."""
PATIENCE = 8
TOLERANCE = 0.005
"""A descent ends where so many generations lower the objective by less than this part of it
(chosen).
"""
AGREEMENT = 0.02
"""Relative difference of the objectives within which two descents agree (chosen)."""
APART = 0.25
"""Distance of the starts of two descents in the unit cube, relative to its diagonal (chosen)."""
Progress = Callable[[int, int], None]


def tune(
    cases: Sequence[LoopCase],
    bounds: Mapping[str, tuple[float, float]],
    *,
    duration: float,
    index: TrackingIndex = RootMeanSquareError(),
    objective: Objective = RobustObjective(),
    simulations: int = 4000,
    seed: int = 0,
    start: Sequence[Mapping[str, float]] = (),
    start_time: float = 0.0,
    integrator: Integrator | None = None,
    progress: Progress | None = None,
    workers: Workers = 1,
) -> Tuning:
    """Find the gains of a controller that minimise an objective over a family of cases.

    cases       the family: LoopCase with the same controller; the first one is the nominal case
    bounds      minimum and maximum [SI] of each gain by its path in the controller; see `GainRange`
                for the scale
    duration    of each run [s]
    index       tracking index of a run, evaluated at the sampling instants
    objective   from the metrics (E, M) of E sets of gains in M cases to values (E,); smaller is
                better
    simulations maximum number of simulated loops: sets of gains times cases
    seed        of the optimiser; the same seed gives the same result on any number of cores
    start       sets of gains for the first generation, such as those of tuning rules; the present
                gains of the controller are always among them if they are within the bounds, so that
                the result is never worse
    start_time, integrator  as in simulate_batch
    progress    called with the number of loops simulated so far, and the maximum
    workers     number of processes, for several of which a script needs `if __name__ ==
                "__main__":`, or an executor; by default this process, which uses all cores. Loops
                of a ControlLaw are compiled and use all cores in one process, so that further local
                ones are started for other controllers alone. The result does not depend on it

    The optimiser is the evolution strategy CMA-ES (Hansen 2016), with the same settings for every
    controller. The first generation are Sobol points, from whose best one a descent begins; further
    descents begin at other points of it. The search ends as converged where the two best descents
    agree (`Tuning.converged`), otherwise after its simulations. It requires bounds alone, accepts a
    discontinuous objective (saturation, switchings, failed runs), and evaluates a generation at
    once, which is one batch on all cores. A set of gains that fails in a share p of the cases ranks
    behind all that do not, in the order of p; its objective is infinite.

    If the user interrupts, the best gains so far are returned (`Tuning.interrupted`), unless there
    are none. Raises ParameterError for impossible cases, bounds or options, SimulationError if
    every set of gains fails.
    """
    family = check_cases(cases)
    duration = _check_options(duration, index, objective, simulations, seed, len(family))
    ranges = gain_ranges(family[0].controller, bounds)
    paths = tuple(gain_range.path for gain_range in ranges)
    evaluator = Evaluator(
        family, group_cases(family, index), paths, duration, index, integrator, start_time
    )
    search = _Search(
        evaluator, ranges, objective, simulations, progress or (lambda done, total: None)
    )
    start_points = search.given(start)
    with process_pool(useful_workers(workers, family)) as executor:
        interrupted = search.run(start_points, seed, executor)
    if not search.values:
        raise KeyboardInterrupt
    gains = np.concatenate(search.gains)
    values = np.concatenate(search.values)
    history = TuningHistory(paths, gains, values, joined_metrics(search.metrics))
    result = Tuning(
        family,
        ranges,
        index,
        evaluator.groups[0].scales,
        objective,
        duration,
        start_time,
        seed,
        simulations,
        history,
        search.present_count,
        search.converged,
        interrupted,
    )
    if not math.isfinite(result.objective):
        reason = next(
            (text for text, _ in search.reasons.most_common(1)), "the index is not finite"
        )
        raise SimulationError(
            f"tune: each of {len(result.history)} sets of gains fails in at least one case; most"
            f" frequent reason: {reason}. Narrow the bounds, check the set point, or leave out the"
            " cases that no controller can hold."
        )
    return result


def useful_workers(workers: Workers, family: Sequence[LoopCase]) -> Workers:
    """The workers that shorten a search: an executor as given, and local processes for controllers
    that are called from Python, whose loops use one core.
    """
    if isinstance(workers, Executor) or workers < 2:
        return workers
    compiled = all(isinstance(case.loop.controller, ControlLaw) for case in family)
    return 1 if compiled else workers


def _check_options(
    duration: Any, index: Any, objective: Any, simulations: Any, seed: Any, count: int
) -> float:
    if (
        isinstance(duration, bool)
        or not isinstance(duration, int | float)
        or not 0 < duration < math.inf
    ):
        raise ParameterError(f"tune: duration is {duration!r} s; it must be positive and finite.")
    if not isinstance(index, TrackingIndex):
        raise ParameterError(
            f"tune: index is {index!r}; give a TrackingIndex, such as RootMeanSquareError()."
        )
    if not callable(objective):
        raise ParameterError(
            f"tune: objective is {objective!r}; give RobustObjective() or a function of"
            " CaseMetrics."
        )
    for name, value, least in (("simulations", simulations, MIN_SETS * count), ("seed", seed, 0)):
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            why = (
                f", {MIN_SETS} sets of gains for each of {count} cases"
                if name == "simulations"
                else ""
            )
            raise ParameterError(
                f"tune: {name} is {value!r}; it must be a whole number of at least {least}{why}."
            )
    return float(duration)


class _Search:
    """One search: it evaluates populations and records them."""

    def __init__(
        self,
        evaluator: Evaluator,
        ranges: tuple[GainRange, ...],
        objective: Objective,
        simulations: int,
        progress: Progress,
    ) -> None:
        self.evaluator = evaluator
        self.ranges = ranges
        self.objective = objective
        self.progress = progress
        self.simulations, self.sets = simulations, simulations // len(evaluator.cases)
        self.present_count, self.converged, self.reasons = 0, False, Counter[str]()
        self.gains, self.metrics, self.values = list[Array](), list[CaseMetrics](), list[Array]()
        self._calls = DistributedCalls(None, Evaluator.metrics, evaluator)
        self._sets_of_a_task = self.sets

    @property
    def population(self) -> int:
        """The number of points of the first generation: the power of two from 8 D on, at most half
        the number of simulations.
        """
        size = max(MIN_SETS, 1 << math.ceil(math.log2(8 * len(self.ranges))))
        while size > MIN_SETS and 2 * size > self.sets:
            size //= 2
        return size

    def given(self, start: Sequence[Mapping[str, float]]) -> list[Array]:
        """The coordinates (D,) of the present gains, if they are within the ranges, and of those
        given.
        """
        present = {leaf.path: leaf.value for leaf in leaves(self.evaluator.cases[0].controller)}
        present_point = to_coordinates(self.ranges, present)
        self.present_count = 0 if present_point is None else 1
        points = [] if present_point is None else [present_point]
        for number, gains in enumerate(start):
            check_known(f"tune: start {number} names", gains, self.evaluator.paths, "bounds names")
            point = to_coordinates(self.ranges, {**present, **gains})
            if point is None:
                raise ParameterError(
                    f"tune: start {number} is outside the bounds: {dict(gains)}. Extend the bounds."
                )
            points.append(point)
        if len(points) > self.population:
            raise ParameterError(
                f"tune: {len(start)} starts; at most {self.population - 1} fit the first"
                " generation."
            )
        return points

    def run(self, start_points: list[Array], seed: int, executor: Executor | None) -> bool:
        """Search until two descents agree or all simulations are made; whether the user
        interrupted.
        """
        from scipy.stats import qmc

        if executor is not None:
            self._calls = DistributedCalls(executor, Evaluator.metrics, self.evaluator)
            self._sets_of_a_task = SETS_OF_A_TASK
        first = qmc.Sobol(
            d=len(self.ranges), scramble=True, seed=np.random.default_rng(seed)
        ).random(self.population)
        first[: len(start_points)] = start_points if start_points else first[:0]
        random = np.random.default_rng([seed, 1])
        ends = list[float]()
        used = list[Array]()
        try:
            for start in first[np.argsort(self._energies(first), kind="stable")]:
                if any(
                    float(np.linalg.norm(start - earlier)) < APART * math.sqrt(start.size)
                    for earlier in used
                ):
                    continue
                used.append(start)
                strategy = EvolutionStrategy(start, random)
                if self.converged or not self._has_simulations(strategy.size):
                    break
                ends.append(self._descend(strategy))
                best, *worse = sorted(ends)
                self.converged = bool(worse) and worse[0] - best <= AGREEMENT * abs(best)
        except KeyboardInterrupt:
            return True
        return False

    def _has_simulations(self, sets: int) -> bool:
        return sum(map(len, self.values)) + sets <= self.sets

    def _descend(self, strategy: EvolutionStrategy) -> float:
        """The smallest energy of one descent; infinite where the number of simulations ended it."""
        best: list[float] = []
        while self._has_simulations(strategy.size):
            points = strategy.ask()
            energies = self._energies(points)
            strategy.tell(points, energies)
            best.append(min([*best[-1:], float(energies.min())]))
            recent = best[-PATIENCE - 1 :]
            if len(recent) > PATIENCE and recent[0] - recent[-1] <= TOLERANCE * abs(recent[-1]):
                return best[-1]
        return math.inf

    def _energies(self, coordinates: Array) -> Array:
        """The energies (S,) of points (S, D): the objective, or a large number by the share of
        failed runs.
        """
        gains = to_gains(self.ranges, np.clip(coordinates, 0.0, 1.0))
        size = self._sets_of_a_task
        parts = self._calls.results([gains[i : i + size] for i in range(0, len(gains), size)])
        metrics = joined_metrics([part for part, _ in parts])
        for _, reasons in parts:
            self.reasons.update(reasons)
        values = np.asarray(self.objective(metrics), dtype=float)
        if values.shape != (len(gains),):
            raise ParameterError(
                f"tune: the objective returned {values.shape}; it must return ({len(gains)},)"
                " values."
            )
        values = np.where(np.isnan(values), np.inf, values)
        self.gains.append(gains)
        self.metrics.append(metrics)
        self.values.append(values)
        self.progress(sum(map(len, self.values)) * len(self.evaluator.cases), self.simulations)
        return np.where(
            np.isfinite(values), values, 1e30 * (1.0 + (1.0 - metrics.completed.mean(axis=1)))
        )
