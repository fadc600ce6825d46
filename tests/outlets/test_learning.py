"""Claims about learning on the native vector environment: an episode begins anew in the step that
ends it where this is asked for, and PPO and SAC learn to follow better than a PI controller whose
gains are tuned for the same return.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from airmuscle.errors import ParameterError
from airmuscle.outlets import register_environments

gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is not installed")
register_environments()
SAME_STEP = gymnasium.vector.AutoresetMode.SAME_STEP
EXAMPLE = Path(__file__).parents[2] / "examples" / "learned_joint.py"


def test_with_same_step_an_episode_begins_anew_at_once_as_in_a_vector_of_gymnasium():
    """Episodes end by their angle and by truncation; 19 plants fill no block."""
    options = {"num_envs": 19, "max_episode_steps": 15}
    together = gymnasium.make_vec(
        "airmuscle/Joint-v0",
        vectorization_mode="vector_entry_point",
        cores=1,
        autoreset_mode=SAME_STEP,
        **options,
    )
    apart = gymnasium.make_vec(
        "airmuscle/Joint-v0",
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": SAME_STEP},
        **options,
    )
    assert together.metadata["autoreset_mode"] == apart.metadata["autoreset_mode"]
    np.testing.assert_array_equal(together.reset(seed=5)[0], apart.reset(seed=5)[0])
    rng = np.random.default_rng(0)
    ended = 0
    for _ in range(40):
        actions = rng.uniform(-1.2, 1.2, together.action_space.shape).astype(np.float32)
        found = together.step(actions)
        expected = apart.step(actions)
        for value, exact in zip(found[:4], expected[:4], strict=True):
            np.testing.assert_allclose(value, exact, rtol=1e-6, atol=1e-9)
        over = found[2] | found[3]
        assert ("final_obs" in found[4]) == over.any() == ("final_obs" in expected[4])
        for i in np.flatnonzero(over):
            last = found[4]["final_obs"][i]
            np.testing.assert_allclose(last, expected[4]["final_obs"][i], rtol=1e-6, atol=1e-9)
            assert not np.array_equal(last, found[0][i])
        ended += over.sum()
    assert ended >= 2 * 19
    together.close()


def test_another_mode_of_reset_is_refused():
    with pytest.raises(
        ParameterError,
        match=r"autoreset_mode is .*DISABLED.*; allowed are AutoresetMode\.NEXT_STEP",
    ):
        gymnasium.make_vec(
            "airmuscle/Joint-v0",
            num_envs=2,
            vectorization_mode="vector_entry_point",
            autoreset_mode=gymnasium.vector.AutoresetMode.DISABLED,
        )


@pytest.fixture(scope="module")
def example():
    pytest.importorskip("stable_baselines3", reason="stable-baselines3 is not installed")
    spec = importlib.util.spec_from_file_location("learning_example", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
def test_ppo_follows_better_than_a_pi_controller_tuned_for_the_same_return(example):
    """128 episodes with seeds that neither was trained with; measured means: 480 and 460 of at most
    500.
    """
    fresh = example.FRESH_SEED + np.arange(example.FRESH)
    gains = example.tuned_pi()
    pi = example.returns(
        example.pi_control(*np.repeat(gains[None, :], fresh.size, axis=0).T), fresh
    )
    (_, before), *_, (_, after) = example.learning_curve(example.learner(), updates=36, every=36)
    better = after - pi
    assert pi.mean() > 450.0  # a baseline that tracks
    assert before.mean() < 200.0
    assert better.mean() > 10.0
    assert better.mean() > 4.0 * better.std() / np.sqrt(fresh.size)
    assert after.min() > pi.min() + 10.0


@pytest.mark.slow
def test_sac_follows_better_than_a_pi_controller_after_a_sixth_of_the_periods(example):
    """65 536 periods; measured means of three seeds: 486, 481 and 484 against 460, with 491 of six
    numbers.
    """
    fresh = example.FRESH_SEED + np.arange(example.FRESH)
    gains = example.tuned_pi()
    pi = example.returns(
        example.pi_control(*np.repeat(gains[None, :], fresh.size, axis=0).T), fresh
    )
    _, (periods, after) = example.learning_curve(example.off_policy_learner(), updates=8, every=8)
    assert periods == 65_536
    assert after.mean() > pi.mean() + 10.0
    assert 487.0 < example.returns(example.with_pressure_difference, fresh).mean() < 495.0
