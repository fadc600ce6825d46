"""Limits of the checks of files, each from both sides: units, vacuum, suspicious values, uniform
time, constants.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from airmuscle.bench import ColumnMapping, UniformTime, read, read_csv
from airmuscle.bench.diagnosis import check_bench
from airmuscle.bench.readers import parse_unit_row
from airmuscle.errors import AirmuscleWarning, ColumnError, UnitError
from airmuscle.recording import Recording

UP = np.linspace(0.0, 1.0, 60)


def run(
    origin: str = "a.csv", units: dict[str, str] | None = None, **columns: np.ndarray
) -> Recording:
    usual = {"pressure": "kPa", "force": "N"}
    return Recording(
        columns, origin, units=units or {name: usual[name] for name in columns if name in usual}
    )


def warned(*recordings: Recording) -> str:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", AirmuscleWarning)
        check_bench(list(recordings))
    return " ".join(str(each.message) for each in caught)


def isometric(lowest: float = 0.0, highest: float = 5e5, **changed: np.ndarray) -> Recording:
    """A ramp of the pressure [Pa] at a held length, with a force in proportion to its rise."""
    columns = {
        "pressure": lowest + (highest - lowest) * UP,
        "contraction": np.full(60, 0.1),
        "force": 500.0 * UP,
    }
    return run(**(columns | changed))


# Units of several files


@pytest.mark.parametrize(("ratio", "refused"), [(1.45, True), (1.7, False)])
def test_similar_numbers_under_different_units_contradict_each_other(ratio: float, refused: bool):
    files = (
        run("a.csv", {"pressure": "kPa"}, pressure=3e5 * UP),
        run("b.csv", {"pressure": "bar"}, pressure=3e7 * ratio * UP),
    )
    if refused:
        with pytest.raises(UnitError, match="one of the two units is wrong"):
            check_bench(list(files))
    else:
        assert "one of the two units is wrong" not in warned(*files)


@pytest.mark.parametrize(("unit", "refused"), [("psi", True), ("torr", False)])
def test_units_contradict_each_other_from_a_factor_of_five_on(unit: str, refused: bool):
    factor = {"psi": 6894.757 / 1e3, "torr": 133.3224 / 1e2}[unit]
    files = (
        run("a.csv", {"pressure": "kPa" if refused else "hPa"}, pressure=3e5 * UP),
        run("b.csv", {"pressure": unit}, pressure=3e5 * factor * UP),
    )
    if refused:
        with pytest.raises(UnitError, match="one of the two units is wrong"):
            check_bench(list(files))
    else:
        assert "one of the two units is wrong" not in warned(*files)


@pytest.mark.parametrize(("ratio", "named"), [(48.0, False), (52.0, True)])
def test_pressures_in_one_unit_that_differ_by_a_factor_of_fifty_are_named(
    ratio: float, named: bool
):
    files = (isometric(), run("b.csv", pressure=5e5 * UP / ratio))
    assert ("differs by a factor of" in warned(*files)) == named


# Suspicious values


@pytest.mark.parametrize(
    ("lowest", "named"),
    [
        (94.9e3, False),
        (95.1e3, True),
        (105.9e3, True),
        (106.1e3, False),
        (1e5 + 15.0, False),
        (1e5 + 25.0, True),
    ],
)
def test_a_lowest_pressure_as_that_of_the_atmosphere_may_be_absolute(lowest: float, named: bool):
    assert ("may be absolute" in warned(isometric(lowest))) == named


@pytest.mark.parametrize(("pull", "named"), [(13.0, True), (17.0, False)])
def test_a_muscle_that_pulls_at_the_lowest_pressure_is_not_at_the_atmosphere(
    pull: float, named: bool
):
    recording = isometric(101e3, force=np.maximum(500.0 * UP, pull))
    assert ("may be absolute" in warned(recording)) == named


@pytest.mark.parametrize(("rise", "named"), [(45e3, False), (55e3, True)])
def test_a_run_without_rise_of_pressure_does_not_begin_at_the_atmosphere(rise: float, named: bool):
    pressure = 101e3 + rise / 0.98 * UP  # between the 1 % and the 99 % quantile
    assert ("may be absolute" in warned(run(pressure=pressure))) == named


@pytest.mark.parametrize(("offset", "named"), [(-22.0, False), (-30.0, True)])
def test_a_muscle_that_pushes_by_more_than_five_per_cent_has_an_offset(offset: float, named: bool):
    force = np.concatenate([np.full(10, offset), 500.0 * UP])
    recording = run(pressure=5e5 * np.concatenate([np.zeros(10), UP]), force=force)
    assert ("a muscle cannot push" in warned(recording)) == named


@pytest.mark.parametrize(("positive", "named"), [(150.0, True), (190.0, False)])
def test_a_force_that_is_three_times_as_negative_as_positive_is_reversed(
    positive: float, named: bool
):
    force = np.concatenate([np.full(30, -500.0), np.full(30, positive)])
    assert ("multiply the column by -1" in warned(run(pressure=5e5 * UP, force=force))) == named


@pytest.mark.parametrize(("stretch", "named"), [(0.045, False), (0.055, True)])
def test_an_elongation_of_more_than_five_per_cent_is_reversed(stretch: float, named: bool):
    recording = run(pressure=np.full(60, 3e5), contraction=-stretch / 0.98 * UP)
    assert ("an elongation that muscles do not bear" in warned(recording)) == named


@pytest.mark.parametrize(("highest", "named"), [(0.0095, True), (0.0105, False)])
def test_a_contraction_of_less_than_a_hundredth_of_a_per_cent_range_may_be_a_ratio(
    highest: float, named: bool
):
    recording = run(
        units={"contraction": "%"}, contraction=np.clip(highest * (1.02 * UP - 0.01), 0.0, highest)
    )
    assert ("state the unit '1'" in warned(recording)) == named


# One file


def test_a_held_absolute_pressure_counts_from_the_stated_ambient_pressure(tmp_path: Path):
    (tmp_path / "run.csv").write_text("force [N],length [mm]\n1,290\n2,280\n")
    constants = {"pressure": "3 bara"}
    (recording,) = read(tmp_path / "run.csv", ColumnMapping(constants=constants, ambient="950 hPa"))
    assert recording["pressure"] == pytest.approx([2.05e5, 2.05e5])


@pytest.mark.parametrize(("kilopascals", "refused"), [(-94.0, False), (-96.0, True)])
def test_vacuum_is_that_of_the_stated_ambient_pressure(
    tmp_path: Path, kilopascals: float, refused: bool
):
    (tmp_path / "run.csv").write_text(f"pressure [kPag],force [N]\n100,2\n{kilopascals},1\n")
    if refused:
        with pytest.raises(ColumnError, match=r"not above absolute vacuum \(-95 kPa gauge\)"):
            read(tmp_path / "run.csv", ColumnMapping(ambient="95 kPa"))
    else:
        assert read(tmp_path / "run.csv", ColumnMapping(ambient="95 kPa"))[0]["pressure"][
            1
        ] == pytest.approx(-94e3)


def test_a_resting_length_that_changes_between_rows_is_no_constant(tmp_path: Path):
    (tmp_path / "run.csv").write_text(
        "force [N],length [mm],resting_length [mm]\n1,290,300\n2,280,300.01\n"
    )
    with pytest.raises(ColumnError, match=r"changes from 300 to 300\.01, but must be constant"):
        read(tmp_path / "run.csv")


def test_a_unit_row_may_contain_the_unit_of_a_ratio():
    assert parse_unit_row(("pressure", "contraction"), ("kPa", "1")) == ("kPa", "1")
    assert parse_unit_row(("pressure", "contraction"), ("kPa", "2")) is None


@pytest.mark.parametrize(("sample_time", "refused"), [(0.25, False), (0.15, True)])
def test_rounded_stamps_deviate_by_at_most_their_rounding_and_five_sample_times(
    tmp_path: Path, sample_time: float, refused: bool
):
    time = np.arange(101) * sample_time
    stamps = np.floor(time) + np.where(
        (time > 5.0) & (time < 12.0), 2.0, 0.0
    )  # 2 s late, rounded to 1 s
    stamps = np.append(np.maximum.accumulate(stamps)[:-1], time[-1])
    rows = "".join(f"{t!r},1\n" for t in stamps.tolist())
    (tmp_path / "run.csv").write_text(f"time [s],force [N]\n{rows}")
    if refused:
        with pytest.raises(ColumnError, match="The file has gaps"):
            read(tmp_path / "run.csv", ColumnMapping(time=UniformTime()))
    else:
        (recording,) = read(tmp_path / "run.csv", ColumnMapping(time=UniformTime()))
        assert recording["time"] == pytest.approx(time)


def test_a_vertical_bar_separates_cells_where_no_comma_does(tmp_path):
    path = tmp_path / "bars.txt"
    path.write_text("time [s]|pressure [kPa]\n0|1.5\n1|2\n", encoding="utf-8")
    assert read_csv(path)["pressure"].tolist() == [1500.0, 2000.0]
    path.write_text("time [s],|F| [N]\n0,1.5\n1,2\n", encoding="utf-8")
    assert [*read_csv(path)] == ["time", "|F| [N]"]
