"""`airmuscle campaign FOLDER`: one command writes the muscle with its uncertainty, the report and a
scenario of each record; files that cannot be read are named and left out, folders that contradict
themselves are refused.
"""

from __future__ import annotations

import json
import resource
import shutil
import subprocess
import sys

import numpy as np
import pytest
from command_line import airmuscle
from made_campaign import THREE_LENGTHS, TrueMuscle, unseen_records, write_campaign, write_german

from airmuscle.bench import read
from airmuscle.errors import ParameterError
from airmuscle.files import load, load_scenario
from airmuscle.files.library import ParameterUncertainty

pytestmark = pytest.mark.slow  # the whole campaign takes a minute


def run(*words):
    return airmuscle("campaign", *map(str, words))


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """The command on a folder with a file that cannot be read, and a record kept aside."""
    folder = tmp_path_factory.mktemp("campaign")
    rig = write_campaign(folder / "rig")
    (rig / "notes.csv").write_text("no numbers here\n", encoding="utf-8")
    columns, length = unseen_records((0.3,))["pressure 2.5 bar"]
    write_german(rig / "later.csv", columns, length)
    out = folder / "out"
    done = run(rig, "--validate", rig / "later.csv", "--out", out, "--json")
    assert done.exit_code == 0, done.stderr
    return rig, out, json.loads(done.stdout)["campaign"]


def test_two_processes_find_what_one_does(result, tmp_path):
    rig, _, alone = result
    done = run(
        rig, "--validate", rig / "later.csv", "--out", tmp_path / "out", "--json", "--workers", "2"
    )
    assert done.exit_code == 0, done.stderr
    assert json.loads(done.stdout)["campaign"] == alone


def test_a_file_that_cannot_be_read_is_named_and_left_out(result):
    _, out, data = result
    assert [file["file"] for file in data["unread"]] == ["notes.csv"]
    assert "notes.csv" in (out / "report.html").read_text(encoding="utf-8")


def test_the_muscle_file_has_the_standard_errors_and_correlations_of_its_parameters(result):
    _, out, _ = result
    entry = load(out / "muscle.toml")
    assert entry.muscle.friction is not None
    uncertainty = entry.uncertainty
    assert uncertainty.covariance.shape == (len(uncertainty.parameters),) * 2
    assert any(name.startswith("characteristic.") for name in uncertainty.parameters)
    assert "damper.damping" in uncertainty.parameters
    assert (np.linalg.eigvalsh(np.array(uncertainty.correlations)) > -1e-6).all()


@pytest.mark.parametrize(
    ("record", "limit"),
    [
        ("m300_isobar_3bar", 15.0),
        ("m300_isometrisch_10", 15.0),
        ("m300_fuellen_8", 40.0),
        ("m300_freigabe", 40.0),
    ],
)
def test_each_scenario_reproduces_its_record(result, record, limit):
    """The rms error of the simulated force [N] on a muscle of up to 1600 N."""
    rig, out, _ = result
    path = out / "scenarios" / f"{record}.toml"
    start = float(
        path.read_text(encoding="utf-8")
        .splitlines()[0]
        .partition("time 0 is at ")[2]
        .partition(" s")[0]
    )
    simulated = load_scenario(path).simulate()
    (measured,) = read(rig / f"{record}.csv")
    time = measured["time"] - start
    rows = (time >= 0.0) & (time <= simulated["time"][-1]) & (measured["force"] > 0.0)
    force = np.interp(time[rows], simulated["time"], simulated["force"])
    assert np.sqrt(np.mean((force - measured["force"][rows]) ** 2)) < limit


def test_a_record_that_is_kept_aside_is_predicted_and_not_fitted(result):
    _, _, data = result
    (row,) = data["validation"]
    assert row["record"] == "later.csv"
    assert "later.csv" not in [record["record"] for record in data["records"]]
    assert 0.9 <= row["rows_within_the_band"] <= 1.0


def test_finished_stages_are_kept_in_the_folder(result):
    _, out, _ = result
    stages = json.loads((out / "stages.json").read_text(encoding="utf-8"))
    assert [stage["stage"] for stage in stages][:3] == ["records", "creep", "hysteresis"]


def test_an_interruption_keeps_the_finished_stages(tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("airmuscle.bench.campaign.campaign.fit_static_stage", interrupted)
    rig = write_campaign(tmp_path / "rig")
    for path in rig.glob("*isobar_[3456]*"):
        path.unlink()
    done = run(rig, "--out", tmp_path / "out")
    assert done.exit_code == 130
    stages = json.loads((tmp_path / "out" / "stages.json").read_text(encoding="utf-8"))
    assert [stage["stage"] for stage in stages] == ["records", "creep", "hysteresis"]
    assert stages[1]["creep"]["creep_elements"][0]["stiffness"] > 0.0


def test_an_empty_folder_is_refused(tmp_path):
    done = run(tmp_path, "--out", tmp_path / "out")
    assert done.exit_code == 1
    assert "contains no supported file" in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_folder_without_a_readable_file_is_refused_with_each_reason(tmp_path):
    (tmp_path / "a.csv").write_text("nothing\n", encoding="utf-8")
    done = run(tmp_path, "--out", tmp_path / "out")
    assert done.exit_code == 1
    assert "no file of the campaign could be read (1 text).\n1 file: a.csv" in done.stderr


def test_contradictory_units_are_refused(tmp_path):
    rng = np.random.default_rng(1)
    muscle = TrueMuscle(0.3)
    for bar in (1.0, 3.0, 5.0):
        write_german(tmp_path / f"{bar:g}.csv", muscle.isobaric(bar, rng), 0.3)
    text = (tmp_path / "5.csv").read_text(encoding="utf-8").replace("Kraft [N]", "Kraft [kN]")
    (tmp_path / "5.csv").write_text(text, encoding="utf-8")
    done = run(tmp_path, "--out", tmp_path / "out")
    assert done.exit_code == 1
    assert "kN" in done.stderr


def test_files_of_two_muscles_are_refused(tmp_path):
    rng = np.random.default_rng(1)
    write_german(tmp_path / "thin.csv", TrueMuscle(0.3).isobaric(3.0, rng), 0.3)
    write_german(tmp_path / "thick.csv", TrueMuscle(0.3, area=5e-3).isobaric(3.0, rng), 0.3)
    done = run(tmp_path, "--out", tmp_path / "out")
    assert done.exit_code == 1
    assert "contradict each other" in done.stderr


@pytest.mark.parametrize(
    ("errors", "matrix", "message"),
    [
        ((1.0,), ((1.0, 0.0), (0.0, 1.0)), "one standard error and one row of 2 values each"),
        ((1.0, -1.0), ((1.0, 0.0), (0.0, 1.0)), "not negative"),
        ((1.0, 1.0), ((1.0, 0.5), (0.0, 1.0)), "symmetric"),
        ((1.0, 1.0), ((1.0, 2.0), (2.0, 1.0)), "allowed range of a correlation: -1 to 1"),
    ],
)
def test_an_uncertainty_that_is_none_is_refused(errors, matrix, message):
    with pytest.raises(ParameterError, match=message):
        ParameterUncertainty(("a", "b"), errors, matrix)


def test_a_muscle_file_with_a_broken_uncertainty_names_the_table(result, tmp_path):
    _, out, _ = result
    text = (out / "muscle.toml").read_text(encoding="utf-8")
    (tmp_path / "muscle.toml").write_text(
        text.replace("standard_errors = [", "standard_errors = [1.0, "), "utf-8"
    )
    with pytest.raises(ParameterError, match=r"\[uncertainty\].*one standard error"):
        load(tmp_path / "muscle.toml")


@pytest.mark.slow
def test_the_campaign_of_three_lengths_takes_less_than_a_minute(tmp_path):
    """Computing time of the process, which does not depend on other programs of the machine."""
    rig = write_campaign(tmp_path / "rig", THREE_LENGTHS)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [
        sys.executable,
        "-m",
        "airmuscle",
        "campaign",
        str(rig),
        "--out",
        str(tmp_path / "out"),
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert done.returncode == 0, done.stderr
    assert (after.ru_utime + after.ru_stime) - (before.ru_utime + before.ru_stime) < 60.0
    assert (tmp_path / "out" / "muscle-200mm.toml").exists()
    shutil.rmtree(tmp_path / "out")
