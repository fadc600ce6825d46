"""PlantVectorEnv: plants with a task in lanes, as a vector environment that Gymnasium imports;
episodes of a policy.
"""

import dataclasses
from collections.abc import Callable
from typing import Any, ClassVar

import gymnasium
import numpy as np
import numpy.typing as npt
from gymnasium.utils import seeding

from ...core import Array, ParameterError, ShortRepr, check_whole
from ...engine.distribution import DistributedCalls
from ...engine.processes import Workers, process_pool
from ...engine.run import RungeKutta4
from ...engine.run.batch import BatchStepper, Double, Precision
from . import EPISODE_PERIODS
from .plant_env import STEP, action_space, observation_space, with_on_off_valves
from .randomisation import EpisodeDraw, Randomisation, whole_steps
from .standard import ON_OFF, task_and_options
from .task import EnvironmentTask

Booleans = npt.NDArray[np.bool_]
Autoreset = gymnasium.vector.AutoresetMode


class PlantVectorEnv(gymnasium.vector.VectorEnv):  # type: ignore[misc, unused-ignore]
    """Plants of one task, advanced together in lanes on all cores.

    num_envs           number of plants N
    task               an EnvironmentTask
    randomisation      distributions of parameters, drawn anew for every episode of each plant
    max_episode_steps  periods after which an episode is truncated
    integrator         RungeKutta4(1e-3) by default; the period of the task is a whole number of its
                       steps
    precision          Double() or Single()
    cores              threads; all cores of this process unless given
    autoreset_mode     NEXT_STEP or SAME_STEP of gymnasium.vector.AutoresetMode

    Plant i is what `PlantEnv` with the seed `seed + i` is, to the rounding of the lanes. An episode
    that is over begins anew in the next step (NEXT_STEP): the action of that step is ignored, its
    reward is 0. With SAME_STEP it begins anew at once, and `info["final_obs"]` holds the last
    observation of each plant whose episode is over, None for others, `info["final_info"]` the terms
    of its reward. Beyond the arrays that it returns, a step in which no episode begins allocates
    some arrays (N,) of time and flags.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": [], "autoreset_mode": Autoreset.NEXT_STEP}

    def __init__(
        self,
        num_envs: int,
        task: EnvironmentTask,
        randomisation: tuple[Randomisation, ...] = (),
        *,
        max_episode_steps: int = EPISODE_PERIODS,
        integrator: RungeKutta4 = STEP,
        precision: Precision = Double(),
        cores: int | None = None,
        autoreset_mode: Any = Autoreset.NEXT_STEP,
    ) -> None:
        if not isinstance(max_episode_steps, int) or max_episode_steps < 1:
            raise ParameterError(
                f"max_episode_steps is {max_episode_steps!r}; it must be a whole number from 1 on."
            )
        if autoreset_mode not in (Autoreset.NEXT_STEP, Autoreset.SAME_STEP):
            raise ParameterError(
                f"autoreset_mode is {autoreset_mode!r}; allowed are AutoresetMode.NEXT_STEP and"
                " SAME_STEP of gymnasium.vector."
            )
        self.metadata = {**type(self).metadata, "autoreset_mode": autoreset_mode}  # type: ignore[misc]
        self._at_once = autoreset_mode is Autoreset.SAME_STEP
        self._draw = EpisodeDraw(task, randomisation)
        self.task = task
        self._steps = whole_steps(task, integrator)
        self.max_episode_steps = max_episode_steps
        self._plants = BatchStepper(task, num_envs, integrator, precision=precision, cores=cores)
        self.num_envs = num_envs
        self.render_mode = None
        self.single_observation_space, self.single_action_space = (
            observation_space(task),
            action_space(task),
        )
        batch_space = gymnasium.vector.utils.batch_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        plants = self._plants
        self._given = np.zeros((plants.blocks, plants.width, len(task.actions) + 1), plants.dtype)
        self._elapsed = np.zeros(num_envs, np.int64)
        self._over: Booleans = np.zeros(num_envs, bool)
        self._generators: list[np.random.Generator] = []
        sizes = plants.parameters.shape[1], plants.states.shape[1]
        # the next episode of every plant: whether it is drawn (N,), its parameters (N, P) and
        # initial state (N, n)
        self._drawn: Booleans = np.zeros(num_envs, bool)
        self._next_parameters, self._next_states = (np.empty((num_envs, size)) for size in sizes)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Begin an episode of every plant: the first observations (N, k), and an empty dictionary.

        With `seed`, plant i has the seed `seed + i`; a list has one for each. Without it, the
        generators go on. With `options={"reset_mask": mask}`, booleans (N,), only the plants of the
        mask begin anew, and no seed is given.
        """
        mask = (options or {}).get("reset_mask")
        if mask is not None:
            chosen = np.asarray(mask)
            if (
                chosen.shape != (self.num_envs,)
                or chosen.dtype != bool
                or seed is not None
                or not self._generators
            ):
                raise ParameterError(
                    f"reset: reset_mask has the shape {chosen.shape} and the type {chosen.dtype};"
                    f" give {self.num_envs} booleans, no seed, and call reset() without a mask"
                    " first."
                )
            self._begin(np.flatnonzero(chosen))
            self._over[chosen] = False
            return self._observed()[0], {}
        if seed is not None or not self._generators:
            first = int(np.random.SeedSequence().generate_state(1)[0]) if seed is None else seed
            seeds = (
                [first + i for i in range(self.num_envs)] if isinstance(first, int) else list(first)
            )
            if len(seeds) != self.num_envs:
                raise ParameterError(
                    f"there are {len(seeds)} seeds for {self.num_envs} plants; give one for each."
                )
            self._generators = [seeding.np_random(plant_seed)[0] for plant_seed in seeds]
            self._drawn[:] = False
        filling = np.arange(
            self.num_envs, self._plants.blocks * self._plants.width
        )  # the last block
        self._place(filling, *self._draw.begin(np.full((1, self._draw.dimension), 0.5)))
        self._begin(np.arange(self.num_envs))
        self._over[:] = False
        return self._observed()[0], {}

    def step(
        self, actions: Any
    ) -> tuple[npt.NDArray[np.float32], Array, Booleans, Booleans, dict[str, Any]]:
        """Hold an action (N, m) of every plant for one period: observations (N, k), rewards,
        terminated and truncated (N,), and the terms of the rewards, closeness and effort (N,), as
        those of PlantEnv. Raises ParameterError for another shape, or an action that is not
        finite."""
        count = len(self.task.actions)
        if not self._generators:
            raise ParameterError(
                "the environment has no state yet; call reset() before the first step."
            )
        actions = np.asarray(actions)
        if actions.shape != (self.num_envs, count):
            raise ParameterError(
                f"the actions have the shape {actions.shape}; give ({self.num_envs}, {count})."
            )
        if not np.isfinite(actions).all():
            row = int(np.flatnonzero(~np.isfinite(actions).all(axis=1))[0])
            raise ParameterError(
                f"the actions, row {row}: {actions[row]}; give {count} finite numbers from -1 to 1."
            )
        np.clip(actions, -1.0, 1.0, out=self._inputs[:, :count], casting="same_kind")
        self._elapsed += 1
        np.multiply(
            self._elapsed, self.task.period, out=self._inputs[:, count], casting="same_kind"
        )
        held_actions = self._inputs[:, :count].astype(float)
        effort = self.task.effort_weight * (
            np.einsum("ij,ij->i", held_actions, held_actions) / count
        )
        self._plants.inputs[...] = self._given.transpose(0, 2, 1)
        self._plants.advance(self._steps)
        anew = np.flatnonzero(self._over)
        if anew.size:
            self._begin(anew)
        observations, rewards, terminated = self._observed()
        truncated: Booleans = self._elapsed >= self.max_episode_steps
        rewards[anew] = 0.0
        terminated[anew] = False
        ends = np.flatnonzero(terminated)
        effort[ends[~observations[ends].any(axis=1)]] = 0.0  # an impossible state
        terms = {"closeness": rewards + effort, "effort": effort}
        over: Booleans = terminated | truncated
        if not self._at_once:
            present = ~self._over
            self._over = over
            return observations, rewards, terminated, truncated, _masked(terms, present)
        info = _masked(terms, ~over)
        if over.any():
            last = np.full(over.size, None, dtype=object)
            for i in np.flatnonzero(over):
                last[i] = observations[i].copy()
            info |= {"final_obs": last, "_final_obs": over.copy()}
            info |= {"final_info": _masked(terms, over), "_final_info": over.copy()}
            self._begin(np.flatnonzero(over))
            observations = np.where(over[:, None], self._observed()[0], observations)
        return observations, rewards, terminated, truncated, info

    @property
    def _inputs(self) -> npt.NDArray[Any]:
        """The inputs of the plants (N, m + 1), a view."""
        return self._given.reshape(-1, self._given.shape[-1])[: self.num_envs]

    def close_extras(self, **options: Any) -> None:
        """End the threads."""
        self._plants.close()

    def _begin(self, plants: npt.NDArray[np.intp]) -> None:
        """Begin an episode of these plants, and compute the outputs of all."""
        if not self._drawn[
            plants
        ].all():  # all plants that have no next episode take little more time than one
            empty = np.flatnonzero(~self._drawn)
            uniform = np.array([self._generators[i].random(self._draw.dimension) for i in empty])
            self._next_parameters[empty], self._next_states[empty] = self._draw.begin(uniform)
            self._drawn[empty] = True
        self._place(plants, self._next_parameters[plants], self._next_states[plants])
        self._drawn[plants] = False
        self._elapsed[plants] = 0
        self._inputs[plants] = 0.0
        self._plants.inputs[...] = self._given.transpose(0, 2, 1)
        self._plants.advance(0)

    def _place(self, plants: npt.NDArray[np.intp], parameters: Array, states: Array) -> None:
        """Write parameters (R, P) and states (R, n) of plants into their lanes."""
        lanes = self._plants
        block, lane = np.divmod(plants, lanes.width)
        lanes.parameters[block, :, lane] = parameters
        lanes.states[block, :, lane] = states
        lanes.prepare(np.unique(block))

    def _observed(self) -> tuple[npt.NDArray[np.float32], Array, Booleans]:
        """Observations, rewards, and which episodes are terminated."""
        plants = self._plants
        count = len(self.task.observations)
        observations = plants.rows(plants.outputs, 0, count, np.float32)
        rewards = plants.column(plants.outputs, count, np.float64)
        terminated: Booleans = plants.column(plants.outputs, count + 1, np.float64) > 0.5
        impossible = ~np.isfinite(rewards)
        if impossible.any():
            observations[impossible] = 0.0
            rewards[impossible] = 0.0
            terminated[impossible] = True
        return observations, rewards, terminated


def _masked(terms: dict[str, Array], present: Booleans) -> dict[str, Any]:
    """Terms of the rewards (N,) where they are present, 0 elsewhere, with the masks of Gymnasium's
    own vectors.
    """
    values = (
        terms
        if present.all()
        else {name: np.where(present, value, 0.0) for name, value in terms.items()}
    )
    return {**values, **{f"_{name}": present.copy() for name in terms}}


def make_vector(
    kind: str, num_envs: int = 1, task: EnvironmentTask | None = None, **options: Any
) -> Any:
    """A vector of the registered environment airmuscle/KIND-v0, or the same with another task."""
    task, options = task_and_options(kind, task, options)
    env = PlantVectorEnv(num_envs, task, **options)
    return with_on_off_valves(env) if kind == ON_OFF else env


EPISODES_OF_A_TASK = 256
"""Episodes that are computed together (chosen)."""
Policy = Callable[[Array], Any]
"""Actions (N, m) from -1 to 1 of observations (N, k)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Rollouts(ShortRepr):
    """The sum of the rewards of each episode (E,), its number of periods (E,), and whether the task
    ended it (E,).
    """

    returns: Array
    periods: npt.NDArray[np.int64]
    terminated: npt.NDArray[np.bool_]


def roll_out(
    task: EnvironmentTask,
    policy: Policy,
    episodes: int,
    randomisation: tuple[Randomisation, ...] = (),
    *,
    seed: int = 0,
    max_episode_steps: int = EPISODE_PERIODS,
    workers: Workers = 1,
    **options: Any,
) -> Rollouts:
    """Run episodes of a policy: episode i is the first of `PlantVectorEnv` with the seed `seed +
    i`.

    policy   function of a module, or an object that can be pickled, called with the observations of
             many episodes; that of an episode must not depend on the others
    workers  processes (for several, a script needs `if __name__ == "__main__":`) or an executor;
             the result is the same
    options  integrator and precision of `PlantVectorEnv`

    Raises ParameterError for impossible options or actions.
    """
    check_whole("roll_out", "episodes", episodes, 1)
    check_whole("roll_out", "seed", seed, 0)
    common = task, policy, randomisation, max_episode_steps, options
    seeds = range(seed, seed + episodes)
    blocks = [seeds[i : i + EPISODES_OF_A_TASK] for i in range(0, episodes, EPISODES_OF_A_TASK)]
    with process_pool(workers) as executor:
        rollouts = DistributedCalls(executor, _run_episodes, common).results(blocks)
    return Rollouts(*(np.concatenate(columns) for columns in zip(*rollouts, strict=True)))


def _run_episodes(common: tuple[Any, ...], seeds: range) -> tuple[npt.NDArray[Any], ...]:
    """Returns, periods and terminations of the episodes with these seeds; plants whose episode is
    over go on unused.
    """
    task, policy, randomisation, limit, options = common
    count = len(seeds)
    environment = PlantVectorEnv(count, task, randomisation, max_episode_steps=limit, **options)
    returns = np.zeros(count)
    periods = np.zeros(count, np.int64)
    ended = np.zeros(count, bool)
    try:
        observations, _ = environment.reset(seed=list(seeds))
        running = np.ones(count, bool)
        while running.any():
            observations, rewards, terminated, truncated, _ = environment.step(policy(observations))
            returns += np.where(running, rewards, 0.0)
            periods += running
            ended |= running & terminated
            running &= ~(terminated | truncated)
    finally:
        environment.close()
    return returns, periods, ended
