"""Episodes of a policy in a task, distributed among processes and machines."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ...core import Array, ShortRepr, check_whole
from ...engine.distribution import DistributedCalls
from ...engine.processes import Workers, process_pool
from . import EPISODE_PERIODS
from .plant_vector_env import PlantVectorEnv
from .randomisation import Randomisation
from .task import EnvironmentTask

EPISODES_OF_A_TASK = 256
"""Episodes that are computed together (chosen)."""
Policy = Callable[[Array], Any]
"""Actions (N, m) from -1 to 1 of observations (N, k)."""


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Rollouts(ShortRepr):
    """The sum of the rewards of each episode (E,), its number of periods (E,), and whether the task ended it (E,)."""

    returns: Array
    periods: npt.NDArray[np.int64]
    terminated: npt.NDArray[np.bool_]


def roll_out(
    task: EnvironmentTask, policy: Policy, episodes: int, randomisation: tuple[Randomisation, ...] = (), *,
    seed: int = 0, max_episode_steps: int = EPISODE_PERIODS, workers: Workers = 1, **options: Any,
) -> Rollouts:  # fmt: skip
    """Run episodes of a policy: episode i is the first of `PlantVectorEnv` with the seed `seed + i`.

    policy   function of a module, or an object that can be pickled, called with the observations of many episodes; that
             of an episode must not depend on the others
    workers  number of processes, for several of which a script needs `if __name__ == "__main__":`, or an executor. The
             result does not depend on it
    options  integrator and precision of `PlantVectorEnv`

    Raises ParameterError for impossible options or actions.
    """
    check_whole("roll_out", "episodes", episodes, 1)
    check_whole("roll_out", "seed", seed, 0)
    common = task, policy, randomisation, max_episode_steps, options
    starts = range(seed, seed + episodes, EPISODES_OF_A_TASK)
    blocks = [range(start, min(start + EPISODES_OF_A_TASK, seed + episodes)) for start in starts]
    with process_pool(workers) as executor:
        found = DistributedCalls(executor, _run_episodes, common).results(blocks)
    return Rollouts(*(np.concatenate(columns) for columns in zip(*found, strict=True)))


def _run_episodes(common: tuple[Any, ...], seeds: range) -> tuple[npt.NDArray[Any], ...]:
    """Returns, periods and terminations of the episodes with these seeds; plants whose episode is over go on unused."""
    task, policy, randomisation, limit, options = common
    count = len(seeds)
    environment = PlantVectorEnv(count, task, randomisation, max_episode_steps=limit, **options)
    returns, periods, ended = np.zeros(count), np.zeros(count, np.int64), np.zeros(count, bool)
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
