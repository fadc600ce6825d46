"""Claims about learning environments: Gymnasium's checker finds nothing, a vector environment is
its plants one by one, seeds repeat episodes, what is impossible is refused, and quantities have the
documented units.
"""

from __future__ import annotations

import copy
import dataclasses
import pickle
import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from control_plants import JOINT, LIFT
from widths import widened

import airmuscle as am
from airmuscle.engine import Double, RungeKutta4, Single, Stepper
from airmuscle.engine.run.batch import BatchStepper
from airmuscle.errors import ParameterError
from airmuscle.files.library import ParameterUncertainty
from airmuscle.outlets import (
    ArmReaching,
    FactorRange,
    FitUncertainty,
    JointTracking,
    LoadLifting,
    MeasuredObservations,
    ValueRange,
    register_environments,
)
from airmuscle.outlets import environments as room
from airmuscle.outlets.environments import PlantEnv, with_on_off_valves

NAMES = ("Joint", "Lift", "Arm")
gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is not installed")
register_environments()

from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.vector import AutoresetMode  # noqa: E402

TASK = JointTracking(JOINT)
VARIED = (
    ValueRange(("target_frequency",), 0.2, 1.0),
    FactorRange(("plant.mechanism.inertia",), 0.8, 1.2),
)


def single(task=TASK, **options):
    return gymnasium.make("airmuscle/Joint-v0", task=task, **options)


def vector(count, task=TASK, **options):
    return gymnasium.make_vec(
        "airmuscle/Joint-v0",
        num_envs=count,
        vectorization_mode="vector_entry_point",
        task=task,
        **options,
    )


@pytest.mark.parametrize("name", NAMES)
def test_gymnasium_finds_no_fault(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gymnasium.make(f"airmuscle/{name}-v0").unwrapped, skip_render_check=True)


def pair_of_vectors(name, mode, **options):
    """The same plants in lanes, and one by one in a vector of Gymnasium."""
    lanes = gymnasium.make_vec(
        f"airmuscle/{name}-v0",
        vectorization_mode="vector_entry_point",
        cores=2,
        autoreset_mode=mode,
        **options,
    )
    kept = {"vectorization_mode": "sync", "vector_kwargs": {"autoreset_mode": mode}}
    return lanes, gymnasium.make_vec(f"airmuscle/{name}-v0", **kept, **options)


def assert_same_terms(found, expected, count):
    """The terms of the rewards where Gymnasium's own vector has them."""
    for term in ("closeness", "effort"):
        present = expected.get(f"_{term}", np.zeros(count, bool))
        np.testing.assert_array_equal(found[f"_{term}"], present)
        exact = expected.get(term, np.zeros(count))
        np.testing.assert_allclose(found[term], exact, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
@pytest.mark.parametrize("name", NAMES)
def test_a_vector_is_its_plants_one_by_one_also_where_episodes_begin_anew(name, mode):
    """Actions that soon end episodes of the joint, and a truncation after 15 periods; 19 plants
    fill no block.
    """
    count = 19
    periods = 40
    together, apart = pair_of_vectors(name, mode, num_envs=count, max_episode_steps=15)
    assert together.metadata["autoreset_mode"] == apart.metadata["autoreset_mode"]
    first = together.reset(seed=5)[0]
    second = apart.reset(seed=5)[0]
    np.testing.assert_array_equal(first, second)
    rng = np.random.default_rng(0)
    ended = 0
    for _ in range(periods):
        actions = rng.uniform(-1.2, 1.2, together.action_space.shape).astype(np.float32)
        found = together.step(actions)
        expected = apart.step(actions)
        for value, exact in zip(found[:2], expected[:2], strict=True):
            np.testing.assert_allclose(value, exact, rtol=1e-6, atol=1e-9)
        np.testing.assert_array_equal(found[2], expected[2])
        np.testing.assert_array_equal(found[3], expected[3])
        ended += found[2].sum() + found[3].sum()
        assert_same_terms(found[4], expected[4], count)
        assert ("final_info" in found[4]) == ("final_info" in expected[4])
        if "final_info" in expected[4]:
            np.testing.assert_array_equal(found[4]["_final_info"], expected[4]["_final_info"])
            assert_same_terms(found[4]["final_info"], expected[4]["final_info"], count)
    assert ended >= 2 * count
    together.close()


def test_an_episode_of_a_vector_ends_where_the_task_ends_it():
    """Plant 0 is driven to its limit of angle; the step after its end begins anew, without
    reward.
    """
    env = vector(3, dataclasses.replace(TASK, largest_angle=0.2))
    env.reset(seed=1)
    actions = np.zeros((3, 2), np.float32)
    actions[0] = 1.0, -1.0
    for _ in range(200):
        observations, rewards, terminated, truncated, _ = env.step(actions)
        if terminated.any():
            break
    assert terminated.tolist() == [True, False, False]
    assert abs(observations[0, 0]) > 0.2
    observations, rewards, terminated, truncated, _ = env.step(actions)
    assert rewards[0] == 0.0 < rewards[1]
    assert not terminated[0]
    assert not truncated[0]
    assert abs(observations[0, 0]) <= 0.1
    assert observations[0, 1] == 0.0


@pytest.mark.parametrize("name", widened(["Joint", "Lift", "Arm"], lambda name: name == "Arm"))
def test_a_picture_shows_the_present_state(name):
    env = gymnasium.make(f"airmuscle/{name}-v0", render_mode="rgb_array")
    env.reset(seed=1)
    first = env.render()
    for _ in range(30):
        env.step(np.resize([1.0, -1.0], env.action_space.shape).astype(np.float32))
    second = env.render()
    assert (first.dtype, first.ndim, first.shape[2]) == (np.uint8, 3, 3)
    assert first.shape == second.shape
    assert (first != second).any()
    assert (env.render() == second).all()
    with pytest.raises(
        ParameterError, match="render_mode is 'ansi'; allowed are 'human', 'rgb_array' and None"
    ):
        PlantEnv(TASK, render_mode="ansi")


def test_a_window_shows_each_state_until_it_is_closed():
    import matplotlib.pyplot as plt

    env = gymnasium.make("airmuscle/Lift-v0", render_mode="human")
    drawn = gymnasium.make("airmuscle/Lift-v0", render_mode="rgb_array")
    for each in (env, drawn):
        each.reset(seed=1)
        each.step(np.ones(1, np.float32))
    (axes,) = plt.figure("airmuscle").axes
    assert (axes.images[0].get_array() == drawn.render()).all()
    assert env.render() is None
    env.close()
    assert "airmuscle" not in plt.get_figlabels()


def test_on_off_valves_are_open_or_closed():
    env, plain = gymnasium.make("airmuscle/JointOnOff-v0"), gymnasium.make("airmuscle/Joint-v0")
    check_env(env, skip_render_check=True)
    vector = gymnasium.make_vec(
        "airmuscle/JointOnOff-v0", num_envs=2, vectorization_mode="vector_entry_point"
    )
    assert (env.action_space.nvec == 3).all()
    assert vector.action_space.shape == (2, 2)
    for each in (env, plain):
        each.reset(seed=7)
    vector.reset(seed=7)
    rng = np.random.default_rng(2)
    for _ in range(20):
        action = rng.integers(0, 3, 2)
        found = env.step(action)[0]
        assert (found == plain.step(action - 1.0)[0]).all()
        many = vector.step(np.array([action, action]))[0]
        assert many[0] == pytest.approx(found, abs=1e-5)
    with pytest.raises(ParameterError, match="is no pair of a fill and a discharge valve"):
        with_on_off_valves(gymnasium.make("airmuscle/Arm-v0"))


def test_a_mask_chooses_the_plants_that_begin_anew_as_in_the_vectors_of_gymnasium():
    """After one step all episodes are over: those of the mask go on, the others begin anew in the
    next step.
    """
    together, apart = pair_of_vectors(
        "Lift", AutoresetMode.NEXT_STEP, num_envs=5, max_episode_steps=1
    )
    mask = np.array([True, False, True, False, False])
    action = np.full((5, 1), 0.4, np.float32)
    for env in (together, apart):
        env.reset(seed=3)
        env.step(action)
    first, second = (env.reset(options={"reset_mask": mask.copy()})[0] for env in (together, apart))
    np.testing.assert_allclose(first, second, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(
        together.step(action)[0], apart.step(action)[0], rtol=1e-6, atol=1e-9
    )
    for wrong, options in ((mask[:2], {}), (mask.astype(int), {}), (mask, {"seed": 1})):
        with pytest.raises(ParameterError, match="give 5 booleans, no seed"):
            together.reset(options={"reset_mask": wrong}, **options)


def test_the_terms_of_a_reward_add_up_to_it():
    env = single(dataclasses.replace(TASK, effort_weight=0.3)).unwrapped
    env.reset(seed=2)
    _, reward, _, _, terms = env.step(np.array([0.5, -2.0]))
    assert terms["effort"] == pytest.approx(0.3 * (0.25 + 1.0) / 2)
    assert reward == pytest.approx(terms["closeness"] - terms["effort"], abs=1e-15)
    assert 0 < terms["closeness"] <= 1


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
@pytest.mark.parametrize("make", [lambda: single().unwrapped, lambda: vector(3)])
def test_a_copy_of_an_environment_goes_on_by_itself(make, copied):
    env = make()
    env.reset(seed=4)
    actions = np.full(env.action_space.shape, 0.3)
    env.step(actions)
    other = copied(env)
    for _ in range(3):
        for first, second in zip(env.step(actions)[:2], other.step(actions)[:2], strict=True):
            np.testing.assert_array_equal(first, second)
    for first, second in zip(env.reset()[:1], other.reset()[:1], strict=True):
        np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize(
    ("line", "module"), [("import airmuscle.environments", ""), ("", "airmuscle.environments:")]
)
def test_the_import_registers_the_environments(line, module):
    """By hand, or by Gymnasium, which imports the module of `module:identifier` first."""
    code = f'import gymnasium\n{line}\nprint(gymnasium.make("{module}airmuscle/Lift-v0").spec.id)'
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "airmuscle/Lift-v0"


def test_the_short_name_has_the_names_of_the_room():
    assert am.environments.__all__ == room.__all__
    assert all(getattr(am.environments, name) is getattr(room, name) for name in room.__all__)


def test_observations_pass_through_sensors():
    plain = single().unwrapped
    seen = MeasuredObservations(
        single().unwrapped, noise=(0.01, 0, 0, 0, 0, 0), resolution=(0, 0.05, 0, 0, 0, 0), delay=2
    )
    exact = [plain.reset(seed=5)[0]]
    read = [seen.reset(seed=5)[0]]
    for k in range(60):
        action = np.array([np.sin(0.1 * k), -np.sin(0.1 * k)])
        exact.append(plain.step(action)[0])
        read.append(seen.step(action)[0])
    exact = np.array(exact)[:-2]
    late = np.array(read)[2:]
    np.testing.assert_array_equal(np.array(read)[:3], np.array(read)[[0, 0, 0]])
    np.testing.assert_array_equal(late[:, 2:], exact[:, 2:])
    np.testing.assert_allclose(
        late[:, 1], 0.05 * np.round(exact[:, 1].astype(float) / 0.05), atol=1e-6
    )
    assert np.std(late[:, 0] - exact[:, 0]) == pytest.approx(0.01, rel=0.35)
    with pytest.raises(ParameterError, match="MeasuredObservations: noise is -1"):
        MeasuredObservations(plain, noise=-1)


def test_seeds_repeat_episodes_and_different_seeds_differ():
    def episode(seed):
        env = single(randomisation=VARIED)
        rows = [env.reset(seed=seed)[0]]
        for k in range(5):
            rows.append(env.step(np.array([0.1 * k, -0.2], np.float32))[0])
        return np.array(rows), env.reset()[0]

    first, next_first = episode(3)
    second, next_second = episode(3)
    other, _ = episode(4)
    assert np.array_equal(first, second)
    assert np.array_equal(next_first, next_second)
    assert not np.array_equal(first[0], next_first)
    assert not np.array_equal(first, other)


@pytest.mark.parametrize("precision", [Double(), Single()], ids=["double", "single"])
def test_a_vector_does_not_depend_on_the_threads_and_repeats_itself(precision):
    def run(cores):
        env = vector(70, randomisation=VARIED, cores=cores, precision=precision)
        env.reset(seed=8)
        rng = np.random.default_rng(1)
        rows = [env.step(rng.uniform(-1, 1, (70, 2)).astype(np.float32))[0] for _ in range(20)]
        env.close()
        return rows[-1]

    assert np.array_equal(run(1), run(2))


def test_single_precision_agrees_to_some_digits():
    def run(precision):
        env = vector(4, precision=precision)
        env.reset(seed=2)
        for _ in range(50):
            observations = env.step(np.full((4, 2), 0.3, np.float32))[0]
        return observations

    np.testing.assert_allclose(run(Single()), run(Double()), rtol=2e-4, atol=1e-4)


def test_observations_have_the_documented_units():
    env = single()
    env.reset(seed=0)
    for _ in range(10):
        found, reward, *_ = env.step(np.array([0.5, -0.25], np.float32))
    stepper = env.unwrapped._stepper
    task = env.unwrapped.task
    state = dict(zip(stepper.state_names, stepper.state.tolist(), strict=True))
    inputs = {"left.fill": 0.5, "left.discharge": 0.0, "right.fill": 0.0, "right.discharge": 0.25}
    outputs = JOINT.outputs(state, inputs)
    expected = {
        "angle": state["angle"],
        "angular_speed": state["angular_speed"],
        "left.pressure": outputs["left.pressure"] / 1e5,
        "right.pressure": outputs["right.pressure"] / 1e5,
        "target": 0.3 * np.sin(2 * np.pi * 0.5 * 0.1),
        "next_target": 0.3 * np.sin(2 * np.pi * 0.5 * 0.11),
    }
    assert [o.name for o in task.observations] == list(expected)
    np.testing.assert_allclose(found, list(expected.values()), rtol=1e-5)
    error = state["angle"] - expected["target"]
    assert reward == pytest.approx(np.exp(-((error / 0.1) ** 2)) - 0.01 * (0.25 + 0.0625) / 2)


def test_the_units_of_a_lift_are_documented_too():
    env = single(LoadLifting(LIFT, target_height=0.02))
    found, _ = env.reset(seed=0)
    position = [s.name for s in LIFT.states].index("position")
    state = env.unwrapped._stepper.state
    assert found[0] == pytest.approx(100 * state[position])
    assert found[3] == pytest.approx(2.0)
    assert 1.0 <= found[2] <= 2.0


@pytest.mark.parametrize("actions", [[np.nan, 0.0], [np.inf, 0.0], [0.0], None, [0.0, 0.0, 0.0]])
def test_an_action_that_is_not_finite_or_of_another_shape_is_refused(actions):
    env = single()
    env.reset(seed=0)
    with pytest.raises(ParameterError, match="give 2 finite numbers from -1 to 1"):
        env.unwrapped.step(actions)


def test_the_row_of_an_action_that_is_not_finite_is_named():
    env = vector(4)
    env.reset(seed=0)
    actions = np.zeros((4, 2), np.float32)
    actions[2, 1] = np.nan
    with pytest.raises(ParameterError, match=r"the actions, row 2.*nan"):
        env.step(actions)
    with pytest.raises(ParameterError, match=r"the shape \(2, 4\); give \(4, 2\)"):
        env.step(actions.T)


def test_an_impossible_state_ends_the_episode_with_zeros():
    """A step far too long for the plant: its state is soon no number, alone and in a vector."""
    coarse = dataclasses.replace(TASK, period=0.5, largest_angle=3.2)
    options = {"integrator": RungeKutta4(0.5)}
    alone = single(coarse, **options)
    together = vector(2, coarse, **options)
    alone.reset(seed=0)
    together.reset(seed=0)
    for _ in range(100):
        found = alone.unwrapped.step(np.array([1.0, -1.0]))
        if found[2]:
            break
    assert (found[0].tolist(), found[1:4]) == ([0.0] * 6, (0.0, True, False))
    ended = False
    for _ in range(100):
        observations, rewards, terminated, *_ = together.step(np.tile([1.0, -1.0], (2, 1)))
        assert np.isfinite(observations).all()
        assert np.isfinite(rewards).all()
        ended |= bool(terminated.any())
    assert ended


def test_randomisation_reaches_the_plants():
    env = vector(64, randomisation=VARIED)
    env.reset(seed=3)
    parameters = env.unwrapped._plants.parameters
    spread = np.ptp(parameters.transpose(0, 2, 1).reshape(-1, parameters.shape[1])[:64], axis=0)
    assert np.count_nonzero(spread) == 2
    (frequency,) = (s for s in spread if s > 0.1)
    assert 0.6 < frequency <= 0.8
    assert 0.3 * 0.02 < min(spread[spread > 0]) <= 0.4 * 0.02


def test_the_covariance_of_a_fit_is_that_of_the_draws():
    told = ParameterUncertainty(("characteristic.a", "b"), (2.0, 0.5), ((1.0, -0.8), (-0.8, 1.0)))
    normal = FitUncertainty(told, muscles=(0, 1))
    draws = normal.values(
        np.array([10.0, 20.0, 1.0, 2.0]), np.random.default_rng(0).random((20000, 2))
    )
    np.testing.assert_allclose(draws.mean(axis=0), [10.0, 20.0, 1.0, 2.0], rtol=0.02)
    np.testing.assert_allclose(np.cov(draws[:, ::2].T), told.covariance, rtol=0.05)
    np.testing.assert_allclose(draws[:, 1::2] - draws[:, ::2], [[10.0, 1.0]] * 20000, rtol=1e-12)
    assert normal.paths == (
        "plant.muscle[0].contractile.a",
        "plant.muscle[1].contractile.a",
        "plant.muscle[0].b",
        "plant.muscle[1].b",
    )


IDENTIFIED = """
[uncertainty]
deviations = { angle = "1 deg" }
parameters = ["mechanism.inertia", "circuit[0].supply.pressure, circuit[1].supply.pressure", "mechanism.weight_torque"]
standard_errors = [0.002, 1e4, 0.05]
correlations = [[1.0, -0.7, 0.0], [-0.7, 1.0, 0.2], [0.0, 0.2, 1.0]]
"""


@pytest.fixture
def identified(tmp_path):
    """A scenario as a fit writes it."""
    path = tmp_path / "identified.toml"
    run = '[run]\nduration = "1 s"\n'
    path.write_text(f'[plant]\nlibrary = "joint-dmsp-20-matrix"\n{run}{IDENTIFIED}')
    return am.files.load_scenario(path)


def test_draws_of_an_identified_plant_have_its_covariance_and_stay_within_the_bounds(identified):
    told = identified.uncertainty
    drawn = FitUncertainty(told).variations(identified.plant, 4000, seed=1)
    names = [path for group in told.parameters for path in group]
    assert list(drawn) == names
    columns = np.array([drawn[group[0]] for group in told.parameters])
    errors = np.sqrt(np.diag(told.covariance))
    assert (
        abs((np.cov(columns) - told.covariance) / np.outer(errors, errors)).max() < 0.08
    )  # 3.5 standard deviations
    np.testing.assert_array_equal(drawn[names[1]], drawn[names[2]])
    wide = dataclasses.replace(told, covariance=1e6 * told.covariance)
    low = FitUncertainty(wide).variations(identified.plant, 200)["mechanism.inertia"].min()
    assert low == 1e-6  # its declared bound
    run = am.simulate_batch(
        identified.plant,
        {name: column[:8] for name, column in drawn.items()},
        am.Schedule({"left.fill": ((0.0, 1.0),)}),
        duration=0.4,
        integrator=RungeKutta4(1e-3),
        keep=["angle"],
    )
    assert 0.0 < np.ptp(run["angle"][:, -1]) < 0.1


def test_an_identified_plant_varies_in_its_environment(identified):
    fitted = FitUncertainty(identified.uncertainty)
    env = vector(64, JointTracking(identified.plant), randomisation=(fitted,))
    env.reset(seed=3)
    parameters = env.unwrapped._plants.parameters.transpose(0, 2, 1).reshape(
        -1, env.unwrapped._plants.parameters.shape[1]
    )
    assert np.count_nonzero(np.ptp(parameters[:64], axis=0)) == 4
    without = dataclasses.replace(
        identified.uncertainty, parameters=(), covariance=np.zeros((0, 0))
    )
    with pytest.raises(ParameterError, match="the fit states no covariance of its parameters"):
        FitUncertainty(without)


def test_parameters_of_very_different_size_keep_their_standard_errors_and_correlations():
    """A force [N], a conductance [m3/(s Pa)] and a stiffness [N/m] of one fit differ by 14 powers
    of ten.
    """
    told = ParameterUncertainty(
        ("offset", "conductance", "stiffness", "volume"),
        (1.0, 1e-11, 1e3, 1e-7),
        ((1.0, 0.5, 0.3, 0.0), (0.5, 1.0, 0.4, 0.2), (0.3, 0.4, 1.0, 0.0), (0.0, 0.2, 0.0, 1.0)),
    )
    draws = FitUncertainty(told).values(np.zeros(4), np.random.default_rng(0).random((20000, 4)))
    np.testing.assert_allclose(draws.std(axis=0), told.standard_errors, rtol=0.03)
    np.testing.assert_allclose(np.corrcoef(draws.T), told.correlations, atol=0.03)


def test_the_uncertainty_of_a_muscle_file_varies_its_law():
    name = "contractile.max_force"
    told = ParameterUncertainty((name.replace("contractile", "characteristic"),), (5.0,), ((1.0,),))
    env = single(LoadLifting(LIFT), randomisation=(FitUncertainty(told),))
    first, second = (env.reset(seed=i)[0] for i in (0, 1))
    assert not np.array_equal(first, second)


@pytest.mark.parametrize(
    ("randomisation", "message"),
    [
        (
            (ValueRange(("plant.mechanism.inertai",), 0.1, 0.2),),
            "no parameter 'plant.mechanism.inertai'. Did you mean",
        ),
        (
            (ValueRange(("plant.mechanism.inertia",), -1.0, 0.2),),
            "would be -1; allowed range: 1e-06 to 1e",
        ),
        ((VARIED[1], VARIED[1]), "'plant.mechanism.inertia' is varied twice"),
        (VARIED[0], "give a tuple, such as"),
    ],
)
def test_an_impossible_randomisation_is_refused(randomisation, message):
    with pytest.raises(ParameterError, match=message):
        single(randomisation=randomisation)


def test_other_impossible_requests_are_refused():
    with pytest.raises(ParameterError, match="must be finite and rise"):
        FactorRange(("a",), 1.0, float("nan"))
    with pytest.raises(ParameterError, match="give a tuple of one path or more"):
        FactorRange("plant.mechanism.inertia", 0.8, 1.2)
    with pytest.raises(ParameterError, match="the fit states no covariance of its parameters"):
        FitUncertainty(None)
    with pytest.raises(ParameterError, match="give an EnvironmentTask"):
        single(JOINT)
    with pytest.raises(ParameterError, match="ArmReaching: 2 targets for 1 joints; give one each"):
        ArmReaching(JOINT)
    with pytest.raises(ParameterError, match="the period must be a whole number of steps"):
        single(integrator=RungeKutta4(0.003))
    with pytest.raises(ParameterError, match="max_episode_steps is 0"):
        vector(2, max_episode_steps=0)
    with pytest.raises(ParameterError, match="count is 0"):
        vector(0)
    with pytest.raises(ParameterError, match=r"call reset\(\) before the first step"):
        vector(2).step(np.zeros((2, 2)))
    with pytest.raises(ParameterError, match="there are 2 seeds for 3 plants"):
        vector(3).reset(seed=[1, 2])
    with pytest.raises(ParameterError, match="it must have a fixed step"):
        BatchStepper(JOINT, 2, None)


def test_a_batch_of_steppers_is_its_steppers():
    start = JOINT.state_at(pressure=2e5)
    batch = BatchStepper(JOINT, 3, RungeKutta4(1e-3), cores=1)
    assert batch._parts[0].entry_address  # of stored machine code: no further process compiles it
    batch.states[:] = np.array(list(start.values()))[None, :, None]
    batch.inputs[:, :, 1] = 0.5, 0.0, 0.0, 0.5
    batch.advance(100)
    one = Stepper(JOINT, start, integrator=RungeKutta4(1e-3))
    one.step([0.5, 0.0, 0.0, 0.5], 0.1)
    np.testing.assert_allclose(batch.states[0, :, 1], one.state, rtol=1e-11)
    np.testing.assert_allclose(batch.outputs[0, :, 1], one.outputs, rtol=1e-9, atol=1e-9)
    assert abs(batch.states[0, 2, 0]) < abs(one["angle"])


def test_the_package_is_imported_without_gymnasium_which_the_error_names():
    code = (
        "import sys; sys.modules['gymnasium'] = None\n"
        "import airmuscle.outlets.environments as e, importlib.util\n"
        "importlib.util.find_spec = lambda name: None\n"
        "try: e.register_environments()\n"
        "except Exception as error: print(type(error).__name__, error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.startswith(
        "InputError learning environments need the package gymnasium. Install it: pip"
    )


def test_the_example_of_the_page_is_an_environment():
    page = Path(__file__).parents[2] / "docs" / "guides/environments.md"
    (code,) = re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    names: dict[str, object] = {}
    exec(code, names)
    env = gymnasium.make(
        "airmuscle/Joint-v0", task=names["task"], randomisation=names["randomisation"]
    )
    observation, _ = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    assert env.step(env.action_space.sample())[1] > -0.01
