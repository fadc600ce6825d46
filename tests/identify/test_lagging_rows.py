"""Slack rows that follow a jump of the pressure within the lag of the force are no evidence against
a law: they are left out of fit, comparison and prediction by the lag that the force shows at rows
that pull, and this is said.

The rig inflates by pulses of 40 kPa; its force is read a known number of rows later.
"""

from __future__ import annotations

import numpy as np
import pytest
from laboratories import MUSCLE, RESTING_LENGTH

from airmuscle.bench import Candidate, compare, fit, predict_static
from airmuscle.bench.statics import blank_surface, find_lagging_rows
from airmuscle.recording import Recording

PULSE = 4e4
ROWS_OF_PULSE = 10
SAMPLE_TIME = 0.05


def pulsed(lag: int, contraction: float, seed: int = 0) -> Recording:
    """A staircase of the pressure to 600 kPa and back at a held length; the force is `lag` rows
    later, and -1 N where the muscle is slack.
    """
    rng = np.random.default_rng(seed)
    steps = np.concatenate([np.arange(0.0, 6e5, PULSE), np.arange(6e5, 0.0, -PULSE)])
    pressure = np.repeat(steps, ROWS_OF_PULSE)
    seen = np.concatenate([np.full(lag, pressure[0]), pressure[: pressure.size - lag]])
    force = MUSCLE.force(seen, np.full(seen.size, contraction))
    force = np.where(force > 0.0, force + 0.2 * rng.standard_normal(force.size), -1.0)
    columns = {
        "time": SAMPLE_TIME * np.arange(pressure.size),
        "pressure": pressure + 200.0 * rng.standard_normal(pressure.size),
        "contraction": np.full(pressure.size, contraction),
        "force": force,
    }
    return Recording(columns, f"held {contraction}", {"resting_length": RESTING_LENGTH})


def bench(lag: int) -> list[Recording]:
    return [pulsed(lag, held, seed) for seed, held in enumerate((0.0, 0.05, 0.1, 0.15, 0.2))]


@pytest.mark.parametrize("lag", [1, 2, 3])
def test_the_rows_left_out_are_those_within_the_lag_that_the_force_shows(lag: int):
    runs = bench(lag)
    found = find_lagging_rows(runs)
    assert found.lag == pytest.approx((lag + 1) * SAMPLE_TIME)
    for run, mask in zip(runs, found.masks, strict=True):
        assert not (mask & (run["force"] > 0.0)).any()
        late = np.flatnonzero(mask) % ROWS_OF_PULSE
        assert set(late) <= set(range(lag + 1))
        pulls = MUSCLE.force(run["pressure"], run["contraction"]) > 10.0
        assert mask[pulls & (run["force"] <= 0.0)].all(), "these are false evidence"
    assert f"within {1e3 * found.lag:.3g} ms" in found.notes()[0]


def test_a_fit_and_a_comparison_leave_them_out_and_say_so():
    runs = bench(2)
    law = blank_surface(3, 1e5)
    result = fit(law, runs)
    count = int(np.count_nonzero(find_lagging_rows(runs).joined))
    assert count > 0
    assert result.rows_used == sum(map(len, runs)) - count
    assert any("the force has not yet followed" in note for note in result.notes)
    found = compare(runs, [Candidate("surface", law)])
    slack = sum(int(np.count_nonzero(run["force"] <= 0.0)) for run in runs)
    assert found.recommended.slack.rows == slack - count
    assert any("the force has not yet followed" in note for note in found.notes)


def test_a_prediction_does_not_count_them_as_errors():
    run = pulsed(2, 0.1)
    law = fit(blank_surface(4, 1e5), bench(0)).model
    prediction = predict_static(law, run)
    late = find_lagging_rows([run]).joined
    assert late.any()
    assert not (prediction.quantities[0].compared & late).any()
    assert any("the force has not yet followed" in note for note in prediction.notes)


def test_without_jumps_or_without_a_known_lag_every_slack_row_counts():
    coarse = [pulsed(1, 0.1).rows(slice(None, None, ROWS_OF_PULSE))]
    assert not find_lagging_rows(coarse).joined.any()
    few = [pulsed(1, 0.2).rows(slice(0, 40))]
    assert not find_lagging_rows(few).joined.any()
    assert find_lagging_rows(few).notes() == []
