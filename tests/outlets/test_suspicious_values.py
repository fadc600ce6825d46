"""Numbers that are possible but that no muscle explains give a warning with the reason; plausible
files give none.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from airmuscle.bench import ColumnMapping, read, read_csv
from airmuscle.errors import AirmuscleWarning, ColumnError
from airmuscle.physics import Braid, TonduLopez2000

MUSCLE = TonduLopez2000(Braid(0.01, 0.45, 0.3), 1.2)
HEAD = "time [s],pressure [kPa],contraction [%],force [N]"
SECONDS = 0.1 * np.arange(200)
UP_AND_DOWN = 1.0 - np.abs(np.linspace(-1.0, 1.0, 200))


def columns(*, isometric: bool = False, pressure: float = 300.0) -> dict[str, np.ndarray]:
    """A run of a muscle as its file has it [s, kPa, %, N]."""
    kilopascals = 600.0 * UP_AND_DOWN if isometric else np.full(200, pressure)
    percent = np.full(200, 5.0) if isometric else 20.0 * UP_AND_DOWN
    force = np.maximum(MUSCLE.unclamped_force(1e3 * kilopascals, percent / 100), 0.0)
    noise = np.random.default_rng(1).standard_normal(200)
    return {
        "time": SECONDS,
        "pressure": kilopascals,
        "contraction": percent,
        "force": force + noise,
    }


def write(path: Path, values: dict[str, np.ndarray], head: str = HEAD) -> Path:
    rows = (",".join(f"{value:.5f}" for value in row) for row in zip(*values.values(), strict=True))
    path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    return path


def warned(files: list[Path]) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", AirmuscleWarning)
        read(files, ColumnMapping(resting_length=0.3))
    return [str(each.message) for each in caught]


@pytest.mark.parametrize(
    ("isometric", "changes", "head", "reason"),
    [
        (
            True,
            {"pressure": lambda p: p + 101.325},
            HEAD,
            "may be absolute: the unit is then 'kPa(a)'",
        ),
        (False, {"force": lambda f: -f}, HEAD, "multiply the column by -1"),
        (True, {"force": lambda f: f - 150.0}, HEAD, "a muscle cannot push"),
        (False, {"contraction": lambda c: -c}, HEAD, "an elongation that muscles do not bear"),
        (
            False,
            {"contraction": lambda c: c / 100},
            HEAD,
            "If these numbers are ratios and not percent",
        ),
        (
            True,
            {"pressure": lambda p: p / 100},
            HEAD,
            "The unit of force or pressure is probably wrong",
        ),
        (False, {}, HEAD.replace("[N]", "[kN]"), "The unit of force or pressure is probably wrong"),
        (
            True,
            {},
            "time [s],force [N],contraction [%],pressure [kPa]",
            "columns of pressure and force are not",
        ),
    ],
)
def test_a_suspicious_file_gives_one_warning_with_the_reason(
    tmp_path, isometric, changes, head, reason
):
    values = columns(isometric=isometric)
    for name, change in changes.items():
        values[name] = change(values[name])
    (text,) = warned([write(tmp_path / "run.csv", values, head)])
    assert reason in text


def test_plausible_files_give_no_warning(tmp_path):
    isobars = [write(tmp_path / f"{p}.csv", columns(pressure=p)) for p in (100.0, 300.0)]
    assert warned(isobars) == [], "a level of 100 kPa at which the muscle pulls is gauge"
    assert warned([write(tmp_path / "ramp.csv", columns(isometric=True))]) == []
    stated = columns(isometric=True)
    stated["pressure"] = stated["pressure"] + 101.325
    assert warned([write(tmp_path / "stated.csv", stated, HEAD.replace("kPa", "kPa(a)"))]) == []
    stretched = columns()
    stretched["contraction"] = stretched["contraction"] - 3.0
    assert warned([write(tmp_path / "stretched.csv", stretched)]) == []


def test_an_absolute_isobar_of_the_atmosphere_is_noticed_among_others(tmp_path):
    files = []
    for pressure in (0.0, 200.0):
        values = columns(pressure=pressure)
        values["pressure"] = values["pressure"] + 101.325
        files.append(write(tmp_path / f"{pressure}.csv", values))
    assert "may be absolute" in warned(files)[0]


def test_the_absolute_pressures_of_a_fill_without_force_are_noticed(tmp_path):
    fill = {"time": SECONDS, "pressure": 101.3 + 500.0 * (1.0 - np.exp(-SECONDS))}
    assert (
        "may be absolute"
        in warned([write(tmp_path / "fill.csv", fill, "time [s],pressure [kPa]")])[0]
    )


def test_equal_columns_are_read_once_and_two_tables_side_by_side_are_a_recording_each(tmp_path):
    one = columns()
    other = columns(pressure=400.0)
    double = {**one, "clock": one["time"]}
    (recording,) = read(write(tmp_path / "double.csv", double, f"{HEAD},time [s]"))
    assert any("read once: 'time [s]'" in note for note in recording.notes)
    both = {**one, **{f"{name} of the other": values for name, values in other.items()}}
    path = write(tmp_path / "both.csv", both, f"{HEAD},{HEAD}")
    recordings = read(path)
    assert len(recordings) == 2
    for recording, table in zip(recordings, (one, other), strict=True):
        assert recording["pressure"] == pytest.approx(1e3 * table["pressure"])
        assert recording["force"] == pytest.approx(table["force"], abs=1e-4)
    with pytest.raises(
        ColumnError, match=r"2 quantities are in several columns .*two tables side by side"
    ):
        read_csv(path)


def test_a_displacement_is_not_taken_for_a_contraction_but_explained(tmp_path):
    (recording,) = read(
        write(tmp_path / "run.csv", columns(), HEAD.replace("contraction [%]", "displacement [mm]"))
    )
    with pytest.raises(ColumnError, match="A displacement has no stated zero and direction"):
        recording["contraction"]


def test_a_force_in_kilopond_is_read(tmp_path):
    (recording,) = read(write(tmp_path / "run.csv", columns(), HEAD.replace("[N]", "[kp]")))
    assert recording["force"] == pytest.approx(9.80665 * columns()["force"], abs=1e-4)


def test_a_length_and_a_contraction_that_contradict_each_other_give_a_warning(tmp_path):
    values = columns()
    values["length"] = 300.0 * (1.0 - values["contraction"] / 100.0)
    head = f"{HEAD},length [mm]"
    assert warned([write(tmp_path / "run.csv", values, head)]) == []
    values["length"] = np.full(200, 300.0)
    (text,) = warned([write(tmp_path / "run.csv", values, head)])
    assert (
        "run.csv: with the resting length of 300 mm, the length of 300 mm is a contraction of 0 %"
        in text
    )
    assert "the file states 19.9 %, which is used. Check the resting length" in text
