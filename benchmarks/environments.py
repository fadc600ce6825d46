"""Learning environments: steps a second of 4096 joints, single environments, a Stepper, and rollout
of MuJoCo.

python benchmarks/environments.py
"""

from __future__ import annotations

import importlib.util
import itertools
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from measure import Section, Target, format_time, print_section, time_variants

import airmuscle as am
from airmuscle.core.errors import AirmuscleWarning
from airmuscle.engine import Double, Single
from airmuscle.engine.processes import available_cores

COUNT = 4096
SUBSTEPS = 10
PERIOD = 0.01
STEPS = 20
"""Steps of a single environment in one timing."""
HEADER = ("what", "median", "minimum", "environment steps a second")
TEXT = (
    f"`airmuscle/Joint-v0`, a period of {PERIOD * 1e3:g} ms in {SUBSTEPS} steps of RK4. The rows of"
    f" vectors are one call of `step` with random actions for {COUNT} environments on all cores"
    f" ({available_cores()}), with randomised parameters and new episodes where one ends; `kernel`"
    " is the integration alone. The single environment is that of `gymnasium.make`, with its"
    " wrappers. `mujoco.rollout` advances as many models of one hinge with two actuators"
    " `cylinder`, which are first-order lags of a force without muscle, valve and gas, by as many"
    " steps of its integrator implicitfast, on as many threads."
)
MODEL = """<mujoco><option timestep="0.001" integrator="implicitfast"/><worldbody><body>
<joint name="j" axis="0 1 0" damping="0.2"/>
<geom type="capsule" size=".02" fromto="0 0 0 0 0 .3" mass="1" contype="0" conaffinity="0"/></body></worldbody>
<actuator><cylinder name="l" joint="j" gear="0.04" timeconst="0.05" area="0.000314" ctrlrange="0 6e5"/>
<cylinder name="r" joint="j" gear="-0.04" timeconst="0.05" area="0.000314" ctrlrange="0 6e5"/></actuator></mujoco>"""  # noqa: E501
"""One joint with two native cylinders; the numbers are chosen."""


def is_installed(package: str) -> bool:
    """Whether a package is installed."""
    return importlib.util.find_spec(package) is not None


def vector_steps(precision: Any, count: int) -> tuple[Callable[[], Any], Callable[[], Any]]:
    """One step of a vector environment, and of its kernel."""
    import gymnasium

    env = gymnasium.make_vec(
        "airmuscle/Joint-v0",
        num_envs=count,
        vectorization_mode="vector_entry_point",
        precision=precision,
    )
    env.reset(seed=0)
    tables = np.random.default_rng(0).uniform(-1, 1, (16, count, 2)).astype(np.float32)
    actions = itertools.cycle(tables)
    return lambda: env.step(next(actions)), lambda: env.unwrapped._plants.advance(SUBSTEPS)


def single_steps() -> Callable[[], None]:
    """Steps of one environment."""
    import gymnasium

    env, action = gymnasium.make("airmuscle/Joint-v0"), np.array([0.1, -0.1], np.float32)

    env.reset(seed=0)

    def run() -> None:
        for _ in range(STEPS):
            _, _, terminated, truncated, _ = env.step(action)
            if terminated or truncated:
                env.reset()

    return run


def stepper_steps(substeps: int) -> Callable[[], None]:
    """Steps by hand of the joint, of so many steps of RK4 each."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        plant = am.load("joint-dmsp-20-matrix").plant
    stepper = am.Stepper(plant, plant.state_at(pressure=2e5), integrator=am.RungeKutta4(1e-3))
    inputs = [0.5, 0.0, 0.0, 0.5]

    def run() -> None:
        stepper.reset()
        for _ in range(STEPS):
            stepper.step(inputs, substeps * 1e-3)

    return run


def rollout_steps(count: int) -> Callable[[], Any]:
    """One environment step of as many joints by `mujoco.rollout`."""
    import mujoco
    from mujoco import rollout

    model = mujoco.MjModel.from_xml_string(MODEL)
    threads = available_cores()
    data = [mujoco.MjData(model) for _ in range(threads)]
    states = np.zeros((count, mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)))
    control = np.random.default_rng(0).uniform(0, 6e5, (count, 1, 2)).repeat(SUBSTEPS, axis=1)
    pool = rollout.Rollout(nthread=threads)
    return lambda: pool.rollout(model, data, states, control)


def features(observations: np.ndarray) -> np.ndarray:
    """Error, speed, rate of the reference, difference of the pressures [bar], reference, 1 of
    joints (N, 6).
    """
    angle, speed, left, right, target, later = observations.T
    return np.stack(
        [
            target - angle,
            speed,
            (later - target) / PERIOD,
            left - right,
            target,
            np.ones(len(angle)),
        ],
        1,
    )


def policy_returns(envs: Any, weights: np.ndarray, seed: int) -> np.ndarray:
    """Returns (N,) of the policies u = tanh(w . features) with weights (N, 6), actions u and -u."""
    observations, _ = envs.reset(seed=seed)
    total = np.zeros(len(weights))
    running = np.ones(len(weights), dtype=bool)
    for _ in range(500):
        u = np.tanh(np.einsum("nk,nk->n", features(observations), weights))
        observations, rewards, terminated, truncated, _ = envs.step(
            np.stack([u, -u], 1).astype(np.float32)
        )
        total += np.where(running, rewards, 0.0)
        running &= ~(terminated | truncated)
    return total


def searched_policy(
    generations: int = 25, episodes: int = 512, candidates: int = 64
) -> tuple[np.ndarray, float, float]:
    """Weights of a cross-entropy search, their mean return in fresh episodes, and the CPU time of
    the search [s].
    """
    import gymnasium

    envs = gymnasium.make_vec(
        "airmuscle/Joint-v0", num_envs=episodes, vectorization_mode="vector_entry_point"
    )
    random = np.random.default_rng(0)
    begun = time.process_time()
    mean = np.zeros(6)
    deviation = np.array([10.0, 1.0, 1.0, 1.0, 3.0, 1.0])
    for generation in range(generations):
        tried = mean + deviation * random.standard_normal((candidates, 6))
        returns = policy_returns(
            envs, np.repeat(tried, episodes // candidates, axis=0), 1000 + generation
        )
        best = tried[np.argsort(returns.reshape(candidates, -1).mean(1))[-10:]]
        mean = best.mean(0)
        deviation = best.std(0) + 1e-3
    spent = time.process_time() - begun
    return mean, float(policy_returns(envs, np.tile(mean, (episodes, 1)), 777_777).mean()), spent


def variants(count: int) -> tuple[dict[str, Callable[[], Any]], dict[str, int]]:
    """The timed calls that are possible here, and the environment steps of each."""
    runs: dict[str, Callable[[], Any]] = {"Stepper.step, 10 ms": stepper_steps(SUBSTEPS)}
    sizes = {"Stepper.step, 10 ms": STEPS}
    if is_installed("gymnasium"):
        am.outlets.register_environments()
        for name, precision in (
            ("double", Double()),
            ("single precision", Single()),
        ):
            step, kernel = vector_steps(precision, count)
            runs |= {f"vector environment, {name}": step, f"kernel, {name}": kernel}
            sizes |= {f"vector environment, {name}": count, f"kernel, {name}": count}
        runs["single environment"] = single_steps()
        sizes["single environment"] = STEPS
    if is_installed("mujoco"):
        runs["mujoco.rollout"] = rollout_steps(count)
        sizes["mujoco.rollout"] = count
    return runs, sizes


def section(rounds: int = 9, count: int = COUNT) -> Section:
    """The complete benchmark."""
    runs, sizes = variants(count)
    times = time_variants(runs, rounds)
    rows = [
        (
            name,
            *(
                format_time(t / (STEPS if sizes[name] == STEPS else 1))
                for t in (timed.median, timed.minimum)
            ),
            f"{sizes[name] / timed.minimum / 1e3:.4g} k",
        )
        for name, timed in times.items()
    ]
    targets = []
    for name, limit in (("double", 1.0), ("single precision", 2.0)):
        key = f"vector environment, {name}"
        if key in times:
            rate = count / times[key].minimum / 1e6
            targets.append(
                Target(f"environments: {name}, two cores", rate, limit, "M steps/s", at_least=True)
            )
    if "single environment" in times:
        alone = times["single environment"].minimum / STEPS * 1e6
        targets.append(Target("environments: one step of a single one", alone, 25, "us"))
    if {"mujoco.rollout", "vector environment, double"} <= times.keys():
        ratio = times["mujoco.rollout"].ratio_to(times["vector environment, double"])
        targets.append(
            Target("environments: mujoco.rollout / vector, double", ratio, 15, "x", at_least=True)
        )
    if is_installed("gymnasium") and count == COUNT:
        _, mean, spent = searched_policy()
        rows.append(
            ("search of a policy of six numbers, 25 x 512 episodes (CPU)", f"{spent:.3g} s", "", "")
        )
        targets.append(
            Target(
                "environments: its mean return in 512 fresh episodes", mean, 485, "", at_least=True
            )
        )
    missing = [package for package in ("gymnasium", "mujoco") if not is_installed(package)]
    note = f" Not installed and omitted: {', '.join(missing)}." if missing else ""
    return Section("Learning environments", TEXT + note, HEADER, tuple(rows), tuple(targets))


if __name__ == "__main__":
    print_section(section())
