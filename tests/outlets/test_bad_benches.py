"""Defective recordings on the command line: each is rejected with one line, or used as far as
possible.

Contradictory units, a run of another kind than stated, a saturated sensor, a record shorter than
the dynamics, times that repeat, decrease or have gaps, a mapping with an unknown column.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench import UNCENSORED, ColumnMapping, fit, read, write
from airmuscle.files import load
from airmuscle.physics import Braid, ContractileSurface, TonduLopez2000
from airmuscle.recording import Recording

MUSCLE = TonduLopez2000(Braid(0.01, 0.45, 0.3), 1.2)
SURFACE = ("--characteristic", "ContractileSurface", "--degree", "3", "--resting-length", "300 mm")
COMMANDS = [("fit", *SURFACE), ("hysteresis", "--resting-length", "300 mm"), ("inspect",)]


def ramp(
    path: Path, pressure: float, *, ceiling: float = np.inf, seed: int = 1, count: int = 400
) -> Path:
    """An isobaric ramp of contraction up and down, its force saturated at a ceiling."""
    rng = np.random.default_rng(seed)
    contraction = np.concatenate(
        [np.linspace(0.0, 0.2, count // 2), np.linspace(0.2, 0.0, count // 2)]
    )
    force = MUSCLE.force(pressure, contraction) + 0.8 * rng.standard_normal(count)
    columns = {
        "time": 0.1 * np.arange(count),
        "pressure": np.full(count, pressure) + 20.0 * rng.standard_normal(count),
        "contraction": contraction,
        "force": np.minimum(0.5 * np.round(force / 0.5), ceiling),
    }
    write(Recording(columns, path.name), path)
    return path


def refused(folder: Path, *arguments) -> str:
    """The one line of a command that fails and writes nothing."""
    result = airmuscle(*arguments, "--out", folder / "out")
    assert result.exit_code == 1, result.stdout
    (line,) = [text for text in result.stderr.splitlines() if not text.startswith("warning: ")]
    assert not (folder / "out").exists()
    return line


# Units


@pytest.mark.parametrize("command", COMMANDS, ids=lambda words: words[0])
def test_two_files_that_contradict_each_others_units(tmp_path, command):
    for unit in ("bar", "kPa"):  # the same numbers under both
        ramp(tmp_path / "run.csv", 3e5)
        (recording,) = read(tmp_path / "run.csv")
        rows = zip(
            *(recording[n] for n in ("time", "pressure", "contraction", "force")), strict=True
        )
        lines = [f"{t:.2f},{p / 1e5:.5f},{c:.5f},{f:.1f}" for t, p, c, f in rows]
        head = f"time [s],pressure [{unit}],contraction [1],force [N]"
        (tmp_path / f"{unit}.csv").write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
    line = refused(tmp_path, *command, tmp_path / "bar.csv", tmp_path / "kPa.csv")
    assert "one of the two units is wrong" in line
    assert all(name in line for name in ("bar.csv", "kPa.csv"))
    assert "--unit 'pressure=...'" in line


# A run of another kind than stated


def test_constant_pressure_stated_to_be_an_isometric_sweep(tmp_path):
    file = ramp(tmp_path / "run.csv", 3e5)
    (tmp_path / "rig.toml").write_text('run = "isometric"\n', encoding="utf-8")
    for command in COMMANDS[:2]:
        line = refused(tmp_path, *command, file, "--mapping", tmp_path / "rig.toml")
        assert (
            "run.csv: the run is stated to be isometric, but the data are isobaric (pressure 300 to"
            " 300 kPa)" in line
        )
    seen = airmuscle("inspect", file, "--mapping", tmp_path / "rig.toml")
    assert "PROBLEM: the run is stated to be isometric" in seen.stdout


def at_rest(path: Path, pressure: float, contraction: float, seed: int) -> Path:
    rng = np.random.default_rng(seed)
    force = float(MUSCLE.force(pressure, contraction)) + 0.05 * rng.standard_normal(50)
    columns = {
        "time": 0.1 * np.arange(50),
        "pressure": np.full(50, pressure),
        "contraction": np.full(50, contraction),
    }
    write(Recording({**columns, "force": force}, path.name), path)
    return path


def test_a_run_without_variation_is_rejected_alone_and_a_point_among_others(tmp_path):
    lone = at_rest(tmp_path / "rest.csv", 3e5, 0.1, 1)
    for command in COMMANDS[:2]:
        reason = "the pressure is 300 kPa and the contraction 10 % in every row"
        assert f"rest.csv: {reason}" in refused(tmp_path, *command, lone)
    points = [(p, c) for p in (1e5, 3e5, 5e5) for c in (0.0, 0.08, 0.16)]
    files = [at_rest(tmp_path / f"point{i}.csv", p, c, i) for i, (p, c) in enumerate(points)]
    result = airmuscle(
        "fit",
        *files,
        "--characteristic",
        "TonduLopez2000",
        "--resting-length",
        "300 mm",
        "--fix",
        "end_correction",
        "--out",
        tmp_path / "out",
    )
    assert result.exit_code == 0, result.stderr


def test_the_noise_of_a_constant_pressure_is_not_a_step(tmp_path):
    said = airmuscle("inspect", ramp(tmp_path / "run.csv", 3e5)).stdout
    assert re.search(r"isobaric +pressure +300 +kPa", said)
    assert "undersampled" not in said


# A saturated sensor


def test_a_saturated_force_sensor_gives_bounds_not_values(tmp_path):
    """A surface linear in the truth's powers meets the truth beyond the sensor's end; taken as they
    stand, rows bend it.
    """
    files = [
        ramp(tmp_path / f"run{i}.csv", p, ceiling=500.0, seed=i)
        for i, p in enumerate((1e5, 2e5, 3e5, 4e5, 5e5))
    ]
    out = tmp_path / "out"
    result = airmuscle("fit", *files, *SURFACE, "--out", out)
    assert "rows are censored (at zero force, or at the limit of the force range)" in result.stdout
    law = load(out / "muscle.toml").characteristic
    true = float(MUSCLE.force(4e5, 0.02))
    assert true > 850.0
    assert law.unclamped_force(4e5, 0.02) == pytest.approx(true, rel=0.01)
    runs = read(files, ColumnMapping(resting_length=0.3))
    found = fit(ContractileSurface.blank(3, max_force=1e5), runs)
    high = np.concatenate([run["force"] for run in runs]) >= 500.0
    assert high.sum() > 100
    assert (found.censoring[high] == -1).all()
    assert found.rmse < 1.0
    as_it_stands = fit(ContractileSurface.blank(3, max_force=1e5), runs, censoring=UNCENSORED)
    assert as_it_stands.rmse > 10.0
    assert float(as_it_stands.model.unclamped_force(4e5, 0.02)) < 0.65 * true


def test_a_sensor_without_limits_changes_nothing(tmp_path):
    runs = read(
        [ramp(tmp_path / f"run{i}.csv", p, seed=i) for i, p in enumerate((2e5, 3e5))],
        ColumnMapping(resting_length=0.3),
    )
    assert (fit(ContractileSurface.blank(1, max_force=1e5), runs).censoring <= 0).sum() == sum(
        (run["force"] > 0).sum() for run in runs
    )


def test_a_sensor_that_is_mostly_saturated_is_reported_as_a_problem(tmp_path):
    file = ramp(tmp_path / "run.csv", 5e5, ceiling=600.0)
    said = airmuscle("inspect", file).stdout
    assert "PROBLEM: the force sensor saturates at its upper limit, 600 N" in said
    assert "These rows are bounds (censored), not values." in said


# Time


def filling(path: Path, *, rows: int = 200, constant: float = 1.0, jump: bool = False) -> Path:
    time = 0.05 * np.arange(rows)
    if jump:
        time[rows // 2 :] += 3.0
    pressure = 6e5 * (1.0 - np.exp(-time / constant)) + 100.0 * np.random.default_rng(
        1
    ).standard_normal(rows)
    write(Recording({"time": time, "pressure": pressure}, path.name), path)
    return path


STUDY = """
[plant]
muscle = "dmsp-20-300"
[plant.circuit]
model = "FillDischarge"
supply = { model = "Supply", pressure = "6 bar" }
fill = { model = "Valve", conductance = 2e-9, critical_ratio = 0.3 }
discharge = { model = "Valve", conductance = 2e-9, critical_ratio = 0.3 }
[plant.mechanism]
model = "Isometric"
contraction = 0.05
[input]
fill = [[0, 1]]
[observed]
pressure = "100 Pa"
[fit]
free = ["circuit.fill.conductance"]
[[record]]
file = "record.csv"
"""


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"rows": 20}, "record.csv: the record ends before the pressure has settled"),
        ({"jump": True}, "record.csv: 1 gap in time, the longest of 3.05 s after row 100"),
    ],
)
def test_a_record_that_is_too_short_or_has_a_gap_is_reported_before_and_after_the_fit(
    tmp_path, options, message
):
    filling(tmp_path / "record.csv", **options)
    assert message.partition(": ")[2] in airmuscle("inspect", tmp_path / "record.csv").stdout
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    result = airmuscle("fit-dynamic", tmp_path / "study.toml", "--out", tmp_path / "out")
    assert result.exit_code == 0, result.stderr
    assert message in result.stdout
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    assert message.partition(": ")[2] in page


@pytest.mark.parametrize(
    ("row", "message"), [(20, "repeats the time"), (15, "is less than the time")]
)
@pytest.mark.parametrize("command", [*COMMANDS[:2], ("fit-dynamic",)], ids=lambda words: words[0])
def test_time_that_repeats_or_decreases_is_rejected_with_its_line(tmp_path, command, row, message):
    lines = ramp(tmp_path / "record.csv", 3e5).read_text(encoding="utf-8").splitlines()
    first = next(i for i, line in enumerate(lines) if line[0].isdigit())
    lines.insert(first + 21, lines[first + row])
    (tmp_path / "record.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    source = tmp_path / ("study.toml" if command[0] == "fit-dynamic" else "record.csv")
    line = refused(tmp_path, *command, source)
    assert (
        f"record.csv, line {first + 22}: time {0.1 * row:g} s {message} of the previous row (2 s)"
        in line
    )
    if command[0] != "fit-dynamic":
        assert "PROBLEM: time" in airmuscle("inspect", tmp_path / "record.csv").stdout


# A mapping


@pytest.mark.parametrize("command", COMMANDS, ids=lambda words: words[0])
def test_a_mapping_that_names_a_missing_column(tmp_path, command):
    file = ramp(tmp_path / "run.csv", 3e5)
    (tmp_path / "rig.toml").write_text('[columns]\n"presure" = "pressure [Pa]"\n', encoding="utf-8")
    line = refused(tmp_path, *command, file, "--mapping", tmp_path / "rig.toml")
    assert (
        "run.csv: the mapping names column 'presure', but the columns are time [s], pressure [Pa]"
        in line
    )
    assert "Did you mean 'pressure [Pa]'?" in line


# Warnings and notes


@pytest.mark.parametrize(("one_screen", "notes"), [(True, 0), (False, 1)])
def test_a_warning_is_not_repeated_by_a_note_on_the_same_screen(
    tmp_path, monkeypatch, one_screen, notes
):
    monkeypatch.setattr("airmuscle.outlets.cli.printing.on_one_screen", lambda: one_screen)
    files = [ramp(tmp_path / f"{p}.csv", 1e3 * p, seed=p) for p in (200, 300, 400, 500)]
    (run,) = read(files[0])
    write(
        run.with_columns(force=np.where(np.arange(len(run)) == 50, -999.0, run["force"])), files[0]
    )
    result = airmuscle("fit", *files, *SURFACE, "--out", tmp_path / "out", width=300)
    text = "the force is -999 in 1 row, far from all other readings"
    assert (result.stderr.count(text), result.stdout.count(text)) == (1, notes)
    assert text in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
