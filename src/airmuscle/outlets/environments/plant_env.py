"""PlantEnv: one plant with a task as a Gymnasium environment. Gymnasium imports this module."""

import collections
import math
from typing import Any, ClassVar

import gymnasium
import numpy as np
import numpy.typing as npt

from ...core import ParameterError, SimulationError
from ...engine.run import RungeKutta4, Stepper
from ...physics.equilibrium import complete_inputs
from ...recording import Recording
from .randomisation import EpisodeDraw, Randomisation, whole_steps
from .standard import ON_OFF, task_and_options
from .task import EnvironmentTask

STEP = RungeKutta4(1e-3)
"""Default integrator."""
Floats = npt.NDArray[np.float32]


def observation_space(task: EnvironmentTask) -> Any:
    """The box of the observations."""
    low, high = (
        np.array([getattr(o, end) for o in task.observations], np.float32)
        for end in ("low", "high")
    )
    return gymnasium.spaces.Box(low, high, dtype=np.float32)


def action_space(task: EnvironmentTask) -> Any:
    """The box of the actions, from -1 to 1."""
    return gymnasium.spaces.Box(-1.0, 1.0, (len(task.actions),), np.float32)


class PlantEnv(gymnasium.Env):  # type: ignore[misc, unused-ignore]
    """One plant with a task.

    task           an EnvironmentTask; observations and actions are listed by its `observations` and
                   `actions`
    randomisation  distributions of parameters, drawn anew at every reset; () for the nominal plant
    integrator     RungeKutta4(1e-3) by default; the period of the task is a whole number of its
                   steps

    Actions are limited to -1 to 1 and held for one period. An episode is terminated where the task
    ends it, or where the state becomes impossible (not finite, an air mass below zero): the
    observation is then zero, and so is the reward. The wrapper TimeLimit of `gymnasium.make`
    truncates it after `max_episode_steps`. Raises ParameterError for an action that is not finite
    or of another shape.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["human", "rgb_array"], "render_fps": 100}

    def __init__(
        self,
        task: EnvironmentTask,
        randomisation: tuple[Randomisation, ...] = (),
        *,
        integrator: RungeKutta4 = STEP,
        render_mode: str | None = None,
    ) -> None:
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ParameterError(
                f"render_mode is {render_mode!r}; allowed are 'human', 'rgb_array' and None."
            )
        self.task = task
        self.render_mode = render_mode
        self._draw = EpisodeDraw(task, randomisation)
        whole_steps(task, integrator)
        self.observation_space, self.action_space = observation_space(task), action_space(task)
        self._count, self._actions = len(task.observations), len(task.actions)
        _, states = self._draw.begin(np.full((1, self._draw.dimension), 0.5))
        names = [s.name for s in task.states]
        self._stepper = Stepper(
            task, dict(zip(names, states[0].tolist(), strict=True)), integrator=integrator
        )
        self._inputs = [0.0] * (self._actions + 1)
        self._elapsed = 0
        self._window: Any = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Floats, dict[str, Any]]:
        """Begin an episode: its first observation, and an empty dictionary."""
        super().reset(seed=seed)
        parameters, states = self._draw.begin(self.np_random.random((1, self._draw.dimension)))
        outputs = self._stepper.begin(parameters[0], states[0])
        self._elapsed = 0
        if self.render_mode == "human":
            self.render()
        return outputs[: self._count].astype(np.float32), {}

    def step(self, action: Any) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Hold an action for one period: observation, reward, terminated, truncated (never), the
        terms of the reward.

        The terms are `closeness`, exp(-sum e^2), and `effort`, which is subtracted from it.
        """
        values = action.tolist() if isinstance(action, np.ndarray) else action
        inputs = self._inputs
        squares = 0.0
        self._elapsed = self._elapsed + 1
        try:
            if len(values) != self._actions:
                raise TypeError
            for i, value in enumerate(values):
                if not math.isfinite(value):
                    raise TypeError
                inputs[i] = value = min(max(value, -1.0), 1.0)
                squares += value * value
        except TypeError:
            raise ParameterError(
                f"the action is {action}; give {self._actions} finite numbers from -1 to 1."
            ) from None
        inputs[-1] = self._elapsed * self.task.period
        try:
            outputs = self._stepper.step(inputs, self.task.period)
        except SimulationError:
            return (
                np.zeros(self._count, np.float32),
                0.0,
                True,
                False,
                {"closeness": 0.0, "effort": 0.0},
            )
        reward = float(outputs[-2])
        terminated = bool(outputs[-1] > 0.5)
        effort = self.task.effort_weight * squares / self._actions
        terms = {"closeness": reward + effort, "effort": effort}
        if self.render_mode == "human":
            self.render()
        return outputs[: self._count].astype(np.float32), reward, terminated, False, terms

    def render(self) -> Any:
        """The present state of the plant as the picture of `Recording.animate`, (height, width, 3)
        of uint8.

        None without `render_mode="rgb_array"`; with "human" it is shown in a window of Matplotlib,
        also by `reset` and `step`. It takes some tenths of a second. Raises ParameterError for an
        arm in space, which is not drawn.
        """
        if self.render_mode != "human":
            return None if self.render_mode is None else self._picture()
        import matplotlib.pyplot as plt

        if self._window is None:
            self._window = (
                plt.figure("airmuscle")
                .add_axes((0.0, 0.0, 1.0, 1.0), frameon=False)
                .imshow(self._picture())
            )
        self._window.set_data(self._picture())
        plt.pause(1e-3)
        return None

    def close(self) -> None:
        """Close the window."""
        if self._window is not None:
            import matplotlib.pyplot as plt

            plt.close(self._window.figure)
            self._window = None

    def _picture(self) -> Any:
        """The picture of the present state."""
        plant = self.task.plant
        names = [state.name for state in plant.states]
        state = dict(zip(names, self._stepper.state.tolist(), strict=True))
        outputs = plant.outputs(state, complete_inputs(plant, None))
        # a recording has two rows at least
        time = self._elapsed * self.task.period + np.array([0.0, 1.0])
        columns = {"time": time}
        for name, value in {**outputs, **state}.items():
            columns[name] = np.full(2, float(value))
        picture = plant.animate(Recording(columns, "environment"))
        picture.draw(0)
        canvas = picture.figure.canvas
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def with_on_off_valves(env: Any) -> Any:
    """An environment, single or vector, whose actions open valves completely: 0 discharges, 1
    closes both, 2 fills.

    Raises ParameterError for an action of the task that is not a pair of a fill and a discharge
    valve.
    """
    actions = env.unwrapped.task.actions
    if alone := [action.name for action in actions if len(action.inputs) != 2]:
        raise ParameterError(
            f"the action '{alone[0]}' is no pair of a fill and a discharge valve, which alone can"
            " be on/off valves."
        )
    space = gymnasium.spaces.MultiDiscrete([3] * len(actions))
    if not isinstance(env, gymnasium.vector.VectorEnv):
        return gymnasium.wrappers.TransformAction(env, openings_of, space)
    all_spaces = gymnasium.vector.utils.batch_space(space, env.num_envs)
    return gymnasium.wrappers.vector.TransformAction(env, openings_of, all_spaces, space)


def openings_of(action: Any) -> Floats:
    """The actions from -1 to 1 for those of on/off valves."""
    return np.asarray(action, np.float32) - 1.0


class MeasuredObservations(gymnasium.ObservationWrapper):  # type: ignore[misc, unused-ignore]
    """A single environment whose observations pass through sensors: noise, steps, and a dead time.

    noise, resolution  standard deviation and step of the observations, one for all or one for each
                       (k,), in their units
    delay              periods by which observations are late; until then the first one is repeated

    The noise is drawn from the generator of the environment, which `reset(seed=...)` seeds.
    Observations remain within their limits. Raises ParameterError for a number that is negative or
    not finite.
    """

    def __init__(
        self, env: Any, *, noise: Any = 0.0, resolution: Any = 0.0, delay: int = 0
    ) -> None:
        super().__init__(env)
        size = env.observation_space.shape[0]
        for name, value in {"noise": noise, "resolution": resolution, "delay": delay}.items():
            values = np.asarray(value, dtype=float)
            if (
                values.shape not in ((), (size,))
                or not (np.isfinite(values) & (values >= 0)).all()
                or delay % 1
            ):
                raise ParameterError(
                    f"MeasuredObservations: {name} is {value!r}; give numbers from 0 on, one or"
                    f" {size} (delay: one whole number of periods)."
                )
        self.noise, self.resolution, self.delay = (
            np.asarray(noise, float),
            np.asarray(resolution, float),
            int(delay),
        )
        self._late: collections.deque[Any] = collections.deque(maxlen=self.delay + 1)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
        """Begin an episode: its first observation, and an empty dictionary."""
        self._late.clear()
        return super().reset(seed=seed, options=options)

    def observation(self, observation: Any) -> Floats:
        """The reading of the sensors for an observation (k,)."""
        random = self.unwrapped.np_random
        noisy = observation + self.noise * random.normal(size=observation.shape)
        has_steps = self.resolution > 0
        step = np.where(has_steps, self.resolution, 1.0)
        read = np.where(has_steps, step * np.round(noisy / step), noisy)
        space = self.observation_space
        limited = np.clip(read, space.low, space.high)
        self._late.append(limited.astype(np.float32))
        return np.array(self._late[0])


def make_environment(kind: str, task: EnvironmentTask | None = None, **options: Any) -> Any:
    """The registered environment airmuscle/KIND-v0, or the same with another task, which is not
    randomised unless `randomisation` is given."""
    task, options = task_and_options(kind, task, options)
    env = PlantEnv(task, **options)
    return with_on_off_valves(env) if kind == ON_OFF else env
