"""Reinforcement learning of a joint: PPO and SAC of Stable-Baselines3 on the native vector
environment, beside a PI.

python examples/learned_joint.py        one seed of each method, about 5 minutes of one core
python examples/learned_joint.py 3      three seeds of each method

Writes report/examples/learning.png; needs stable-baselines3. Environment
`airmuscle/Joint-v0`; networks, settings of PPO and SAC, ranges of the PI gains and numbers of
episodes are chosen.
"""

import sys
import time

import numpy as np

try:
    import gymnasium
    import torch
    from stable_baselines3 import PPO, SAC
    from stable_baselines3.common.vec_env import VecEnv, VecNormalize
except ImportError as error:
    print(
        f"no learning: {error}. Install the packages: "
        'pip install "airmuscle[sim]" stable-baselines3'
    )
    sys.exit()

import airmuscle.environments  # noqa: F401 - registers them
from airmuscle.core import plotting

PERIODS = 500
PERIOD = 0.01
PLANTS = 128
UPDATE = 64
"""Plants that learn together, and periods between two updates."""
FRESH = 128
FRESH_SEED = 100_000
"""Episodes that judge, and the seed of the first one; no method and not the PI is trained with
them.
"""


def joints(count, **options):
    """A vector of joints in lanes, on one core."""
    mode = {"vectorization_mode": "vector_entry_point", "cores": 1}
    return gymnasium.make_vec("airmuscle/Joint-v0", num_envs=count, **mode, **options)


class LearningJoints(VecEnv):
    """The joints as Stable-Baselines3 expects them: an episode that is over begins anew in the same
    step.

    All joints are one object: attributes and methods are those of the vector, the same for each
    joint.
    """

    def __init__(self, count, seed):
        self.joints = joints(count, autoreset_mode=gymnasium.vector.AutoresetMode.SAME_STEP)
        super().__init__(
            count, self.joints.single_observation_space, self.joints.single_action_space
        )
        self.first_seed = seed
        self.actions = None

    def reset(self):
        observations, _ = self.joints.reset(seed=self.first_seed)
        self.first_seed = None
        return observations

    def step_async(self, actions):
        self.actions = actions

    def step_wait(self):
        observations, rewards, terminated, truncated, told = self.joints.step(self.actions)
        over = terminated | truncated
        infos = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(over):
            cut = bool(truncated[i] and not terminated[i])
            infos[i] = {"terminal_observation": told["final_obs"][i], "TimeLimit.truncated": cut}
        return observations, rewards.astype(np.float32), over, infos

    def close(self):
        self.joints.close()

    def get_attr(self, attr_name, indices=None):
        return [getattr(self.joints, attr_name)] * self.num_envs

    def set_attr(self, attr_name, value, indices=None):
        setattr(self.joints, attr_name, value)

    def env_method(self, method_name, *args, indices=None, **options):
        return [getattr(self.joints, method_name)(*args, **options)] * self.num_envs

    def env_is_wrapped(self, wrapper_class, indices=None):
        return [False] * self.num_envs


def returns(policy, seeds):
    """The return (N,) of an episode for each seed; the policy maps observations (N, 6) to actions
    (N, 2).
    """
    plants = joints(len(seeds))
    observations, _ = plants.reset(seed=[int(seed) for seed in seeds])
    total = np.zeros(len(seeds))
    running = np.ones(len(seeds), bool)
    for _ in range(PERIODS):
        observations, rewards, terminated, *_ = plants.step(policy(observations))
        total += np.where(running, rewards, 0.0)
        running &= ~terminated
    plants.close()
    return total


def pi_control(gain, integral_gain):
    """PI control of the angle with conditional integration; its command fills one muscle and
    discharges the other.
    """
    integral = np.zeros(np.broadcast(gain, integral_gain).shape)

    def policy(observations):
        error = observations[:, 4] - observations[:, 0]
        command = gain * error + integral_gain * integral
        integral[:] += np.where(np.abs(command) < 1.0, PERIOD * error, 0.0)
        return np.clip(np.stack([command, -command], axis=1), -1.0, 1.0).astype(np.float32)

    return policy


WEIGHTS = np.array([13.4, -0.42, 1.02, -0.83, 3.97, -0.02])
"""Weights of a cross-entropy search, benchmarks/environments.py."""


def with_pressure_difference(observations):
    """The policy u = tanh(w . (e, omega, r', p_l - p_r, r, 1)) of six numbers, actions u and -u."""
    angle, speed, left, right, wanted, later = observations.T
    features = (
        wanted - angle,
        speed,
        (later - wanted) / PERIOD,
        left - right,
        wanted,
        np.ones(len(angle)),
    )
    command = np.tanh(WEIGHTS @ np.stack(features))
    return np.stack([command, -command], axis=1).astype(np.float32)


def tuned_pi(sets=256, episodes=16):
    """Gains [1/rad, 1/(rad s)] with the maximum mean return of training episodes, the same ones for
    all sets.
    """
    from scipy.stats import qmc

    points = qmc.scale(qmc.Sobol(d=2, seed=1).random(sets), *np.log([(0.5, 0.5), (30.0, 300.0)]))
    gains = np.exp(points)
    policy = pi_control(*np.repeat(gains, episodes, axis=0).T)
    found = returns(policy, np.tile(np.arange(episodes), sets)).reshape(sets, episodes).mean(axis=1)
    return gains[found.argmax()]


def learner(seed=1):
    """PPO with a network of two layers of 64, observations and rewards normalised."""
    torch.set_num_threads(1)
    environment = VecNormalize(LearningJoints(PLANTS, seed), clip_obs=10.0, gamma=0.98)
    settings = {
        "n_steps": UPDATE,
        "batch_size": 2048,
        "n_epochs": 5,
        "gamma": 0.98,
        "learning_rate": 1e-3,
    }
    network = {"net_arch": [64, 64], "log_std_init": -0.5}
    return PPO("MlpPolicy", environment, policy_kwargs=network, seed=seed, device="cpu", **settings)


def off_policy_learner(seed=1):
    """SAC with the same network, observations normalised: 16 gradient steps of 512 samples for 128
    periods.
    """
    torch.set_num_threads(1)
    environment = VecNormalize(
        LearningJoints(PLANTS, seed), clip_obs=10.0, gamma=0.98, norm_reward=False
    )
    settings = {"gradient_steps": 16, "batch_size": 512, "gamma": 0.98, "learning_rate": 1e-3}
    memory = {"buffer_size": 400_000, "learning_starts": 50 * PLANTS, "train_freq": 1}
    network = {"net_arch": [64, 64]}
    return SAC(
        "MlpPolicy",
        environment,
        policy_kwargs=network,
        seed=seed,
        device="cpu",
        **settings,
        **memory,
    )


METHODS = {"PPO": (learner, 48), "SAC": (off_policy_learner, 24)}
"""Methods: their learner, and its number of updates of 8192 periods."""


def learned_policy(model):
    """The mean action of a learner."""
    return lambda observations: model.predict(
        model.env.normalize_obs(observations), deterministic=True
    )[0]


def learning_curve(model, updates, every):
    """(periods, returns (N,) of fresh episodes) before learning, and after every so many
    updates.
    """
    seeds = FRESH_SEED + np.arange(FRESH)
    curve = [(0, returns(learned_policy(model), seeds))]
    while model.num_timesteps < updates * PLANTS * UPDATE:
        model.learn(every * PLANTS * UPDATE, reset_num_timesteps=model.num_timesteps == 0)
        curve.append((model.num_timesteps, returns(learned_policy(model), seeds)))
    return curve


def main(seeds=1):
    gains = tuned_pi()
    pi = returns(
        pi_control(*np.repeat(gains[None, :], FRESH, axis=0).T), FRESH_SEED + np.arange(FRESH)
    )
    print(
        f"PI, {gains[0]:.3g} 1/rad and {gains[1]:.3g} 1/(rad s): mean return {pi.mean():.1f}, least"
        f" {pi.min():.1f}"
    )
    found = returns(with_pressure_difference, FRESH_SEED + np.arange(FRESH))
    print(
        f"six numbers with the pressure difference: mean return {found.mean():.1f}, least"
        f" {found.min():.1f}"
    )
    curves = {name: [] for name in METHODS}
    for name, (method, updates) in METHODS.items():
        for seed in range(1, seeds + 1):
            begun = time.process_time()
            curve = learning_curve(method(seed), updates, every=4)
            curves[name].append(curve)
            spent = time.process_time() - begun
            print(f"{name}, seed {seed}, {spent:.0f} s of CPU time: periods, mean and least return")
            for periods, found in curve:
                print(f"  {periods:6d}  {found.mean():5.1f}  {found.min():5.1f}", flush=True)
    draw(curves, pi)


def draw(curves, pi):
    figure, axes = plotting.new_figure(height=3.0)
    for colour, (name, of_seeds) in zip(
        (plotting.BLUE, plotting.GREEN), curves.items(), strict=True
    ):
        steps = np.array([periods for periods, _ in of_seeds[0]]) / 1e3
        found = np.concatenate([[each for _, each in curve] for curve in of_seeds], axis=1)
        low, middle, high = np.percentile(found, (5, 50, 95), axis=1)
        axes.fill_between(steps, low, high, color=colour, alpha=0.2, linewidth=0)
        axes.plot(
            steps,
            middle,
            color=colour,
            label=f"{name}, median and 5 to 95 % of {found.shape[1]} episodes",
        )
    axes.axhline(
        np.median(pi), color=plotting.RED, linestyle="--", label="tuned PI, median of 128 episodes"
    )
    axes.axhspan(*np.percentile(pi, (5, 95)), color=plotting.RED, alpha=0.1, linewidth=0)
    axes.set(
        xlabel="periods of training [1000]",
        ylabel="return of an episode",
        xlim=(0, None),
        ylim=(0, 500),
    )
    axes.legend(loc="lower right", framealpha=1.0)
    plotting.save(figure, "report/examples/learning.png")
    print("wrote report/examples/learning.png")


if __name__ == "__main__":
    main(*(int(argument) for argument in sys.argv[1:2]))
