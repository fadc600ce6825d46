"""Hysteresis loops of a file with several runs: one loop for each run with two branches, named
after file and rows.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from airmuscle.bench import classify_records, find_loops, fit_jointly, fit_loop
from airmuscle.bench.campaign import fit_friction_stage
from airmuscle.bench.hysteresis import preferred_fit
from airmuscle.errors import AirmuscleWarning, IdentificationError
from airmuscle.physics import CreepElements, MaxwellSlip
from airmuscle.recording import Recording

SLIP = MaxwellSlip((2e4, 1e4), (3e-4, 2e-3))
LEVELS = (1e5, 2e5, 3e5)
LEG = np.linspace(0.02, 0.14, 200)
SWEEP = np.concatenate([LEG, LEG[::-1], LEG, LEG[::-1]])


def recording(levels, sweep=SWEEP) -> Recording:
    """Sweeps of the contraction at several pressures, with friction and noise."""
    rng = np.random.default_rng(7)
    pressure = np.repeat(levels, len(sweep)) + 50.0 * rng.standard_normal(len(levels) * len(sweep))
    contraction = np.tile(sweep, len(levels))
    force = np.repeat(levels, len(sweep)) * 3e-3 * (1.0 - 3.0 * contraction) + 100.0
    force = force - np.tile(SLIP.force_along((sweep - sweep[0]) * 0.3), len(levels))
    force += 0.5 * rng.standard_normal(len(force))
    time = 0.2 * np.arange(len(force))
    columns = {"time": time, "pressure": pressure, "contraction": contraction, "force": force}
    return Recording(columns, "three.csv", {"resting_length": 0.3})


def test_a_file_with_three_isobaric_runs_has_three_loops_of_which_each_is_justified():
    loops = find_loops([recording(LEVELS)])
    assert [loop.recording.origin for loop in loops] == [
        f"three.csv, rows {1 + 800 * i} to {800 * (i + 1)}" for i in range(3)
    ]
    assert [loop.run.constant_value for loop in loops] == pytest.approx(LEVELS, rel=1e-3)
    fit = fit_loop(loops[0], elements=4)
    assert fit.recommended is not None
    assert np.isfinite(fit.recommended.aicc_reduction)
    assert fit.recommended.series.origin == "three.csv, rows 1 to 800"


def test_the_figure_of_a_loop_names_its_branches_by_what_is_varied():
    def labels(run: Recording) -> set[str]:
        (loop,) = find_loops([run])
        return {text.get_text() for text in loop.plot().legends[0].get_texts()}

    isobaric = recording(LEVELS[:1])
    pressure = 1e5 + 3e6 * (isobaric["contraction"] - LEG[0])
    friction = SLIP.force_along((isobaric["contraction"] - LEG[0]) * 0.3)
    isometric = isobaric.with_columns(
        pressure=pressure,
        contraction=np.full(len(isobaric), 0.05),
        force=3e-3 * pressure - friction,
    )
    assert labels(isobaric) == {"contracting", "extending"}
    assert labels(isometric) == {"inflating", "deflating"}


def test_a_file_with_one_run_is_one_loop_with_the_name_of_the_file():
    (loop,) = find_loops([recording(LEVELS[:1])])
    assert (loop.recording.origin, len(loop.recording)) == ("three.csv", 800)


def test_sweeps_in_one_direction_at_several_levels_are_no_loop():
    with pytest.raises(
        IdentificationError, match=r"three.csv, rows \d+ to \d+: the extending branch has no rows"
    ):
        find_loops([recording(LEVELS, LEG)])


def test_a_loop_of_another_muscle_at_the_same_level_is_no_repeat():
    first = recording(LEVELS[:1])
    longer = dataclasses.replace(first, constants={"resting_length": 0.2})
    other = dataclasses.replace(first, constants={"resting_length": 0.3, "specimen": "B"})
    assert [loop.repeat is not None for loop in find_loops([first, first])] == [True]
    assert [loop.repeat for loop in find_loops([first, longer, other])] == [None, None, None]


def test_a_recording_without_a_loop_is_left_out_with_a_warning_that_names_it():
    one_way = dataclasses.replace(recording(LEVELS[:1], LEG), origin="one_way.csv")
    with pytest.warns(
        AirmuscleWarning, match=r"left out: one_way\.csv: the extending branch has no rows to fit"
    ):
        loops = find_loops([one_way, recording(LEVELS[:1])])
    assert [loop.recording.origin for loop in loops] == ["three.csv"]


def test_a_loop_at_another_held_length_is_no_repeat_without_a_resting_length_either():
    def held(length: float) -> Recording:
        pressure = np.concatenate([np.linspace(5e4, 5e5, 200), np.linspace(5e5, 5e4, 200)])
        columns = {
            "time": 0.2 * np.arange(400.0),
            "pressure": pressure,
            "length": np.full(400, length),
        }
        return Recording({**columns, "force": 200.0 + 1e-3 * pressure}, f"{length}")

    assert [
        loop.repeat is not None for loop in find_loops([held(0.3), held(0.296), held(0.2961)])
    ] == [False, True]


@pytest.mark.slow
def test_a_campaign_and_the_command_for_hysteresis_choose_the_same_law():
    """Loops whose transition takes 20 of 900 rows: every sixth row no longer shows its form."""
    rng = np.random.default_rng(4)
    rows = np.arange(900.0)
    swept = 0.0173 * (1.0 - np.cos(2.0 * np.pi * rows / 900))
    friction = np.where(rows < 450, 1.0, -1.0) * np.tanh(np.minimum(rows, 900 - rows) / 20.0)
    runs = [
        Recording(
            {
                "time": 0.05 * rows,
                "pressure": 1e5 * bar + 1.5e3 * rng.standard_normal(900),
                "contraction": swept / 0.173 + 6e-5 * rng.standard_normal(900),
                "force": bar * (100.0 - 3e3 * swept - 5.6 * friction) + rng.standard_normal(900),
            },
            f"{bar} bar",
            {"resting_length": 0.173},
        )
        for bar in (2.0, 3.5, 5.0)
    ]
    stage = fit_friction_stage(classify_records(runs), CreepElements(), lambda _: None)
    chosen = preferred_fit(fit_jointly([fit_loop(loop) for loop in find_loops(runs)]))
    assert stage.selected.name == chosen.name
    assert stage.selected.rmse == pytest.approx(chosen.rmse, rel=0.05)
