"""A campaign finds one muscle in all files of a rig: each record is used for what it shows, what
the records do not show is named with the measurement that would show it, and predictions of unseen
records stay within the stated bands. The truth is computed by a muscle that differs in kind from
every law of the library (made_campaign.py).
"""

from __future__ import annotations

import dataclasses
import pickle

import numpy as np
import pytest
from made_campaign import THREE_LENGTHS, TrueMuscle, unseen_records, write_campaign, write_german

from airmuscle.bench import (
    Campaign,
    CreepStage,
    FillStage,
    FrictionStage,
    LeftOutStage,
    RecordKind,
    ReleaseStage,
    StaticStage,
    classify_records,
    identify_campaign,
    read,
    standard_candidates,
)
from airmuscle.bench.campaign import (
    VolumeChange,
    count_pulses,
    fit_creep_stage,
    fit_static_stage,
    relate_volumes,
)
from airmuscle.bench.campaign.campaign import _levels
from airmuscle.bench.prediction import creep_stretches, friction_along, held_steady
from airmuscle.bench.statics import PlannedRun
from airmuscle.errors import IdentificationError
from airmuscle.physics import BoucWen, Braid, CreepElements, NoFriction
from airmuscle.recording import Recording

RANDOM = np.random.default_rng(3)
MUSCLE = TrueMuscle(0.3)


def recording(columns, name, length=0.3, **constants):
    return Recording(columns, name, {"resting_length": length, **constants})


@pytest.fixture(scope="module")
def one_length(tmp_path_factory):
    folder = write_campaign(tmp_path_factory.mktemp("rig"), (0.3,))
    return identify_campaign(read(folder))


def shares_within_bands(campaign, lengths, seed=9):
    """By record: whether the measured force of each row with tension is within the band."""
    inside = {}
    for name, (columns, length) in unseen_records(lengths, seed).items():
        run = recording(columns, name, length)
        prediction = campaign.predict(run)
        taut = run["force"] > 0.0
        inside[name] = ((run["force"] >= prediction.low) & (run["force"] <= prediction.high))[taut]
    return inside


def test_each_record_is_sorted_by_its_kind():
    made = {
        "isobaric": MUSCLE.isobaric(3.0, RANDOM),
        "isometric": MUSCLE.isometric(0.05, RANDOM),
        "fill": MUSCLE.fill(0.08, RANDOM),
        "creep": MUSCLE.hold(3.0, 0.06, RANDOM),
        "release": MUSCLE.release(2.0, 30.0, RANDOM),
    }
    records = classify_records([recording(columns, name) for name, columns in made.items()])
    assert {record.origin: record.kind.value for record in records} == {name: name for name in made}


def test_a_fast_ramp_of_the_pressure_is_not_a_fill():
    """A triangle of 5 s changes by 23 kPa in 0.1 s, as a fill does, but at a constant rate."""
    (record,) = classify_records([recording(MUSCLE.isometric(0.05, RANDOM, duration=10.0), "ramp")])
    assert record.kind is RecordKind.ISOMETRIC


def test_a_fill_and_its_discharge_are_two_steps_with_their_instants():
    (record,) = classify_records([recording(MUSCLE.fill(0.08, RANDOM), "fill")])
    up, down = record.steps
    assert up.start == pytest.approx(0.2, abs=0.02)
    assert down.start == pytest.approx(2.5, abs=0.02)
    assert up.change == pytest.approx(6.2e5, rel=0.01)
    assert down.change == pytest.approx(-6.2e5, rel=0.01)


def staircase(*changes, hold=3.0, rows=400):
    """The pressure of a held muscle through (target [bar], end [bar]): each approach ends where its
    valve is closed.
    """
    pressures = []
    now = 0.0
    for target, end in changes:
        since = np.arange(rows) * hold / rows - 0.3
        change = target + (now - target) * np.exp(-np.maximum(since, 0.0) / 0.2)
        pressures.append(np.maximum(change, end) if end < now else np.minimum(change, end))
        now = float(pressures[-1][-1])
    pressure = 1e5 * np.concatenate(pressures) + RANDOM.normal(0.0, 300.0, rows * len(changes))
    return {
        "time": np.arange(pressure.size) * hold / rows,
        "pressure": pressure,
        "contraction": 0.05 + 0.0 * pressure,
    }


def test_a_partial_discharge_is_left_out_and_the_complete_steps_beside_it_are_used():
    columns = staircase((5.0, 5.0), (0.0, 3.0), (0.0, 0.0))
    *fills, rest = classify_records([recording(columns, "partial")])
    assert [record.kind for record in fills] == [RecordKind.FILL] * 2
    assert [record.steps[0].change for record in fills] == pytest.approx([5e5, -3e5], rel=0.02)
    assert rest.kind is RecordKind.UNUSED
    assert rest.reason.startswith(
        "1 of 3 pressure steps at a held length end between the lowest and the highest pressure,"
    )


def test_a_staircase_of_small_steps_without_force_says_what_it_is():
    columns = staircase(*((bar, bar) for bar in (1.0, 2.0, 3.0, 4.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.0)))
    records = classify_records([recording(columns, "stairs")])
    assert "8 of 10 pressure steps" in records[-1].reason
    assert not [record for record in records if "no measured force" in record.reason]
    with_force = {**columns, "force": 1e-3 * columns["pressure"]}
    assert [record.kind for record in classify_records([recording(with_force, "stairs")])] == [
        RecordKind.ISOMETRIC
    ]


def test_a_file_with_several_isobaric_runs_gives_one_record_for_each():
    parts = [MUSCLE.isobaric(bar, RANDOM) for bar in (2.0, 4.0, 6.0)]
    offset = 0.0
    for part in parts:
        part["time"] = part["time"] + offset
        offset = part["time"][-1] + 0.1
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    records = classify_records([recording(joined, "three")])
    assert [record.kind for record in records] == [RecordKind.ISOBARIC] * 3
    assert [round(record.level[1] / 1e5) for record in records] == [2, 4, 6]
    assert records[1].origin == "three, rows 701 to 1400"


def test_records_that_cannot_be_used_state_the_reason():
    columns = MUSCLE.isobaric(3.0, RANDOM)
    without_length = {name: values for name, values in columns.items() if name != "length"}
    without_pressure = {name: values for name, values in columns.items() if name != "pressure"}
    short, empty = ({name: values[:rows] for name, values in columns.items()} for rows in (5, 0))
    gap = recording(columns, "e")
    hold = recording(MUSCLE.hold(3.0, 0.05, RANDOM), "f")
    time = np.where(np.arange(len(hold)) == 0, np.nan, hold["time"])
    gap = gap.with_columns(
        contraction=np.where(np.arange(len(gap)) == 60, np.nan, gap["contraction"])
    )
    records = classify_records(
        [
            recording(without_length, "a"),
            recording(without_pressure, "b"),
            recording(short, "c"),
            recording(empty, "d"),
            gap,
            Recording({**hold.columns, "time": time}, "f", hold.constants),
        ]
    )
    assert all(record.kind is RecordKind.UNUSED for record in records)
    reasons = [record.reason for record in records]
    assert "contraction is not known" in reasons[0]
    assert reasons[1] == "no pressure column"
    assert "at least 8" in reasons[2]
    assert "0 rows" in reasons[3]
    assert reasons[4:] == [
        "values of the contraction are missing",
        "values of the time are missing",
    ]


def test_slow_runs_without_tension_give_no_static_law():
    runs = [recording(MUSCLE.isobaric(bar, RANDOM, rows=100), f"{bar} bar") for bar in (1.0, 3.0)]
    slack = [run.with_columns(force=np.zeros(len(run))) for run in runs]
    with pytest.raises(IdentificationError, match="the muscle is slack, or the load cell is not"):
        identify_campaign(slack)


def test_a_release_without_a_resting_length_is_not_used():
    columns = MUSCLE.release(2.0, 30.0, RANDOM)
    columns["contraction"] = 1.0 - columns.pop("length") / 0.3
    (record,) = classify_records([Recording(columns, "release")])
    assert record.kind not in (RecordKind.RELEASE, RecordKind.CREEP)


def test_no_usable_record_is_an_error_that_names_each_record():
    columns = MUSCLE.isobaric(3.0, RANDOM)
    short = {name: columns[name][:5] for name in ("time", "pressure")}
    with pytest.raises(
        IdentificationError, match=r"no record of the campaign can be used \(run: only the pressure"
    ):
        identify_campaign([recording(short, "run")])


def test_a_campaign_at_exactly_one_pressure_plans_no_further_static_runs():
    columns = MUSCLE.isometric(0.05, RANDOM)
    columns["contraction"] = 0.05 + 0.05 * np.sin(np.linspace(0.0, 6.0, 600))
    campaign = identify_campaign(
        [recording({**columns, "pressure": np.full(600, 3.5e4)}, "one pressure")]
    )
    assert isinstance(campaign.static, LeftOutStage)
    assert "the pressure is 35 kPa in every row" in campaign.static.reason
    assert not any(each.plan for each in campaign.next_experiments)


def test_two_specimens_of_one_length_are_refused():
    runs = [recording(MUSCLE.isobaric(3.0, RANDOM), name, specimen=name) for name in ("A", "B")]
    with pytest.raises(
        IdentificationError, match=r"records of 300 mm are of several specimens: A, B"
    ):
        identify_campaign(runs)


def test_two_muscles_in_one_folder_are_refused():
    strong = dataclasses.replace(MUSCLE, area=2.0 * MUSCLE.area)
    runs = [
        recording(MUSCLE.isobaric(3.0, RANDOM), "thin"),
        recording(strong.isobaric(3.0, RANDOM), "thick"),
    ]
    with pytest.raises(
        IdentificationError, match=r"thin and thick contradict each other: at 300 kPa"
    ):
        identify_campaign(runs)


def test_creep_of_maxwell_elements_is_found_again_with_its_standard_error():
    time = np.linspace(0.0, 100.0, 1500)
    path = 0.018 * np.clip((time - 2.0) / 0.4, 0.0, 1.0)
    stretch = creep_stretches(time, path, np.array([8.0]))[:, 0]
    rng = np.random.default_rng(1)
    force = 800.0 - 1500.0 * stretch + rng.normal(0.0, 1.0, time.size)
    columns = {
        "time": time,
        "pressure": np.full(time.size, 3e5),
        "length": 0.3 - path,
        "force": force,
    }
    without = {name: values for name, values in columns.items() if name != "force"}
    assert isinstance(
        fit_creep_stage(classify_records([recording(without, "no force")])), LeftOutStage
    )
    force[[700, -1]] = np.nan
    stage = fit_creep_stage(
        classify_records([recording(columns, "hold"), recording(without, "no force")])
    )
    assert isinstance(stage, CreepStage)
    assert [name for name, _ in stage.holds] == ["hold"]
    (stiffness,) = stage.elements.stiffnesses
    (relaxation,) = stage.elements.relaxation_times
    assert abs(stiffness - 1500.0) < 3.0 * stage.standard_errors[0]
    assert abs(relaxation - 8.0) < 3.0 * stage.standard_errors[1]
    assert stage.standard_errors[1] < 0.5


def test_a_force_that_rises_in_a_hold_is_no_creep_of_the_muscle():
    time = np.linspace(0.0, 100.0, 1500)
    path = 0.018 * np.clip((time - 2.0) / 0.4, 0.0, 1.0)
    force = 500.0 + 100.0 * creep_stretches(time, path, np.array([8.0]))[:, 0] / 0.018
    columns = {
        "time": time,
        "pressure": np.full(time.size, 3e5),
        "length": 0.3 - path,
        "force": force,
    }
    stage = fit_creep_stage(classify_records([recording(columns, "hold")]))
    assert isinstance(stage, LeftOutStage)
    assert "does not relax" in stage.reason


def test_the_stretch_of_a_maxwell_element_is_exact_for_a_constant_speed():
    time = np.linspace(0.0, 5.0, 21)
    tau = 1.5
    speed = 0.01
    stretch = creep_stretches(time, speed * time, np.array([tau]))[:, 0]
    np.testing.assert_allclose(stretch, speed * tau * (1.0 - np.exp(-time / tau)), rtol=1e-12)


def test_a_held_length_keeps_its_friction_through_the_noise_of_the_sensor():
    """Small cycles unload a Bouc-Wen model; the noise of a held length is none of them."""
    time = np.linspace(0.0, 60.0, 600)
    path = 0.018 * np.clip((time - 2.0) / 0.5, 0.0, 1.0)
    noise = np.random.default_rng(1).normal(0.0, 2e-5, time.size)
    columns = {"time": time, "pressure": np.full(time.size, 3e5), "length": 0.3 - path - noise}
    run = recording(columns | {"force": np.full(time.size, 500.0)}, "hold")
    force = friction_along(BoucWen(5e4, 30.0, 1.0, 20.0), run)
    np.testing.assert_allclose(force[time > 3.0], 30.0, atol=0.5)


def test_the_dead_band_of_the_noise_follows_a_motion_and_holds_a_rest():
    path = np.concatenate(
        [np.linspace(0.0, 1e-2, 100), np.full(50, 1e-2), np.linspace(1e-2, 0.0, 100)]
    )
    noisy = path + np.random.default_rng(2).normal(0.0, 2e-5, path.size)
    steady = held_steady(noisy, 2e-5)
    assert np.abs(steady - path).max() < 2.0 * 4.0 * 2e-5
    assert np.ptp(steady[110:149]) < 2e-5
    np.testing.assert_array_equal(held_steady(path, 0.0), path)


def test_fills_at_several_lengths_determine_volume_and_conductance():
    change = VolumeChange((7e-4, -5e-4), 0.3, 0.25)
    contractions = np.array([0.0, 0.08, 0.15])
    true_scale = 0.4
    at_rest = 9e-5
    relative = (at_rest + change(contractions)) / true_scale
    estimate = relate_volumes(relative, 1e-3 * relative, contractions, change)
    assert estimate.volume_at_rest == pytest.approx(at_rest, rel=1e-9)
    assert estimate.scale == pytest.approx(true_scale, rel=1e-9)


def test_fills_at_one_length_determine_only_the_ratio():
    change = VolumeChange((7e-4, -5e-4), 0.3, 0.25)
    assert relate_volumes(np.full(3, 2e-4), np.full(3, 1e-6), np.full(3, 0.05), change) is None


@pytest.mark.slow
def test_every_stage_of_the_made_campaign_is_identified(one_length):
    kinds = (CreepStage, FrictionStage, StaticStage, FillStage, ReleaseStage)
    assert [type(stage) for _, stage in one_length.stages] == list(kinds)
    assert one_length.hysteresis.selected is not None
    assert one_length.muscle() is not None


@pytest.mark.slow
def test_predictions_at_unseen_pressures_and_speeds_stay_within_the_bands(one_length):
    inside = np.concatenate(list(shares_within_bands(one_length, (0.3,)).values()))
    assert 0.93 <= inside.mean() <= 0.97


@pytest.mark.slow
@pytest.mark.parametrize(("bar", "contraction"), [(3.0, 0.06), (4.0, 0.10)])
def test_predictions_of_unseen_holds_stay_within_the_band(one_length, bar, contraction):
    """A fast motion, then two minutes at rest: friction and creep along the motion remain through
    the noise.
    """
    run = recording(MUSCLE.hold(bar, contraction, np.random.default_rng(91)), "hold")
    prediction = one_length.predict(run)
    inside = (run["force"] >= prediction.low) & (run["force"] <= prediction.high)
    assert 0.93 <= inside.mean() <= 0.98


@pytest.mark.slow
def test_the_band_of_an_isometric_run_contains_the_error_without_all_isometric_runs(one_length):
    """A held length has no friction, and residuals of one sign, which bands from sweeps of the
    length do not show.
    """
    stage = one_length.static
    run = recording(MUSCLE.isometric(0.06, np.random.default_rng(93)), "isometric")
    prediction = one_length.predict(run)
    taut = run["force"] > 0.0
    half = 0.5 * (prediction.high - prediction.low)
    assert stage.held_band.purpose == "further isometric runs"
    np.testing.assert_allclose(half, max(stage.held_band.half_width, stage.band.half_width))
    inside = np.abs(prediction.force - run["force"]) <= half
    assert 0.93 <= inside[taut].mean() <= 0.99
    moved = recording(MUSCLE.isobaric(3.0, np.random.default_rng(94)), "isobaric")
    assert stage.half_width(moved) == stage.band.half_width


@pytest.mark.slow
def test_predictions_of_inner_loops_stay_within_the_band(one_length):
    """Reversals within the stroke at 3 bar, which no record of the campaign has."""
    turns = np.array([0.0, 1.0, 0.4, 0.8, 0.2, 0.6, 0.0]) * 0.88 * MUSCLE.free_contraction(3e5)
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(turns)))]) * 0.3 / 3e-3
    time = np.linspace(0.0, travelled[-1], 900)
    path = np.interp(time, travelled, turns)
    run = recording(
        MUSCLE.measured(time, np.full(900, 3e5), path, np.random.default_rng(92)), "inner loops"
    )
    prediction = one_length.predict(run)
    taut = run["force"] > 0.0
    inside = (run["force"] >= prediction.low) & (run["force"] <= prediction.high)
    assert 0.93 <= inside[taut].mean() <= 0.97


@pytest.mark.slow
def test_the_friction_increases_with_the_pressure_as_the_truth_does(one_length):
    amplitudes = {
        round(run.pressure, -4): run.joint_amplitude
        for run in one_length.hysteresis.selected.agreement
    }
    for pressure, amplitude in amplitudes.items():
        assert amplitude == pytest.approx(6.0 + 5.0 * (pressure / 1e5) ** 0.93, rel=0.25)


@pytest.mark.slow
def test_the_volume_follows_from_the_fills_and_the_static_law(one_length):
    for contraction in (0.0, 0.08, 0.15):
        estimated = float(one_length.geometry().volume(contraction))
        assert estimated == pytest.approx(MUSCLE.volume(contraction), rel=0.15)


@pytest.mark.slow
def test_a_fill_is_predicted_by_the_others_within_one_per_cent_of_the_supply(one_length):
    assert max(one_length.fills.cross_rms) < 6.2e3


@pytest.fixture(scope="module")
def isobaric_records():
    """The campaign of three isobaric records, its progress, and its stages in the order in which
    they ended.
    """
    sweeps = {
        bar: MUSCLE.isobaric(bar, np.random.default_rng(3), rows=100) for bar in (1.0, 3.0, 5.0)
    }
    runs = [recording(columns, f"{bar} bar") for bar, columns in sweeps.items()]
    fractions = []
    ended = []
    campaign = identify_campaign(
        runs,
        progress=lambda _, fraction: fractions.append(fraction),
        finished=lambda name, _: ended.append(name),
    )
    return campaign, fractions, ended


def test_a_campaign_is_shown_by_print_and_in_a_notebook_also_after_it_was_sent(isobaric_records):
    campaign = pickle.loads(pickle.dumps(isobaric_records[0]))
    assert "3 of 3 records are used. Not identified: creep, fills and volume, release." in str(
        campaign
    )
    assert "<table" in campaign._repr_html_()
    assert len(repr(campaign)) < 1000


def test_stages_without_records_state_what_to_measure(isobaric_records):
    campaign, _, _ = isobaric_records
    left_out = {name for name, stage in campaign.stages if isinstance(stage, LeftOutStage)}
    assert left_out == {"creep", "fills and volume", "release"}
    measures = " ".join(each.measure for each in campaign.next_experiments)
    assert "Record a fill from ambient pressure" in measures
    assert "hold the length for two minutes" in measures
    assert campaign.muscle() is None


def test_progress_ends_at_one_and_each_stage_is_reported_when_it_ends(isobaric_records):
    _, fractions, ended = isobaric_records
    assert fractions == sorted(fractions)
    assert fractions[-1] == pytest.approx(1.0)
    assert ended == [
        "records",
        "creep",
        "hysteresis",
        "static characteristic",
        "fills and volume",
        "release",
        "plan",
    ]


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_predictions_at_unseen_pressures_lengths_and_speeds_stay_within_the_bands(tmp_path, seed):
    campaign = identify_campaign(read(write_campaign(tmp_path / "rig", THREE_LENGTHS, seed)))
    inside = shares_within_bands(campaign, THREE_LENGTHS, seed=seed + 50)
    for quantity in ("pressure", "speed", "length"):
        rows = np.concatenate(
            [values for name, values in inside.items() if name.startswith(quantity)]
        )
        assert 0.93 <= rows.mean() <= 0.97, quantity


def test_a_file_written_in_german_is_read_as_it_was_made(tmp_path):
    columns = MUSCLE.isobaric(2.0, RANDOM)
    write_german(tmp_path / "isobar.csv", columns, 0.3)
    (run,) = read(tmp_path / "isobar.csv")
    np.testing.assert_allclose(run["pressure"], columns["pressure"], atol=10.0)
    np.testing.assert_allclose(run["contraction"], (0.3 - columns["length"]) / 0.3, atol=1e-6)


@pytest.mark.parametrize("pulses", [0, 8, 15])
def test_the_pulses_of_a_valve_are_counted_in_a_ramp_that_approaches_its_end(pulses):
    """A ramp by pulses looks like a fill, but its valve is open for a moment only; the last pulses
    are too small.
    """
    time = np.linspace(0.0, 5.0, 1500)
    rise = 1.0 - np.exp(-time / 2.0)
    if pulses:
        held = np.floor(time / 5.0 * pulses) * 5.0 / pulses
        opened = held + np.minimum(8.0 * (time - held), 5.0 / pulses)
        rise = 1.0 - np.exp(-opened / 2.0)
    noisy = rise + 1e-3 * np.random.default_rng(1).standard_normal(1500)
    assert pulses / 2 <= count_pulses(time, noisy) <= pulses


def test_a_pulsed_ramp_at_a_held_length_is_an_isometric_run_and_no_fill():
    time = np.arange(0.0, 40.0, 0.05)
    held = np.floor(np.minimum(time, 40.0 - time) / 0.8) * 0.8
    pressure = 6e5 * (1.0 - np.exp(-held / 6.0)) + 200.0 * np.random.default_rng(2).standard_normal(
        time.size
    )
    columns = {
        "time": time,
        "pressure": pressure,
        "contraction": np.full(time.size, 0.05),
        "force": 2e-3 * pressure,
    }
    (record,) = classify_records([Recording(columns, "ramp", {"resting_length": 0.3})])
    assert record.kind is RecordKind.ISOMETRIC


def test_a_fill_without_a_length_is_named_with_what_it_needs():
    time = np.linspace(0.0, 3.0, 200)
    fill = Recording({"time": time, "pressure": 6e5 * (1.0 - np.exp(-time))}, "fill")
    (record,) = classify_records([fill])
    assert record.kind is RecordKind.UNUSED
    assert "as constants length and resting_length" in record.reason


def test_a_planned_run_is_described_by_its_levels():
    run = PlannedRun("pressure", np.full(5, 2.5e5), np.linspace(0.0, 0.2, 5), np.zeros(5))
    assert _levels(run) == "pressure 250 kPa, contraction 0 % to 20 %"


def test_the_specimen_that_does_not_follow_the_others_is_noted(monkeypatch):
    """Four muscles of one type; the third has 70 % of the force."""
    kept = "airmuscle.bench.comparison.model_selection.started_candidates"
    monkeypatch.setattr(kept, lambda runs: (standard_candidates(runs)[2:5], ()))
    random = np.random.default_rng(2)
    time = np.linspace(0.0, 60.0, 60)
    runs = []
    contraction = 0.06 - 0.05 * np.cos(2 * np.pi * time / 60.0)
    for name, length in zip("abcd", (0.1, 0.2, 0.28, 0.4), strict=True):
        for pressure in (1.5e5, 3e5, 4.5e5, 6e5):
            force = (
                pressure
                * 1.4e-3
                * (1 + 0.1 * np.log(length / 0.2))
                * (1 - contraction / 0.25) ** 1.5
            )
            force = force * (0.7 if name == "c" else 1.0) + random.standard_normal(60)
            pressures = pressure + 300 * random.standard_normal(60)
            columns = {
                "time": time,
                "pressure": pressures,
                "contraction": contraction,
                "force": force,
            }
            constants = {"resting_length": length, "specimen": name}
            runs.append(Recording(columns, f"{name}, {pressure:g} Pa", constants))
    stage = fit_static_stage(classify_records(runs), NoFriction(), CreepElements(), lambda _: None)
    assert isinstance(stage, StaticStage)
    odd = [note for note in stage.data_notes if "does not follow the others" in note]
    assert [note.split()[1] for note in odd] == ["c"]


def test_a_given_geometry_of_one_length_gives_none_of_another_without_a_static_law():
    missing = [LeftOutStage("", "", "")] * 5
    braid = Braid(0.01, 0.43, 0.3)
    campaign = Campaign((), *missing, (), given_geometry=braid)
    assert campaign.geometry(0.3) is braid
    assert campaign.muscle(0.2) is campaign.geometry(0.2) is None
