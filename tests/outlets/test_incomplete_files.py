"""Files that a logger wrote: rounded time stamps, a held length in the name of the file, matrices
of several heights.

Each has a way out in Python, in a mapping file and on the command line, and the error names it. A
run without a measured motion is not called isotonic. Numbers are chosen.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench import (
    ColumnMapping,
    NoTime,
    RecordedTime,
    UniformTime,
    find_runs,
    inspect,
    read,
)
from airmuscle.bench.readers import FileNamePattern, read_mapping
from airmuscle.errors import AirmuscleError, ColumnError, ParameterError
from airmuscle.recording import Recording

RATE = 530.0
ROWS = 1061


def a_log(folder: Path, name: str, contraction: float = 0.0, digits: int = 3) -> Path:
    """A ramp of the pressure up and down at a held length, from a logger at 530 Hz that writes
    pairs of rows with one time stamp of 1 ms."""
    time = 2 * (np.arange(ROWS) // 2) / RATE
    pressure = 20.0 + 580.0 * (1.0 - np.abs(np.linspace(-1.0, 1.0, ROWS)))
    force = np.maximum(0.0, 0.7 * pressure * (1.0 - 5.0 * contraction) - 30.0)
    rows = [
        f"{t:.{digits}f},{p:.2f},{f:.2f}" for t, p, f in zip(time, pressure, force, strict=True)
    ]
    path = folder / name
    path.write_text(
        "time [s],pressure [kPa],force [N]\n" + "\n".join(rows) + "\n", encoding="utf-8"
    )
    return path


def refusal(*arguments: Any, **options: Any) -> str:
    with pytest.raises(AirmuscleError) as caught:
        read(*arguments, ColumnMapping(**options))
    return str(caught.value)


def test_rounded_time_stamps_are_refused_with_each_way_out(tmp_path: Path) -> None:
    message = refusal(a_log(tmp_path, "log.csv"))
    assert "repeats the time" in message
    assert all(
        way in message
        for way in ("time=UniformTime()", "time=RecordedTime(ordered=False)", "time=NoTime()")
    )
    shown = airmuscle("fit", tmp_path / "log.csv", "--characteristic", "ContractileSurface").stderr
    assert all(way in shown for way in ("--time uniform", "--time unordered", "--time none"))


def test_uniform_time_is_that_of_the_logger_within_its_rounding(tmp_path: Path) -> None:
    (recording,) = read(a_log(tmp_path, "log.csv"), ColumnMapping(time=UniformTime()))
    assert recording["time"] == pytest.approx(np.arange(ROWS) / RATE, abs=1e-6)
    assert np.ptp(np.diff(recording["time"])) < 1e-12
    note = next(note for note in recording.notes if "uniform" in note)
    stated = re.search(r"([\d.]+) rows per second", note)
    assert stated
    assert float(stated[1]) == pytest.approx(RATE, rel=1e-3)


def test_rows_without_time_and_with_the_stamps_as_they_are(tmp_path: Path) -> None:
    path = a_log(tmp_path, "log.csv")
    (timeless,) = read(path, ColumnMapping(time=NoTime()))
    assert "time" not in timeless
    assert len(timeless) == ROWS
    (mapped,) = read(path, mapping=ColumnMapping(time=NoTime()))
    assert "time" not in mapped
    (unordered,) = read(path, ColumnMapping(time=RecordedTime(ordered=False)))
    assert (np.diff(unordered["time"]) == 0).any()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: np.where(np.arange(t.size) > 500, t + 3.0, t), "has gaps"),
        (lambda t: np.where(np.arange(t.size) > 500, t - 0.5, t), "time decreases"),
        (lambda t: 0.0 * t, "time that increases"),
    ],
)
def test_time_that_is_not_uniform_is_not_made_so(tmp_path: Path, change: Any, message: str) -> None:
    time = change(np.round(np.arange(ROWS) / RATE, 3))
    lines = [f"{t:.3f},{100 + i % 50}" for i, t in enumerate(time)]
    (tmp_path / "gap.csv").write_text(
        "time [s],pressure [kPa]\n" + "\n".join(lines), encoding="utf-8"
    )
    assert message in refusal(tmp_path / "gap.csv", time=UniformTime())


def test_a_mapping_names_its_time_base_and_refuses_others(tmp_path: Path) -> None:
    (tmp_path / "rig.toml").write_text('time = "equal"\n')
    with pytest.raises(
        ColumnError,
        match=r"rig\.toml: time is 'equal'; allowed range: recorded, uniform, unordered, none",
    ):
        read_mapping(tmp_path / "rig.toml")
    with pytest.raises(ParameterError, match="time must be an instance of TimeBase; it is 'equal'"):
        ColumnMapping(time="equal")  # type: ignore[arg-type]


def test_the_held_length_and_the_specimen_are_read_from_the_name(tmp_path: Path) -> None:
    path = a_log(tmp_path, "festo10_cut10cm_held7.325cm_test8.csv")
    pattern = "cut{specimen}_held{length [cm]}cm_test{}"
    (recording,) = read(
        path, ColumnMapping(file_name=pattern, resting_length="83 mm", time=UniformTime())
    )
    assert recording["length"] == pytest.approx(0.07325)
    assert recording["contraction"] == pytest.approx((0.083 - 0.07325) / 0.083)
    assert recording.constants["specimen"] == "10cm"
    assert any("The length is 0.07325 m in every row" in note for note in recording.notes)


@pytest.mark.parametrize(
    ("pattern", "name", "expected"),
    [
        ("held{length [mm]}", "run_held73,5mm", {"length [mm]": 73.5}),
        (
            "{specimen}_p{pressure [bar]}bar",
            "A7_p2.5bar",
            {"specimen": "A7", "pressure [bar]": 2.5},
        ),
        (
            "{}_L{resting_length [mm]}_{run}",
            "x_y_L200_isometric",
            {"resting_length [mm]": 200.0, "run": "isometric"},
        ),
    ],
)
def test_a_pattern_gives_the_values_of_a_name(
    pattern: str, name: str, expected: dict[str, Any]
) -> None:
    assert FileNamePattern(pattern).values(Path(f"{name}.csv")) == expected


def test_a_hyphen_that_may_be_a_minus_sign_is_refused_until_the_pattern_holds_it() -> None:
    path = Path("iso-10.csv")
    with pytest.raises(
        ColumnError,
        match=r"hyphen of 'o-10' may be a minus sign .* pattern: '-\{contraction \[%\]\}'",
    ):
        FileNamePattern("iso{contraction [%]}").values(path)
    assert FileNamePattern("iso-{contraction [%]}").values(path) == {"contraction [%]": 10.0}
    assert FileNamePattern("iso_{contraction [%]}").values(Path("iso_-10.csv")) == {
        "contraction [%]": -10.0
    }


@pytest.mark.parametrize(
    "pattern", ["held{length}", "held{size [mm]}", "held", "{length [mm]}_{length [mm]}", "{}"]
)
def test_a_pattern_without_a_quantity_and_its_unit_is_refused(pattern: str) -> None:
    with pytest.raises(ColumnError, match=r"\{length \[cm\]\}"):
        FileNamePattern(pattern)


def test_a_name_that_does_not_match_its_pattern_is_refused(tmp_path: Path) -> None:
    message = refusal(
        a_log(tmp_path, "run1.csv"), file_name="held{length [cm]}cm", time=UniformTime()
    )
    assert message.startswith("run1.csv: the name does not match the pattern 'held{length [cm]}cm'")


def test_a_constant_that_a_column_contains_is_refused(tmp_path: Path) -> None:
    message = refusal(
        a_log(tmp_path, "log.csv"), constants={"pressure": "3 bar"}, time=UniformTime()
    )
    assert "pressure is stated as a constant, but a column contains it" in message
    assert "'lenght' is no constant" in refusal(tmp_path / "log.csv", constants={"lenght": "3 mm"})


def test_a_mapping_file_states_constants_pattern_and_time(tmp_path: Path) -> None:
    a_log(tmp_path, "held80mm.csv")
    text = (
        'file_name = "held{length [mm]}mm"\ntime = "uniform"\n[constants]\ntemperature = "20 °C"\n'
    )
    (tmp_path / "rig.toml").write_text(text, encoding="utf-8")
    (recording,) = read(tmp_path / "held80mm.csv", mapping=tmp_path / "rig.toml")
    assert recording["length"] == pytest.approx(0.08)
    assert recording["temperature"] == pytest.approx(293.15)


def test_a_run_without_a_measured_motion_is_not_isotonic(tmp_path: Path) -> None:
    slack = a_log(tmp_path, "slack.csv", contraction=0.19)
    (recording,) = read(slack, ColumnMapping(time=UniformTime()))
    assert np.mean(recording["force"] == 0) > 0.9
    assert {run.kind.name for run in find_runs(recording)} == {"free"}
    findings = " ".join(finding.text for finding in inspect(recording).findings)
    assert "no length or contraction was recorded" in findings
    (held,) = read(slack, ColumnMapping(time=UniformTime(), constants={"length": "70 mm"}))
    assert {run.kind.name for run in find_runs(held)} == {"isometric"}


def test_a_constant_force_with_a_measured_motion_stays_isotonic() -> None:
    pressure = np.linspace(1e5, 6e5, 200)
    columns = {"pressure": pressure, "contraction": 4e-7 * pressure, "force": np.full(200, 100.0)}
    assert [run.kind.name for run in find_runs(Recording(columns, "lift"))] == ["isotonic"]


def test_logs_with_lengths_in_their_names_are_inspected_and_fitted_by_options(
    tmp_path: Path,
) -> None:
    files = [a_log(tmp_path, f"held{200 * (1 - c):.0f}mm.csv", c) for c in (0.0, 0.05, 0.1)]
    options = (
        "--file-name",
        "held{length [mm]}mm",
        "--time",
        "uniform",
        "--resting-length",
        "200 mm",
    )
    shown = airmuscle("inspect", *files, *options)
    assert shown.exit_code == 0, shown.stderr
    assert "isometric" in shown.stdout
    assert "isotonic" not in shown.stdout
    law = ("--characteristic", "ContractileSurface", "--degree", "2")
    fitted = airmuscle("fit", *files, *options, *law, "--json", "--out", tmp_path / "fit")
    assert fitted.exit_code == 0, fitted.stderr
    assert json.loads(fitted.stdout)["fit"]["contraction_of_the_data"] == pytest.approx([0.0, 0.1])


def test_fit_takes_columns_and_constants_by_options(tmp_path: Path) -> None:
    path = a_log(tmp_path, "log.csv")
    text = (
        path.read_text(encoding="utf-8")
        .replace("pressure [kPa]", "ch1")
        .replace("force [N]", "ch2")
    )
    path.write_text(text, encoding="utf-8")
    named = ("--column", "ch1=pressure [kPa]", "--column", "ch2=force [N]", "--time", "none")
    law = ("--characteristic", "ContractileSurface", "--out", tmp_path / "fit")
    result = airmuscle("fit", path, *named, "--constant", "contraction=0.05", *law)
    assert "contraction is 0.05 in every row, so a surface cannot be fitted" in result.stderr


def mat_file(path: Path, **variables: Any) -> Path:
    scipy_io = pytest.importorskip("scipy.io")
    scipy_io.savemat(path, variables)
    return path


def a_matrix() -> np.ndarray:
    rows = np.arange(40.0)
    return np.column_stack([0.01 * rows, 1.0 + 0.1 * rows, 5.0 * rows])


def test_matrices_of_different_height_are_read_by_the_mapping(tmp_path: Path) -> None:
    path = mat_file(
        tmp_path / "run.mat",
        data=a_matrix(),
        calibration=np.ones((3, 2)),
        offsets=np.array([1.0, 2.0]),
    )
    columns = {"data(:,1)": "time [s]", "data(:,2)": "pressure [barg]", "data(:,3)": "force [N]"}
    (recording,) = read(path, ColumnMapping(columns=columns))
    assert recording["force"] == pytest.approx(a_matrix()[:, 2])
    note = next(note for note in recording.notes if "Not read" in note)
    assert "calibration(:,1) (3 rows)" in note
    assert "offsets (2 rows)" in note


def test_known_quantities_decide_without_a_mapping_and_an_open_choice_names_it(
    tmp_path: Path,
) -> None:
    data = a_matrix()
    path = mat_file(
        tmp_path / "named.mat",
        time_s=data[:, 0],
        pressure_bar=data[:, 1],
        calibration=np.ones((3, 2)),
    )
    (recording,) = read(path)
    assert recording["pressure"] == pytest.approx(1e5 * data[:, 1])
    message = refusal(mat_file(tmp_path / "open.mat", data=data, calibration=np.ones((3, 2))))
    assert "3 rows: calibration(:,1), calibration(:,2); 40 rows: data(:,1)" in message
    shown = airmuscle("inspect", tmp_path / "open.mat").stderr
    assert '--column "data(:,1)=time [s]"' in shown
