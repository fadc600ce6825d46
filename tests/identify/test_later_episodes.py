"""Later episodes judge an identified arm: its free run, skill and band are those of the definition,
episodes of another arm, sample time or scale are refused before any work, and single episodes that
do not fit are named with their cause. Episodes that are left out of a fit change nothing in it.
"""

from __future__ import annotations

import importlib
from dataclasses import replace

import numpy as np
import pytest
from arm_episodes import STEP, changed, known_arm, made_episodes
from command_line import airmuscle

import airmuscle as am
from airmuscle.bench import (
    IdentifiedArm,
    fit_joint,
    fit_known_joint,
    identified_arm,
    predict_episodes,
)
from airmuscle.errors import IdentificationError, ParameterError

LATER = made_episodes(24, seed=3)
BAND = np.radians(np.linspace(0.1, 1.0, 40))[:, None]


def known(joints=1, **other):
    """The arm that made the episodes, as a fit would state it."""
    muscles = 2 * joints
    columns = tuple(range(1, muscles + 1))
    pairs = tuple((j, j + 1) for j in range(1, muscles, 2))
    stated = {
        "gains": (1.0,) * muscles,
        "zeros": (0.0,) * muscles,
        "sample_time": STEP,
        "delay": 0,
        "angles": np.array([[-1.2, 1.2]] * joints),
        "pressures": np.array([[2e4, 3e5]] * muscles),
        "deviation": np.radians([0.1] * joints),
        "band": np.tile(BAND, (1, joints)),
        "judged": 30,
    }
    stated |= {"columns": columns, "pairs": pairs} | other
    return IdentifiedArm(arm=known_arm(joints), **stated)


@pytest.fixture(scope="module")
def prediction():
    return predict_episodes(known(), LATER)


def test_the_arm_that_made_the_episodes_predicts_them(prediction):
    """Its error is that of noise at the start: far below persistence, inside any band, at every
    horizon.
    """
    assert np.degrees(prediction.rms[0]) < 0.2
    assert prediction.skill[0] > 0.98
    assert prediction.coverage[0] > 0.99
    assert prediction.unfit == ()
    assert prediction.further.shape[1] == 80
    persisting = np.sqrt(np.mean(prediction.persisting**2, axis=0))
    further = np.sqrt(np.mean(prediction.further**2, axis=0))
    assert (further[20:] < 0.1 * persisting[20:]).all()


def test_every_row_after_the_first_of_a_window_is_predicted_once_from_the_rows_before(prediction):
    table = next(t for t in prediction.chapter().tables if t.name == "angles")
    run = LATER.runs[2]
    rows = [i for i, name in enumerate(table.columns["episode"]) if name == run.name]
    places = [table.columns["row"][i] for i in rows]
    assert places == list(range(11, 91))
    measured = [table.columns["joint 1 measured"][i] for i in rows]
    np.testing.assert_array_equal(measured, run.angle[places, 0])


def test_readings_with_another_gain_zero_and_order_are_those_of_the_arm(prediction):
    """p = gain (reading - zero), and the columns of the record in another order."""
    readings = changed(LATER, pressure=lambda p: p[:, ::-1] / [1.25, 0.8] + [4e3, -2e3])
    arm = known(columns=(2, 1), pairs=((2, 1),), gains=(0.8, 1.25), zeros=(-2e3, 4e3))
    np.testing.assert_allclose(
        predict_episodes(arm, readings).predicted, prediction.predicted, atol=1e-9
    )


REFUSED = {
    "another arm": (made_episodes(4, joints=2), "2 angles and 4 pressures, the arm 1 and 2"),
    "sample time": (replace(LATER, sample_time=0.02), "20 ms, those of the fit 10 ms"),
    "degrees as rad": (
        changed(LATER, angle=np.degrees, speed=np.degrees),
        "as degrees read as radians",
    ),
    "rad as degrees": (
        changed(LATER, angle=np.radians, speed=np.radians),
        "as radians read as degrees",
    ),
    "kPa as Pa": (changed(LATER, pressure=lambda p: p / 1e3), "as kPa read as Pa"),
    "bar as Pa": (changed(LATER, pressure=lambda p: p / 1e5), "as bar read as Pa"),
    "MPa as bar": (changed(LATER, pressure=lambda p: p / 10), "as MPa read as bar"),
    "Pa as kPa": (changed(LATER, pressure=lambda p: p * 1e3), "as Pa read as kPa"),
    "speeds": (changed(LATER, speed=lambda v: 0.5 * v), "as fast as the speeds say"),
    "exchanged": (changed(LATER, pressure=lambda p: p[:, ::-1]), "muscles are exchanged: the fit"),
    "an encoder that wraps": (
        changed(LATER, angle=lambda q: q + 2 * np.pi * (np.arange(len(q)) > 60)[:, None]),
        "jumps from",
    ),
    "short": (
        changed(LATER[:1], **dict.fromkeys(("angle", "speed", "pressure"), lambda x: x[:30])),
        "no episode is as long as a window",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_episodes_of_another_arm_are_refused_before_any_run(monkeypatch, case):
    module = importlib.import_module("airmuscle.bench.joint.arm_prediction")
    monkeypatch.setattr(module, "run_errors", lambda *_: pytest.fail("an arm was simulated"))
    episodes, message = REFUSED[case]
    with pytest.raises(IdentificationError, match=message):
        predict_episodes(known(), episodes)


def with_first(**columns):
    """The later episodes, the first of them changed."""
    first = changed(LATER[:1], **columns).runs[0]
    return replace(LATER, runs=(first, *LATER.runs[1:]))


UNFIT = {
    "pressure 2 stays at": {"pressure": lambda p: np.column_stack([p[:, 0], 0 * p[:, 0] + 1e5])},
    "pressure 1 reaches 500": {"pressure": lambda p: p + np.array([5e5 - p[:, 0].max(), 0.0])},
    "angle 1 reaches": {"angle": lambda q: q + 1.6},
    "rests where the model moves": {"angle": lambda q: 0 * q + q[0], "speed": lambda v: 0 * v},
    "moves against the prediction": {"angle": lambda q: 2 * q[0] - q, "speed": np.negative},
}


@pytest.mark.parametrize("cause", UNFIT)
def test_an_episode_that_does_not_fit_is_named_with_its_cause(cause):
    found = predict_episodes(known(), with_first(**UNFIT[cause]))
    assert [episode.name for episode in found.unfit] == ["episode 1"]
    assert cause in found.unfit[0].cause
    assert "1 of 24 episodes do not fit" in found.chapter().summary[0]


def test_a_joint_that_is_pushed_is_named():
    """Pressures that hold the joint at rest, and an angle that moves."""
    still = changed(LATER[:1], pressure=lambda p: np.full_like(p, 1.5e5), angle=lambda q: 0 * q)
    moved = changed(
        still,
        angle=lambda q: 0.4 * np.sin(0.2 * np.arange(len(q)))[:, None],
        speed=lambda v: 8.0 * np.cos(0.2 * np.arange(len(v)))[:, None],
        pressure=lambda p: p + 3e3 * np.sin(np.arange(len(p)))[:, None],
    )
    found = predict_episodes(known(), replace(LATER, runs=(*LATER.runs, *moved.runs)))
    assert "pushed from outside" in found.unfit[0].cause


def test_an_arm_that_has_changed_is_said_first_to_be_fitted_anew():
    weak = known()
    law = weak.arm.muscle[0].contractile
    muscle = replace(weak.arm.muscle[0], contractile=replace(law, area=(5.4e-4, *law.area[1:])))
    changed_arm = replace(weak, arm=replace(weak.arm, muscle=(muscle, weak.arm.muscle[1])))
    notes = predict_episodes(changed_arm, LATER).chapter().notes
    assert "the band of the fit does not hold" in notes[0]


def shortened(patch):
    """Few iterations, because the parameters of these fits do not matter."""
    module = importlib.import_module("airmuscle.bench.joint.fit")
    stages = tuple(replace(stage, iterations=2, batch=8) for stage in module.STAGES)
    patch.setattr(module, "STAGES", stages)


GARBAGE = {
    "noise": lambda x: np.random.default_rng(0).normal(size=x.shape),
    "degrees": lambda x: 1e3 * x,
    "nothing": lambda x: 0.0 * x,
    "exchanged": lambda x: x[:, ::-1],
}


WHOLE = made_episodes(12, delay=2)
FITS = {
    "arm": lambda episodes: fit_joint(episodes, left_out=0.25),
    "known joint": lambda episodes: fit_known_joint(
        known_arm(), episodes, ("lags", "zeros"), left_out=0.25
    ),
}


@pytest.fixture(scope="module")
def fits_of_the_whole():
    with pytest.MonkeyPatch.context() as patch:
        shortened(patch)
        yield {name: fit(WHOLE) for name, fit in FITS.items()}


@pytest.mark.parametrize("kind", GARBAGE)
@pytest.mark.parametrize("name", FITS)
def test_episodes_left_out_change_no_bit_of_a_fit(fits_of_the_whole, name, kind):
    """Delay, pairs, saturation, parameters, covariance, regulators come from the others alone."""
    garbage = GARBAGE[kind]
    spoiled = changed(WHOLE[9:], angle=garbage, speed=garbage, pressure=garbage, command=garbage)
    one = fits_of_the_whole[name]
    two = FITS[name](replace(WHOLE, runs=(*WHOLE.runs[:9], *spoiled.runs)))
    assert one.arm == two.arm
    assert (one.inspection.delay, one.pairs) == (two.inspection.delay, two.pairs)
    assert one.estimates == two.estimates
    assert one.regulators == two.regulators
    np.testing.assert_array_equal(one.covariance, two.covariance)
    assert not np.array_equal(one.errors, two.errors)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A folder with a record, a later one, and the arm that the command has identified."""
    folder = tmp_path_factory.mktemp("arm")
    episodes = made_episodes(16)
    for name, part in (("record", episodes[:12]), ("later", episodes[9:])):
        np.savez(
            folder / f"{name}.npz",
            start=np.cumsum([0, *map(len, part.runs)]),
            q=np.degrees(part.rows("angle")),
            p=part.rows("pressure") / 1e3,
            u=part.rows("command"),
        )
    (folder / "map.toml").write_text(
        'sample_time = "10 ms"\nstarts = "start"\n[angles]\ncolumns = ["q"]\nunit = "deg"\n'
        '[pressures]\ncolumns = ["p"]\nunit = "kPa"\n[commands]\ncolumns = ["u"]\n'
    )
    with pytest.MonkeyPatch.context() as patch:
        shortened(patch)
        done = airmuscle(
            "fit-joint",
            folder / "record.npz",
            "--mapping",
            folder / "map.toml",
            "--left-out",
            "0.25",
            "--out",
            folder / "arm",
            "--horizon",
            "30",
            "--json",
        )
    assert done.exit_code == 0, done.output
    return folder


def test_the_written_arm_predicts_as_the_fit_did(written):
    """Errors of the fit's own judgement, from the file alone, to the last digits."""
    arm = am.files.load_arm(written / "arm")
    read = am.bench.read_episodes(written / "record.npz", arm.mapping)
    errors = predict_episodes(arm, read[9:])
    np.testing.assert_allclose(errors.rms, arm.deviation, rtol=1e-12)
    assert errors.predicted.shape[1] == 30
    assert errors.commanded is not None


def test_the_command_judges_the_arm_by_later_episodes(written, tmp_path):
    later = written / "later.npz"
    for model in ("arm", "arm/scenario.toml", "arm/controlled.toml"):
        done = airmuscle("predict", written / model, later, "--out", tmp_path / "p", "--json")
        assert done.exit_code == 0, done.output
    said = airmuscle("predict", written / "arm", later, "--out", tmp_path / "p").output
    assert "Free run over 0.3 s on 7 later episodes" in said
    heading, *rows = (tmp_path / "p" / "data" / "angles.csv").read_text().splitlines()
    assert heading.startswith("episode,row,time [s],horizon [s],joint 1 measured [deg]")
    assert len(rows) == 7 * 2 * 30
    horizons = (tmp_path / "p" / "data" / "arm-every-horizon.csv").read_text().splitlines()
    assert len(horizons) == 81


WRONG_INPUTS = {
    "a muscle": (("arm/muscles/m0.toml",), "predict with the arm that it has written"),
    "a record of another form": (("arm",), "no column 'q'"),
    "an option of records": (
        ("arm", "--start-time", "1 s"),
        "is not for an arm, which takes --mapping and --horizon",
    ),
    "an option of reading": (
        ("arm", "--unit", "q=deg"),
        "is not for an arm, which takes --mapping and --horizon",
    ),
}


@pytest.mark.parametrize("case", WRONG_INPUTS)
def test_what_cannot_be_predicted_says_what_to_give(written, tmp_path, case):
    (model, *options), message = WRONG_INPUTS[case]
    later = written / "later.npz"
    if case == "a record of another form":
        later = tmp_path / "other.npz"
        np.savez(later, start=[0], angle=np.zeros((99, 1)), p=np.zeros((99, 2)))
    said = airmuscle("predict", written / model, later, *options, "--out", tmp_path / "p")
    assert said.exit_code != 0
    assert message in " ".join(said.output.split())


def test_a_scenario_without_its_record_says_how_to_get_one(written, tmp_path):
    text = (written / "arm" / "scenario.toml").read_text()
    path = tmp_path / "old.toml"
    path.write_text(text[: text.index("[episodes]")])
    with pytest.raises(ParameterError, match=r"\[episodes\] is missing.*airmuscle fit-joint"):
        am.files.load_arm(path)


def test_a_table_that_does_not_belong_to_the_plant_is_refused(written, tmp_path):
    text = (written / "arm" / "scenario.toml").read_text()
    path = tmp_path / "wrong.toml"
    for old, new, message in (
        ("columns = [1, 2]", "columns = [1, 1]", "each must name the pressures 1 to 2 once"),
        ("zeros = [0.0, 0.0]", "zeros = [0.0]", "zeros has 1 entries; 2 are needed"),
        ("delay = 0", "delai = 0", "unknown key 'delai'"),
    ):
        assert old in text
        path.write_text(text.replace(old, new))
        with pytest.raises(ParameterError, match=message):
            am.files.load_arm(path)


def test_the_arm_of_a_fit_needs_no_file(fits_of_the_whole):
    for fit in fits_of_the_whole.values():
        found = predict_episodes(identified_arm(fit), WHOLE[9:])
        np.testing.assert_allclose(found.rms, fit.rms, rtol=1e-9)
