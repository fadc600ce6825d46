"""Data that support no law are refused by every command for the same cause, which is the true one;
what a single isometric or isobaric record shows is given.

The causes are judged once (`support_of`), before anything is fitted. Each degenerate record below
differs from a sound one in one respect, and mended in this respect it is judged sound.
"""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from command_line import airmuscle, command_names
from dynamic_study import VALVES, plant_table

import airmuscle as am
from airmuscle.bench import (
    DataUse,
    LeftOutStage,
    compare,
    find_loops,
    fit,
    identify_campaign,
    level_record,
    support_of,
)
from airmuscle.bench.diagnosis import support_of_transients
from airmuscle.bench.dynamics import fit_regulator
from airmuscle.bench.estimation import default_split
from airmuscle.errors import IdentificationError
from airmuscle.physics import ContractileSurface
from airmuscle.recording import Recording

ROWS = 200
NOISE = 0.5
LAW = am.load("dmsp-20-300").characteristic
TIME = np.arange(ROWS) * 0.1
RISE = np.concatenate([np.linspace(0.0, 1.0, ROWS // 2), np.linspace(1.0, 0.0, ROWS // 2)])
PRESSURE = 2e4 + 5.8e5 * RISE
CONTRACTION = 0.2 * RISE
SCATTER = np.random.default_rng(0).normal(0.0, NOISE, ROWS)


def record(pressure=PRESSURE, contraction=CONTRACTION, force=None) -> Recording:
    """A record of the muscle with a sensor noise of 0.5 N; a force that is given is without."""
    columns = np.broadcast_arrays(TIME, pressure, contraction)
    if force is None:
        force = np.maximum(LAW.force(*columns[1:]), 0.0) + SCATTER
    names = ("time", "pressure", "contraction", "force")
    values = (*columns, np.broadcast_to(force, ROWS))
    return Recording(
        {name: np.array(column) for name, column in zip(names, values, strict=True)},
        "run",
        {"resting_length": 0.3},
    )


class Degenerate(NamedTuple):
    """A degenerate record, the words of its cause, and the first use that it makes impossible."""

    run: Recording
    cause: str
    scope: DataUse


PULL = record()
DEGENERATE = {
    "one length": Degenerate(
        record(contraction=0.1), "the contraction is 10 % in every row", DataUse.COMPARISON
    ),
    "one pressure": Degenerate(
        record(pressure=3e5), "the pressure is 300 kPa in every row", DataUse.COMPARISON
    ),
    "one pressure and length": Degenerate(
        record(pressure=3e5, contraction=0.1), "force is known at one point alone", DataUse.FIT
    ),
    "coupled": Degenerate(PULL, "pressure and contraction move together", DataUse.COMPARISON),
    "constant load": Degenerate(
        record(force=100.0), "at a constant force of 100", DataUse.COMPARISON
    ),
    "constant reading": Degenerate(
        record(contraction=0.05, force=500.0), "the force is 500 N in every row", DataUse.PREDICTION
    ),
    "saturated below": Degenerate(
        record(force=-8.74), "the force is -8.74 N in every row", DataUse.PREDICTION
    ),
    "slack": Degenerate(
        record(pressure=0.05 * PRESSURE, contraction=0.23, force=0.0),
        "the muscle is slack, or the load cell is not connected",
        DataUse.PREDICTION,
    ),
    "no pressure": Degenerate(
        record(pressure=0.0, force=SCATTER), "without which no muscle pulls", DataUse.PREDICTION
    ),
    "wrong sign": Degenerate(
        record(force=-PULL["force"]), "the sign of the force is wrong", DataUse.PREDICTION
    ),
    "longer than at rest": Degenerate(
        PULL.with_columns(contraction=-CONTRACTION), "longer than at rest", DataUse.PREDICTION
    ),
    "huge": Degenerate(
        PULL.with_columns(pressure=1e6 * PRESSURE, force=1e6 * PULL["force"]),
        "its unit is wrong",
        DataUse.PREDICTION,
    ),
    "tiny": Degenerate(
        PULL.with_columns(pressure=1e-9 * PRESSURE, force=1e-9 * PULL["force"]),
        "without which no muscle pulls",
        DataUse.PREDICTION,
    ),
    "equal rows": Degenerate(
        record(pressure=3e5, contraction=0.1, force=400.0),
        "all 200 rows are equal, pressure 300 kPa, contraction 10 %, force 400 N",
        DataUse.FIT,
    ),
    "one row": Degenerate(PULL.rows(slice(50, 51)), "1 row with 1 point", DataUse.FIT),
    "two rows": Degenerate(PULL.rows(slice(50, 52)), "2 rows with 2 points", DataUse.FIT),
    "no force": Degenerate(
        PULL.with_columns(force=np.full(ROWS, np.nan)), "no row has a force", DataUse.PREDICTION
    ),
}
LIVE = ("--max-pressure", "7 bar", "--max-force", "2 kN", "--degree", 2)
COMMANDS = {
    "compare": ("fit", "--compare"),
    "fit": ("fit", "--characteristic", "ContractileSurface", "--degree", 2),
    "hysteresis": ("hysteresis",),
    "campaign": ("campaign",),
    "predict": ("predict", "dmsp-20-300"),
    "fit-live": ("fit-live", *LIVE, "--follow"),
}
SCOPES = {
    "compare": DataUse.COMPARISON,
    "fit": DataUse.COMPARISON,  # a surface over both quantities
    "hysteresis": DataUse.FIT,
    "campaign": DataUse.FIT,
    "predict": DataUse.PREDICTION,
    "fit-live": DataUse.COMPARISON,
}
"""What each command asks of the data."""
WITHOUT_JUDGEMENT = {
    "inspect": "it tells of any file what it contains",
    "check": "it says of each record whether it is usable: test_check.py",
    "convert": "it writes any file",
    "fit-volume": "it takes no force; its points of volume are judged in test_volume_fit.py",
    "fit-joint": "it takes episodes, which are judged in test_fit_joint.py",
    "fit-dynamic": "its records need cover no pressures and contractions: the table TRANSIENT",
    "fit-regulator": "the same",
    "plan": "the same, of a study",
    "study": "its file is a study of a scenario, without records",
    "submit": "it judges records by predict and by its own rules: test_submit.py",
    "watch": "it checks each record and names what is wrong: test_watch.py",
    "site": "its files are muscles and scenarios, without records",
}
"""Commands that take records, and why they are not in the table."""
UNREADABLE = {"no force"}
"""Records that the reader of files refuses first."""


def written(run: Recording, folder: Path) -> Path:
    path = folder / "run.csv"
    rows = zip(
        TIME, run["pressure"] / 1e3, 300.0 * (1.0 - run["contraction"]), run["force"], strict=False
    )
    head = "time [s],pressure [kPa],length [mm],force [N]"
    path.write_text("\n".join([head, *(",".join(f"{x:.9g}" for x in row) for row in rows)]))
    return path


SINGLE = {"one length", "one pressure"}
"""Records that compare no laws but have a result of their own."""


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("name", sorted(DEGENERATE.keys() - UNREADABLE))
def test_every_command_names_the_same_true_cause_first(name: str, command: str, tmp_path: Path):
    run, cause, scope = DEGENERATE[name]
    if scope < SCOPES[command]:
        pytest.skip("the command can use these rows")
    file = written(run, tmp_path)
    out = tmp_path / "out"
    result = airmuscle(*COMMANDS[command], file, "--resting-length", "300 mm", "--out", out)
    if command == "compare" and name in SINGLE:
        assert result.exit_code == 0  # with what the record gives, below
        return
    assert result.exit_code == 1
    error = " ".join(result.stderr.split()).rpartition("error: ")[2]
    reason = support_of([am.read_csv(file, am.ColumnMapping(resting_length=0.3))]).reason
    assert cause in reason
    assert error.startswith(reason)
    assert "fewer than" not in error


@pytest.mark.parametrize("name", DEGENERATE)
def test_python_names_the_same_cause(name: str):
    run, cause, scope = DEGENERATE[name]
    support = support_of([run])
    assert cause in support.reason
    assert support.cause is not None
    assert support.cause.prevents is scope
    for task in (
        lambda: compare(run),
        lambda: fit(ContractileSurface.blank(4), run),
        *([lambda: find_loops([run]), lambda: identify_campaign([run])] if scope > 0 else []),
    ):
        with pytest.raises(IdentificationError) as caught:
            task()
        assert str(caught.value).startswith(str(support.refusal))


@pytest.mark.parametrize("name", DEGENERATE)
def test_no_cause_hangs_on_the_last_digit(name: str):
    run = DEGENERATE[name].run
    noise = np.random.default_rng(1)
    scaled = {
        column: run[column] * (1.0 + 1e-12 * noise.standard_normal(len(run)))
        for column in ("pressure", "contraction", "force")
    }
    causes = [support_of([each]).cause for each in (run, run.with_columns(**scaled))]
    assert causes[0] == causes[1]


def sound(**columns) -> list[Recording]:
    """Ramps of the pressure at four lengths."""
    runs = [record(contraction=0.05 * k) for k in range(4)]
    return [
        dataclasses.replace(run, origin=f"run {k}").with_columns(
            **{name: factor * run[name] for name, factor in columns.items()}
        )
        for k, run in enumerate(runs)
    ]


def test_sound_records_are_judged_sound_and_a_wrong_column_of_them_is_not():
    assert support_of(sound()).cause is None
    assert support_of(sound()[:2]).cause is None
    random = np.random.default_rng(2)
    points = record(1e5 + 5e5 * random.random(ROWS), 0.2 * random.random(ROWS))
    assert support_of([points]).cause is None
    for name, factor in {"force": -1.0, "pressure": 0.0, "contraction": -3.0}.items():
        assert support_of(sound(**{name: factor})).cause is not None


@pytest.mark.parametrize("kind", ["isometric", "isobaric"])
def test_what_a_single_record_gives(kind: str):
    """A force that is linear, with branches 12 N apart: all four values are known."""
    half = np.where(np.arange(ROWS) < ROWS // 2, -6.0, 6.0)
    if kind == "isometric":
        force = np.maximum(2e-3 * (PRESSURE - 1e5), 0.0)
        run = record(contraction=0.1, force=np.maximum(force + half * (force > 20), 0.0) + SCATTER)
        expected = (0.1, 1e5, 2e-3)
    else:
        force = np.maximum(4e3 * (0.16 - CONTRACTION), 0.0)
        moved = np.maximum(force - half * (force > 20), 0.0) + SCATTER
        run = record(pressure=3e5, force=moved)
        expected = (3e5, 0.16, -4e3)
    result = level_record(run)
    assert result is not None
    assert result.kind == kind
    assert (result.level, result.threshold, result.slope) == pytest.approx(expected, rel=0.02)
    assert result.is_reached
    assert abs(result.hysteresis) == pytest.approx(12.0, rel=0.03)
    assert result.noise == pytest.approx(NOISE, rel=0.25)
    assert result.summary in str(support_of([run]).refusal)
    assert str(result).startswith(f"run, {kind}")


@pytest.mark.parametrize("name", sorted(SINGLE))
def test_a_comparison_by_a_single_record_reports_what_the_record_gives(name: str, tmp_path: Path):
    file = written(DEGENERATE[name].run, tmp_path)
    run = am.read_csv(file, am.ColumnMapping(resting_length=0.3))
    command = ("fit", file, "--compare", "--resting-length", "300 mm", "--out", tmp_path / "out")
    shown = airmuscle(*command)
    assert shown.exit_code == 0
    text = " ".join(shown.stdout.split())
    assert f"Laws cannot be compared. {support_of([run]).reason}" in text
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["report.html"]
    values = json.loads(airmuscle(*command, "--json").stdout)["level_record"]
    result = level_record(run)
    assert values["slope_of_the_force"] == pytest.approx(result.slope)
    assert values["noise_of_the_force"] == pytest.approx(result.noise)


TRANSIENT = {
    "constant reading",
    "huge",
    "longer than at rest",
    "saturated below",
    "tiny",
    "wrong sign",
}
"""Records that are none of a pulling muscle; the others may be fills, motions, or loads at rest."""


def dynamic_study(file: Path) -> Path:
    """A study of fit-dynamic with one record, of which pressure and force are observed."""
    weight = 'model = "HangingMass"\nmass = "10 kg"'
    text = plant_table(weight, exponent=1.1, damping=100.0, conductance=4e-9)
    text += '[input]\nfill = [["0.1 s", 1], ["1 s", 0]]\ndischarge = [["1.3 s", 1]]\n'
    text += '[observed]\npressure = "500 Pa"\nforce = "5 N"\n'
    text += f'[fit]\nfree = [{VALVES}, "muscle.damper.damping"]\n'
    text += f'[[record]]\nfile = "{file.name}"\nmapping = {{ resting_length = "300 mm" }}\n'
    text += 'initial_state = { pressure = "0.2 bar" }\n'
    path = file.with_name("study.toml")
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("command", ["fit-dynamic", "plan"])
@pytest.mark.parametrize("name", sorted(TRANSIENT))
def test_commands_of_transient_records_name_the_same_cause(name: str, command: str, tmp_path: Path):
    file = written(DEGENERATE[name].run, tmp_path)
    result = airmuscle(command, dynamic_study(file), "--out", tmp_path / "out")
    assert result.exit_code == 1
    run = am.read_csv(file, am.ColumnMapping(resting_length=0.3))
    support = support_of_transients([run], ("pressure", "force"))
    assert DEGENERATE[name].cause in support.reason
    error = " ".join(result.stderr.split()).rpartition("error: ")[2]
    assert support.reason in error


@pytest.mark.parametrize("name", DEGENERATE)
def test_a_transient_record_is_refused_for_no_other_cause(name: str):
    support = support_of_transients([DEGENERATE[name].run], ("pressure", "force"))
    assert (support.cause is not None) == (name in TRANSIENT)


def test_a_regulator_names_a_wrong_unit_of_its_pressure():
    huge = Recording(
        {"time": TIME, "setpoint": PRESSURE, "pressure": 1e6 * PRESSURE}, "regulator.csv"
    )
    with pytest.raises(IdentificationError, match="its unit is wrong"):
        fit_regulator([huge], supply_pressure=6e5)


def test_every_command_that_takes_records_is_in_a_table():
    taking = set()
    for command in command_names():
        text = airmuscle(command, "--help", width=100).output
        usage = " ".join(text.partition("Usage:")[2].partition("\n\n")[0].split())
        if re.search(r"FILE|STUDY|EPISODES|FOLDER", usage) or "--follow" in text:
            taking.add(command)
    assert {"fit", "fit-live", "fit-dynamic", "campaign"} <= taking
    assert taking <= {*COMMANDS, *WITHOUT_JUDGEMENT}


def test_what_is_no_single_line_gives_no_such_result():
    assert level_record(PULL) is None
    assert level_record(DEGENERATE["slack"].run) is None
    assert level_record(DEGENERATE["two rows"].run) is None
    assert level_record(Recording({"pressure": PRESSURE}, "run")) is None


def test_inspect_and_a_campaign_give_what_the_record_shows(tmp_path: Path):
    file = written(DEGENERATE["one length"].run, tmp_path)
    result = level_record(am.read_csv(file, am.ColumnMapping(resting_length=0.3)))
    for command in (("inspect",), ("campaign", "--out", tmp_path / "out")):
        shown = airmuscle(*command, file, "--resting-length", "300 mm", "--json")
        (row,) = json.loads(shown.stdout)["level_records"]["isometric_records"]
        assert row["threshold_pressure"] == pytest.approx(result.threshold)
        assert row["slope_of_the_force"] == pytest.approx(result.slope)


def test_a_campaign_gives_each_advice_once(tmp_path: Path):
    file = written(DEGENERATE["one pressure"].run, tmp_path)
    shown = airmuscle("campaign", file, "--resting-length", "300 mm", "--out", tmp_path / "out")
    assert shown.exit_code == 0
    text = " ".join(shown.stdout.split()).lower()
    run = am.read_csv(file, am.ColumnMapping(resting_length=0.3))
    stages = [stage for _, stage in identify_campaign([run]).stages]
    left_out = [stage for stage in stages if isinstance(stage, LeftOutStage)]
    assert len(left_out) == 4
    for stage in left_out:
        assert text.count(stage.remedy.rstrip(".").lower()) == 1
        assert text.count(stage.reason.rstrip(".").lower()) == 1


def test_groups_that_are_too_few_are_counted():
    run = record(1e5 + 5e5 * RISE, 0.2 * np.sin(3.0 * TIME) ** 2)
    with pytest.raises(IdentificationError, match="have 1 specimen, 1 run, 1 level of contraction"):
        compare(run)
    with pytest.raises(IdentificationError, match="leave_out=BlockSplit"):
        default_split([run])
    assert compare(run, leave_out=am.bench.BlockSplit()).recommended is not None
