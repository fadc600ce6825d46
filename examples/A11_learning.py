"""Reinforcement learning of a joint: PPO of Stable-Baselines3 on the native vector environment, beside a tuned PI.

python examples/A11_learning.py        writes learning.png to the working directory; needs stable-baselines3

Environment `airmuscle/Joint-v0`; network, settings of PPO, ranges of the PI gains and numbers of episodes are chosen.
"""

import sys

import numpy as np

try:
    import gymnasium
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecEnv, VecNormalize
except ImportError as error:
    print(f"no learning: {error}. Install the packages: pip install airmuscle[sim] stable-baselines3")
    sys.exit()

import airmuscle.environments  # noqa: F401 - registers them
from airmuscle.core import plotting

PERIODS, PERIOD = 500, 0.01
PLANTS, UPDATE = 128, 64
"""Plants that learn together, and periods between two updates."""
FRESH, FRESH_SEED = 128, 100_000
"""Episodes that judge, and the seed of the first one; neither PPO nor the PI is trained with them."""


def joints(count, **options):
    """A vector of joints in lanes, on one core."""
    mode = {"vectorization_mode": "vector_entry_point", "cores": 1}
    return gymnasium.make_vec("airmuscle/Joint-v0", num_envs=count, **mode, **options)


class LearningJoints(VecEnv):
    """The joints as Stable-Baselines3 expects them: an episode that is over begins anew in the same step.

    All joints are one object: attributes and methods are those of the vector, the same for each joint.
    """

    def __init__(self, count, seed):
        self.joints = joints(count, autoreset_mode=gymnasium.vector.AutoresetMode.SAME_STEP)
        super().__init__(count, self.joints.single_observation_space, self.joints.single_action_space)
        self.first_seed, self.actions = seed, None

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
    """The return (N,) of an episode for each seed; the policy maps observations (N, 6) to actions (N, 2)."""
    plants = joints(len(seeds))
    observations, _ = plants.reset(seed=[int(seed) for seed in seeds])
    total, running = np.zeros(len(seeds)), np.ones(len(seeds), bool)
    for _ in range(PERIODS):
        observations, rewards, terminated, *_ = plants.step(policy(observations))
        total += np.where(running, rewards, 0.0)
        running &= ~terminated
    plants.close()
    return total


def pi_control(gain, integral_gain):
    """PI control of the angle with conditional integration; its command fills one muscle and discharges the other."""
    integral = np.zeros(np.broadcast(gain, integral_gain).shape)

    def policy(observations):
        error = observations[:, 4] - observations[:, 0]
        command = gain * error + integral_gain * integral
        integral[:] += np.where(np.abs(command) < 1.0, PERIOD * error, 0.0)
        return np.clip(np.stack([command, -command], axis=1), -1.0, 1.0).astype(np.float32)

    return policy


def tuned_pi(sets=256, episodes=16):
    """Gains [1/rad, 1/(rad s)] with the maximum mean return of training episodes, the same ones for all sets."""
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
    settings = {"n_steps": UPDATE, "batch_size": 2048, "n_epochs": 5, "gamma": 0.98, "learning_rate": 1e-3}
    network = {"net_arch": [64, 64], "log_std_init": -0.5}
    return PPO("MlpPolicy", environment, policy_kwargs=network, seed=seed, device="cpu", **settings)


def learned_policy(model):
    """The mean action of a learner."""
    return lambda observations: model.predict(model.env.normalize_obs(observations), deterministic=True)[0]


def learning_curve(model, updates, every):
    """(periods, returns (N,) of fresh episodes) before learning, and after every so many updates."""
    seeds = FRESH_SEED + np.arange(FRESH)
    curve = [(0, returns(learned_policy(model), seeds))]
    while model.num_timesteps < updates * PLANTS * UPDATE:
        model.learn(every * PLANTS * UPDATE, reset_num_timesteps=model.num_timesteps == 0)
        curve.append((model.num_timesteps, returns(learned_policy(model), seeds)))
    return curve


def main():
    gains = tuned_pi()
    pi = returns(pi_control(*np.repeat(gains[None, :], FRESH, axis=0).T), FRESH_SEED + np.arange(FRESH))
    curve = learning_curve(learner(), updates=48, every=4)
    print(f"PI, {gains[0]:.3g} 1/rad and {gains[1]:.3g} 1/(rad s): mean return {pi.mean():.1f}, least {pi.min():.1f}")
    for periods, found in curve:
        print(f"PPO after {periods:6d} periods: mean return {found.mean():.1f}, least {found.min():.1f}")
    draw(curve, pi)


def draw(curve, pi):
    figure, axes = plotting.new_figure(height=3.0)
    steps = np.array([periods for periods, _ in curve]) / 1e3
    low, middle, high = np.percentile([found for _, found in curve], (5, 50, 95), axis=1)
    axes.fill_between(steps, low, high, color=plotting.BLUE, alpha=0.2, linewidth=0)
    axes.plot(steps, middle, color=plotting.BLUE, label="PPO, median and 5 to 95 % of 128 episodes")
    axes.axhline(np.median(pi), color=plotting.RED, linestyle="--", label="tuned PI, median of the same episodes")
    axes.axhspan(*np.percentile(pi, (5, 95)), color=plotting.RED, alpha=0.1, linewidth=0)
    axes.set(xlabel="periods of training [1000]", ylabel="return of an episode", xlim=(0, steps[-1]), ylim=(0, 500))
    axes.legend(loc="lower right", framealpha=1.0)
    plotting.save(figure, "learning.png")
    print("wrote learning.png")


if __name__ == "__main__":
    main()
