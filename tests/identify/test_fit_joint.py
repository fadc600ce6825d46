"""An arm identified from episodes that the program made: its free run, its bands and its remarks
are true.

The reduced arm has not the form of the plant that made the record: gravity enters as a polynomial
of the angle.
"""

from __future__ import annotations

import importlib
import time
from dataclasses import replace

import numpy as np
import pytest
from arm_episodes import changed, made_episodes
from command_line import airmuscle
from widths import widened

import airmuscle as am
from airmuscle.bench import RegulatorLag, estimate_angles, fit_joint, fit_regulator_lags
from airmuscle.errors import ParameterError

processes = importlib.import_module("airmuscle.engine.processes")
module = importlib.import_module("airmuscle.bench.joint.fit")
EPISODES = made_episodes(30)
WITHOUT_COMMANDS = changed(EPISODES, command=lambda u: None)


@pytest.fixture(scope="module", autouse=True)
def short_search():
    """Few iterations, because the episodes are few and made."""
    with pytest.MonkeyPatch.context() as patch:
        *trials, search = (replace(each, iterations=15, batch=60) for each in module.STAGES)
        patch.setattr(module, "STAGES", (*trials, replace(search, iterations=35, batch=80)))
        yield


@pytest.fixture(scope="module")
def fitted(short_search):
    lines = []
    return fit_joint(EPISODES, left_out=0.2, progress=lines.append), lines


def test_the_free_run_is_far_better_than_persistence_and_arx(fitted):
    fit, lines = fitted
    assert np.degrees(fit.rms[0]) < 0.6
    assert fit.skill[0] > 0.8
    assert fit.best_baseline == ("ARX of depth 4",)
    assert lines[0].startswith("delay of the pressures: ")


class Search:
    """A search whose stages end with given costs; None is an interruption, infinity a stage that
    runs until it is stopped.
    """

    def __init__(self, *costs):
        self.costs = list(costs)
        self.stopped = False

    def search(self, stages):
        return module.DescentEnd([self._cost() for _ in stages][-1], self)

    def _cost(self):
        cost = self.costs.pop(0)
        if cost is None:
            raise KeyboardInterrupt
        while cost == np.inf:
            try:
                processes.check_running()
            except KeyboardInterrupt:
                self.stopped = True
                raise
            time.sleep(0.01)
        return cost


def test_the_search_that_ends_lower_is_taken_whatever_its_first_stages_say():
    ahead = Search(1.0, 1.0, 3.0)
    later = Search(2.0, 2.0, 1.0)
    assert module._best([ahead, later], None) == (1.0, later)
    broken = Search(1.0, None)
    other = Search(np.inf)
    with pytest.raises(KeyboardInterrupt), processes.thread_pool(2) as threads:
        module._best([other, broken], threads)
    assert other.stopped


def test_the_last_joint_is_judged_in_the_free_run_of_all(monkeypatch):
    """An error of the other joints counts as soon as all are identified: their measured motion does
    not show it.
    """
    used = []
    monkeypatch.setattr(
        module, "JointProblem", lambda arm, *_, errors: used.append(errors) or Search(1.0, 1.0, 1.0)
    )
    windows = module.cut(made_episodes(2, joints=2), 0, 40)
    arm = module.reduced_arm(np.zeros(2))
    monkeypatch.setattr(module, "_best", lambda searches, executor: (1.0, arm))
    module._search(made_episodes(2, joints=2), windows, (), 0, lambda text: None, None)
    assert used == [module.joint_errors] * 2 + [module.free_errors] * 2
    alone = module.joint_errors(arm, 1, windows)
    np.testing.assert_allclose(
        module.free_errors(arm, 1, windows), alone, atol=1e-9
    )  # the joints are not coupled


def test_the_band_grows_with_the_horizon_and_holds_what_it_says(fitted):
    fit, _ = fitted
    assert (np.diff(fit.band[:, 0]) >= 0.0).all()
    inside = np.abs(fit.errors) <= fit.band
    assert inside.mean() >= 0.95
    assert fit.coverage[0] > 0.85


@pytest.mark.parametrize("unit", widened([75.0, 3e5], lambda unit: unit == 3e5))
def test_counts_and_shares_of_a_range_are_fitted_as_they_are(short_search, unit):
    """Pressures in counts of 4095, or from 0 to 1, without their scale: the gain is absorbed (2.6
    and 14 degrees before)."""
    fit = fit_joint(changed(WITHOUT_COMMANDS, pressure=lambda p: p / unit), left_out=0.2)
    assert np.degrees(fit.rms[0]) < 0.6
    assert any("pressures look like a scale and not like Pa" in remark for remark in fit.remarks)


def test_rows_after_a_saturated_reading_do_not_count(short_search):
    """A sensor that ends at 2.6 bar: the arm is found nearly as well as from whole readings (1.07
    degrees before).
    """
    fit = fit_joint(
        changed(WITHOUT_COMMANDS, pressure=lambda p: np.minimum(p, 2.6e5)), left_out=0.2
    )
    module = importlib.import_module("airmuscle.bench.joint.fit")
    whole = module.cut(made_episodes(20, seed=5), 0, 40)
    errors = module.run_errors(fit.arm, whole)
    assert np.degrees(np.sqrt(np.mean(errors**2))) < 0.4
    assert any(
        "1144 of 1920 rows of the fit follow a pressure reading at its upper end" in r
        for r in fit.remarks
    )


def test_a_model_that_a_baseline_beats_and_a_band_of_one_episode_are_named(fitted):
    fit, _ = fitted
    assert "joint 1: ARX of depth 4 predicts better than the model" in str(
        replace(fit, errors=40.0 * fit.errors)
    )
    assert "predicts better" not in str(fit)
    assert np.isnan(replace(fit, episode=np.zeros_like(fit.episode)).coverage).all()


def test_the_remarks_name_the_scale_of_the_torques(fitted):
    fit, _ = fitted
    assert any("do not contain the scale of the torques" in remark for remark in fit.remarks)
    assert any("the record does not separate" in remark for remark in fit.remarks)


def test_the_gain_of_a_muscle_is_that_of_the_plant_that_made_the_record(fitted):
    """Torque per pressure over inertia: radius x area / inertia, within the inertia of 0.08 + 0.6
    (0.05^2 + 0.1^2).
    """
    fit, _ = fitted
    found = fit.arm.muscle[0].contractile.area[0] * 0.03 / 0.1
    assert found == pytest.approx(6e-4 * 0.03 / (0.08 + 0.6 * (0.05**2 + 0.1**2)), rel=0.15)


def test_the_identified_arm_is_a_plant_that_settles(fitted):
    fit, _ = fitted
    plant = fit.plant()
    held = am.Schedule(
        {f"{m.name}.setpoint": ((0.0, p),) for m, p in zip(plant.muscles, (2e5, 1e5), strict=True)}
    )
    solved = am.simulate(plant, held, duration=1.5, initial_state=plant.state_at(pressure=1.5e5))
    assert 0.1 < solved["joint1.angle"][-1] < 1.2
    assert abs(solved["joint1.angular_speed"][-1]) < 0.05


def test_the_identified_joint_is_an_environment_whose_plants_are_drawn_from_its_covariance(fitted):
    pytest.importorskip("gymnasium")
    fit, _ = fitted
    drawn = (am.environments.FitUncertainty(fit.uncertainty()),)
    env = am.environments.PlantEnv(am.environments.JointTracking(fit.plant()), randomisation=drawn)
    first, second = (env.reset(seed=seed)[0] for seed in (1, 2))
    assert np.abs(first - second).max() > 0.0
    observed, reward, *_ = env.step(env.action_space.sample())
    assert np.isfinite(observed).all()
    assert 0.0 <= reward <= 1.0
    with pytest.raises(
        ParameterError, match="JointTracking: the coordinates of the plant are none; one is needed"
    ):
        am.environments.JointTracking(am.load("vessel-smc-itv2050").plant)


def test_angles_from_pressures_alone_hold_their_band_and_need_motion(fitted):
    fit, _ = fitted
    found = estimate_angles(fit, made_episodes(60, seed=1))
    assert found.rms[0] < 0.1 * found.range[0]
    assert 0.9 < found.coverage[0] < 0.99
    # the joint moves in most rows, so that the pose in which an episode begins is forgotten
    assert found.spread[:, -1].mean() < 0.5 * found.spread[:, 0].mean()
    assert "joint 1: " in str(found)
    assert "the angle is not seen until the joint moves" in str(found)


def test_what_the_free_runs_lack_is_corrected_from_fitted_episodes(fitted):
    """An arm with one muscle too strong; with nine fitted episodes nothing is corrected, because
    ten are needed.
    """
    fit, _ = fitted
    law = fit.arm.muscle[0].contractile
    strong = replace(
        fit.arm.muscle[0], contractile=replace(law, area=tuple(1.4 * a for a in law.area))
    )
    wrong = replace(fit, arm=replace(fit.arm, muscle=(strong, fit.arm.muscle[1])))
    further = made_episodes(30, seed=2)
    plain, corrected = (
        estimate_angles(replace(wrong, fitted=n), further).rms[0] for n in (9, fit.fitted)
    )
    assert corrected < 0.7 * plain


def test_a_joint_that_does_not_move_is_not_seen(fitted):
    fit, _ = fitted
    at_rest = changed(EPISODES[24:26], pressure=lambda p: np.full_like(p, 1.5e5))
    assert (
        estimate_angles(fit, at_rest, any_pose=True).unseen[0]
        > estimate_angles(fit, EPISODES[24:26]).unseen[0]
    )
    with pytest.raises(
        ParameterError, match="the episodes have 2 joints and 4 pressures, the fit 1 and 2"
    ):
        estimate_angles(fit, made_episodes(1, joints=2))


@pytest.mark.parametrize(
    ("increments", "pascals", "step"),
    widened(
        [(True, 3e5, 2e-4), (False, 1.0, 1.0), (True, 75.0, 1e-3)],
        lambda _, pascals, step: pascals != 75.0,
    ),
)
def test_a_regulator_is_found_from_commands_and_pressures(increments, pascals, step):
    """Pressures of a known regulator: limited level, two lags, two rows of delay; the prediction
    sees commands alone.

    Readings in counts or shares of a range, and commands in counts, are as good (35 and 3.7 kPa
    before).
    """
    rng = np.random.default_rng(0)
    truth = RegulatorLag((2e-1, 0.7, 0.4, 0.0, 0.0, 0.0, 3.0, 0.5), 2, increments)
    runs = []
    for run in made_episodes(12).runs:
        command = (
            rng.normal(size=run.pressure.shape)
            if increments
            else rng.uniform(-3.0, 10.0, run.pressure.shape)
        )
        pressure = np.full_like(command, 1e5)
        settled = np.concatenate([np.zeros((10, 2)), command])
        for i in range(2):
            whole = np.full((1, len(settled)), 1e5)
            pressure[:, i] = truth.pressures(whole, settled[None, :, i])[0, 10:]
        runs.append(replace(run, pressure=pressure / pascals, command=np.round(command / step, 3)))
    episodes = replace(EPISODES, runs=tuple(runs))
    found, _ = fit_regulator_lags(episodes, 40)
    assert (found.increments, found.delay) == (increments, 2)
    assert found.values[0] * pascals / step == pytest.approx(0.2, rel=0.1)
    pressure, command = (
        np.array([getattr(run, name)[:, 0] for run in runs]) for name in ("pressure", "command")
    )
    assert pascals * np.sqrt(np.mean((found.pressures(pressure, command) - pressure) ** 2)) < 1e3


def test_commands_that_act_late_are_found_and_those_that_explain_nothing_are_named(fitted):
    """Pressures follow 7 rows after the commands; of constant commands nothing follows."""
    runs = [
        replace(run, command=np.concatenate([run.pressure[7:], run.pressure[-7:]]))
        for run in EPISODES.runs[:12]
    ]
    assert [
        found.delay for found in fit_regulator_lags(replace(EPISODES, runs=tuple(runs)), 40)
    ] == [7, 7]
    still = fit_joint(changed(EPISODES[:8], command=lambda u: 0.0 * u), left_out=0.5, rows=12)
    assert any(
        "the commands hardly explain the pressures of muscle 1, 2: they never" in r
        for r in still.remarks
    )
    assert not any("hardly explain" in remark for remark in fitted[0].remarks)


def test_commands_predict_the_angle_where_they_are_the_pressures(fitted):
    fit, _ = fitted
    assert np.degrees(np.sqrt(np.mean(fit.commanded**2))) < 2 * np.degrees(fit.rms[0])
    assert "model, from commands" in str(fit)


def test_impossible_arguments_are_refused():
    with pytest.raises(
        ParameterError,
        match="episodes: 30, of which a share of 1 is left out; give 4 episodes or more",
    ):
        fit_joint(EPISODES, left_out=1.0)
    with pytest.raises(
        ParameterError, match="2 pairs and 0 axes are given for 1 joints; give one each"
    ):
        fit_joint(EPISODES, pairs=((1, 2), (3, 4)))
    with pytest.raises(ParameterError, match="there are pressures 1 to 2, each in one pair"):
        fit_joint(EPISODES, pairs=((1, 7),))


def test_the_command_inspects_and_fits(tmp_path):
    few = EPISODES[:12]
    np.savez(
        tmp_path / "all.npz",
        start=np.cumsum([0, *map(len, few.runs)]),
        q=few.rows("angle"),
        v=few.rows("speed"),
        p=few.rows("pressure"),
    )
    (tmp_path / "arm.toml").write_text(
        'sample_time = "10 ms"\nstarts = "start"\n[angles]\ncolumns = ["q"]\n[speeds]\ncolumns ='
        ' ["v"]\n[pressures]\ncolumns = ["p"]\n[arm]\npairs = [[1, 2]]\n'
    )
    names = [str(tmp_path / "all.npz"), "--mapping", str(tmp_path / "arm.toml")]
    shown = airmuscle("fit-joint", *names, "--inspect").output
    assert "12 episodes of 95 rows at 100 Hz" in shown
    shown = airmuscle(
        "fit-joint", *names, "--out", tmp_path / "out", "--left-out", "0.25", "--horizon", "12"
    ).output
    shown = " ".join(shown.split())
    assert "free run over 0.12 s on 3 episodes left out" in shown
    assert "the band comes from 3 episodes left out: it is no 95 % band" in shown
    assert "those of a further episode with 75 %, n/(n + 1), and 19 episodes are needed" in shown
    assert (tmp_path / "out" / "report.html").exists()
    plant = am.files.load_scenario(tmp_path / "out" / "scenario.toml")
    assert len(plant.plant.muscles) == 2
    varied = am.environments.FitUncertainty(plant.uncertainty).variations(plant.plant, 50)
    assert "circuit[1].lag.frequency" in varied
    assert 0.0 < varied["mechanism.inner.links[0].damping"].std() < 0.5
    controlled = tmp_path / "out" / "controlled.toml"
    for arguments in (
        ("simulate", tmp_path / "out" / "scenario.toml", "--out", tmp_path / "run"),
        ("simulate", controlled, "--out", tmp_path / "loop"),
        (
            "evaluate",
            tmp_path / "out" / "muscles" / "m1.toml",
            "--pressure",
            "2 bar",
            "--contraction",
            "1 %",
        ),
        ("tune", controlled, "--simulations", "80", "--out", tmp_path / "tuning"),
        ("export", controlled, "--to", "c", "--out", tmp_path / "c"),
        ("export", controlled, "--controller", "--to", "c", "--out", tmp_path / "controller"),
    ):
        done = airmuscle(*map(str, arguments))
        assert done.exit_code == 0, done.output
