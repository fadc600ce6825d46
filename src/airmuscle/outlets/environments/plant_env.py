"""PlantEnv: one plant with a task as a Gymnasium environment. Gymnasium imports this module."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import gymnasium
import numpy as np
import numpy.typing as npt

from ...core.errors import ParameterError, SimulationError
from ...engine.run import RungeKutta4, Stepper
from .randomisation import EpisodeDraw, Randomisation, whole_steps
from .standard import arm_task, joint_task, lift_task
from .task import EnvironmentTask

STEP = RungeKutta4(1e-3)
"""Default integrator."""


def observation_space(task: EnvironmentTask) -> Any:
    """The box of the observations."""
    low, high = (np.array([getattr(o, end) for o in task.observations], np.float32) for end in ("low", "high"))
    return gymnasium.spaces.Box(low, high, dtype=np.float32)


def action_space(task: EnvironmentTask) -> Any:
    """The box of the actions, from -1 to 1."""
    return gymnasium.spaces.Box(-1.0, 1.0, (len(task.actions),), np.float32)


class PlantEnv(gymnasium.Env):  # type: ignore[misc, unused-ignore]
    """One plant with a task.

    task           an EnvironmentTask; observations and actions are listed by its `observations` and `actions`
    randomisation  distributions of parameters, drawn anew at every reset; () for the nominal plant
    integrator     RungeKutta4(1e-3) by default; the period of the task is a whole number of its steps

    Actions are limited to -1 to 1 and held for one period. An episode is terminated where the task ends it, or where
    the state becomes impossible (not finite, an air mass below zero): the observation is then zero, and so is the
    reward. The wrapper TimeLimit of `gymnasium.make` truncates it after `max_episode_steps`. Raises ParameterError for
    an action that is not finite or of another shape.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": []}

    def __init__(
        self, task: EnvironmentTask, randomisation: tuple[Randomisation, ...] = (), *,
        integrator: RungeKutta4 = STEP, render_mode: None = None,
    ) -> None:  # fmt: skip
        self.task, self.render_mode = task, render_mode
        self._draw = EpisodeDraw(task, randomisation)
        whole_steps(task, integrator)
        self.observation_space, self.action_space = observation_space(task), action_space(task)
        self._count, self._actions = len(task.observations), len(task.actions)
        _, states = self._draw.begin(np.full((1, self._draw.dimension), 0.5))
        names = [s.name for s in task.states]
        self._stepper = Stepper(task, dict(zip(names, states[0].tolist(), strict=True)), integrator=integrator)
        self._inputs, self._elapsed = [0.0] * (self._actions + 1), 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[npt.NDArray[np.float32], dict[str, Any]]:
        """Begin an episode: its first observation, and an empty dictionary."""
        super().reset(seed=seed)
        parameters, states = self._draw.begin(self.np_random.random((1, self._draw.dimension)))
        outputs = self._stepper.begin(parameters[0], states[0])
        self._elapsed = 0
        return outputs[: self._count].astype(np.float32), {}

    def step(self, action: Any) -> tuple[npt.NDArray[np.float32], float, bool, bool, dict[str, Any]]:
        """Hold an action for one period: observation, reward, terminated, truncated (never), an empty dictionary."""
        values = action.tolist() if isinstance(action, np.ndarray) else action
        inputs, self._elapsed = self._inputs, self._elapsed + 1
        try:
            if len(values) != self._actions:
                raise TypeError
            for i, value in enumerate(values):
                if not math.isfinite(value):
                    raise TypeError
                inputs[i] = min(max(value, -1.0), 1.0)
        except TypeError:
            raise ParameterError(f"the action is {action}; give {self._actions} finite numbers from -1 to 1.") from None
        inputs[-1] = self._elapsed * self.task.period
        try:
            outputs = self._stepper.step(inputs, self.task.period)
        except SimulationError:
            return np.zeros(self._count, np.float32), 0.0, True, False, {}
        reward, terminated = float(outputs[-2]), bool(outputs[-1] > 0.5)
        return outputs[: self._count].astype(np.float32), reward, terminated, False, {}


def make_joint(task: EnvironmentTask | None = None, **options: Any) -> PlantEnv:
    """airmuscle/Joint-v0, or the same with another task, which is not randomised unless `randomisation` is given."""
    return _make(joint_task(), task, options)


def make_lift(task: EnvironmentTask | None = None, **options: Any) -> PlantEnv:
    """airmuscle/Lift-v0, or the same with another task."""
    return _make(lift_task(), task, options)


def make_arm(task: EnvironmentTask | None = None, **options: Any) -> PlantEnv:
    """airmuscle/Arm-v0, or the same with another task."""
    return _make(arm_task(), task, options)


def _make(default: tuple[EnvironmentTask, tuple[Randomisation, ...]], task: Any, options: dict[str, Any]) -> PlantEnv:
    if task is None:
        return PlantEnv(default[0], **{"randomisation": default[1], **options})
    return PlantEnv(task, **options)
