"""Every static fit names the mistakes of a bench in its data; clean benches with friction, noise
and rounding get none.

The laboratories are those of tests/laboratories.py; each check has a variant that it must name.
"""

from __future__ import annotations

import dataclasses
import pickle
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle
from laboratories import (
    ATMOSPHERE,
    FORCE,
    LENGTH,
    MUSCLE,
    PRESSURE,
    RESTING_LENGTH,
    Table,
    by_hand,
    changed,
    every_other,
    measured,
    one_file,
    ramps,
    sweeps,
    with_code,
    with_glitches,
    write,
)

from airmuscle.bench import (
    Candidate,
    ColumnMapping,
    Fit,
    StaticStage,
    classify_records,
    compare,
    fit,
    read,
)
from airmuscle.bench.campaign import fit_static_stage
from airmuscle.bench.diagnosis import examine_recordings
from airmuscle.bench.statics import blank_surface
from airmuscle.errors import AirmuscleWarning, ColumnError, IdentificationError
from airmuscle.physics import Braid, CreepElements, NoFriction, TonduLopez2000
from airmuscle.recording import Recording

EXAMINED = "airmuscle.bench.statics.fit_points.examine_recordings"
OTHER = dataclasses.replace(MUSCLE, radius=0.0128)
FRICTIONLESS = dataclasses.replace(MUSCLE, friction=0.0)


def read_all(folder: Path, tables: dict[str, Table]) -> tuple[Recording, ...]:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", AirmuscleWarning)
        return read(write(tables, folder), ColumnMapping(resting_length=RESTING_LENGTH))


def notes_of(folder: Path, tables: dict[str, Table]) -> str:
    return "\n".join(examine_recordings(read_all(folder, tables)).notes)


def fitted(folder: Path, tables: dict[str, Table]) -> Fit:
    return fit(blank_surface(4, 1e4), read_all(folder, tables))


@pytest.mark.parametrize(
    "tables",
    [
        sweeps(),
        ramps(),
        by_hand(),
        sweeps(OTHER),
        ramps(duration=1.0, sample_time=0.01),
        sweeps() | ramps(),
    ],
    ids=["sweeps", "ramps", "by hand", "another muscle", "fast ramps", "both"],
)
def test_a_clean_bench_has_no_remark(tmp_path, tables):
    assert notes_of(tmp_path, tables) == ""


def cycles(
    pressure: float,
    *,
    scale=1.0,
    period=10.0,
    count=1,
    friction=20.0,
    viscous=0.0,
    drift=0.0,
    noise=1.0,
    begin=0.0,
):
    """Columns of isobaric cycles of 20 % with friction, damping and drift of the force, from
    `begin` [s] on.
    """
    random = np.random.default_rng(int(pressure) + int(begin))
    time = np.arange(0.0, count * period, period / 100.0)
    contraction = 0.1 - 0.1 * np.cos(2.0 * np.pi * time / period)
    speed = np.gradient(contraction, time)
    force = (
        scale
        * pressure
        * 1.5e-3
        * (1.0 - contraction / 0.25) ** 1.3
        * (1.0 + drift * (time + begin) / 40.0)
    )
    force += random.normal(0.0, noise, time.size) - friction * np.sign(speed) - viscous * speed
    return {
        "time": time + begin,
        "pressure": np.full(time.size, pressure),
        "contraction": contraction,
        "force": force,
    }


def group_notes(*parts: dict[str, float]) -> str:
    """The remark on two groups of cycles at five pressures, one file for each."""
    recordings = []
    for pressure in (1e5, 2e5, 3e5, 4e5, 5e5):
        tables = [cycles(pressure, **part) for part in parts]
        columns = {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
        recordings.append(
            Recording(columns, f"{pressure / 1e3:.0f}.csv", {"resting_length": RESTING_LENGTH})
        )
    return "\n".join(note for note in examine_recordings(recordings).notes if "two groups" in note)


def test_two_muscles_in_files_without_a_column_are_named():
    notes = group_notes({}, {"scale": 1.15, "begin": 15.0})
    assert re.search(r"forces differ by 1\d % .*, and agree to 0.\d+ % within a group", notes)
    assert re.search(
        r"\(100.csv rows 1 to 10\d, .* more; 500.csv rows 10\d to 200.*\)\. Are they two muscles",
        notes,
    )
    assert "columns={'muscle': 'specimen'}" in notes


@pytest.mark.parametrize(
    "parts",
    [
        ({"count": 4},),
        ({"count": 4, "friction": 120.0},),
        ({"viscous": 3e3}, {"viscous": 3e3, "period": 2.0, "count": 2, "begin": 15.0}),
        ({"count": 6, "drift": 0.2},),
        ({"count": 4, "noise": 40.0},),
    ],
    ids=["one muscle", "hysteresis", "two speeds", "drift", "noise"],
)
def test_what_is_no_second_muscle_gives_no_two_groups(parts):
    assert group_notes(*parts) == ""


@pytest.mark.parametrize("values", [("A", "B"), (1, 2)], ids=["text", "numbers"])
def test_two_muscles_in_one_file_are_named_with_the_column_that_tells_them_apart(tmp_path, values):
    notes = notes_of(
        tmp_path, one_file(sweeps(), sweeps(OTHER, seed=90), column="muscle", values=values)
    )
    assert "Rows contradict each other" in notes
    assert "both.csv, row" in notes
    assert (
        "To state it as the specimen, use columns={'muscle': 'specimen'} of ColumnMapping. Fit each"
        " specimen" in notes
    )


def force_map(muscle, shift):
    """Static points without time on a grid of pressures and contractions; the shift is a fraction
    of a step of each.
    """
    p, c = np.linspace(1e5, 5e5, 5) + shift[0] * 1e5, np.linspace(0.0, 0.2, 11) + shift[1] * 0.02
    pressure, contraction = (grid.ravel() for grid in np.meshgrid(p, c, indexing="ij"))
    return {"map": measured(np.arange(55.0), pressure, contraction, np.zeros(55), 7, muscle)}


@pytest.mark.parametrize(
    "shift", [(0.5, 0.0), (0.0, 0.5), (0.3, 0.4)], ids=["pressures", "lengths", "both"]
)
def test_force_maps_of_two_muscles_without_time_and_without_a_common_point_contradict_each_other(
    tmp_path, shift
):
    two = one_file(force_map(MUSCLE, (0.0, 0.0)), force_map(OTHER, shift))
    notes = notes_of(tmp_path / "two", two)
    assert "Rows contradict each other: apart from a smooth dependence on both quantities" in notes
    one = one_file(force_map(MUSCLE, (0.0, 0.0)), force_map(MUSCLE, shift))
    assert notes_of(tmp_path / "one", one) == ""
    repeated = {
        "both": {name: np.concatenate([column[:8], column]) for name, column in two["both"].items()}
    }
    assert "apart from a smooth dependence" in notes_of(tmp_path / "repeated", repeated), (
        "points that agree"
    )


def test_a_column_that_names_the_specimen_divides_the_file(tmp_path):
    tables = one_file(sweeps(), sweeps(OTHER, seed=90), column="muscle", values=("A", "B"))
    found = read(
        write(tables, tmp_path),
        ColumnMapping(columns={"muscle": "specimen"}, resting_length=RESTING_LENGTH),
    )
    assert [run.constants["specimen"] for run in found] == ["A", "B"]
    assert [run.origin for run in found] == ["both.csv, specimen A", "both.csv, specimen B"]
    assert found[1]["force"].max() > 1.3 * found[0]["force"].max()
    assert examine_recordings(found).notes == (), "two specimens do not contradict each other"


def test_two_muscles_in_two_files_of_one_specimen_contradict_each_other(tmp_path):
    tables = sweeps() | {f"again_{name}": table for name, table in sweeps(OTHER, seed=90).items()}
    notes = notes_of(tmp_path, tables)
    assert "Rows contradict each other" in notes
    assert "Check whether these runs are of one muscle" in notes


def test_isobars_of_absolute_pressure_among_others_are_named(tmp_path):
    notes = notes_of(tmp_path, every_other(sweeps(), PRESSURE, ATMOSPHERE))
    assert "Rows contradict each other" in notes
    assert "the pressures of isobar_200.csv, isobar_400.csv are probably absolute" in notes


def test_a_fit_that_contradictory_rows_prevent_names_them(tmp_path):
    """Absolute pressures leave four of six levels, too few for degree 4; more levels would be no
    remedy.
    """
    runs = read_all(tmp_path, every_other(sweeps(), PRESSURE, ATMOSPHERE))
    with pytest.raises(
        IdentificationError, match=r"4 of pressure.* isobar_400\.csv are probably absolute"
    ) as refused:
        fit(blank_surface(4, 1e5), runs)
    assert refused.value.cause.startswith("the data cannot separate")
    (isobar,) = read_all(tmp_path / "one", {"one": sweeps()["isobar_300"]})
    with pytest.raises(
        IdentificationError, match=r"use degree=\d of [\w.]+$|law with fewer parameters\.[^.]*\.$"
    ):
        fit(blank_surface(4, 1e5), isobar)


def test_ramps_of_absolute_pressure_among_others_are_named(tmp_path):
    notes = notes_of(tmp_path, every_other(ramps(), PRESSURE, ATMOSPHERE))
    assert "held_4.csv, held_12.csv, held_20.csv: the pressure begins at 101.1 kPa" in notes
    assert "absolute and gauge pressures are mixed" in notes


def test_isobars_of_absolute_pressure_throughout_are_named(tmp_path):
    notes = notes_of(tmp_path, changed(sweeps(), PRESSURE, lambda p: p + ATMOSPHERE))
    assert "The pressures are probably absolute, but read as gauge" in notes


@pytest.mark.parametrize(
    ("tables", "text"), [(ramps(), "40.2 N at zero pressure"), (sweeps(), "N at zero pressure")]
)
def test_a_force_zero_is_named(tmp_path, tables, text):
    notes = notes_of(tmp_path, changed(tables, FORCE, lambda f: f + 40.0))
    assert text in notes
    assert "zero of the force sensor" in notes


def test_a_negative_force_zero_is_named_unless_it_is_the_limit_of_the_sensor(tmp_path):
    """A slack muscle reads the same negative force at several lengths; a sensor that ends there
    reads no more.
    """
    low = changed(ramps(), FORCE, lambda f: f - 25.0)
    assert re.search(
        r"-2\d(\.\d)? N at zero pressure.*zero of the force sensor is wrong",
        notes_of(tmp_path, low),
    )
    ended = changed(ramps(), FORCE, lambda f: np.maximum(f, 4.0) - 25.0)
    assert "zero of the force sensor" not in notes_of(tmp_path / "ended", ended)


def test_a_length_in_cm_under_mm_is_refused(tmp_path):
    with pytest.raises(
        ColumnError,
        match=r"pulls at a contraction of 90 to 92\.4 %, but no pneumatic muscle pulls bey",
    ):
        read_all(tmp_path, changed(sweeps(), LENGTH, lambda length: length / 10.0))


def test_a_fit_refuses_contractions_of_no_muscle(tmp_path):
    runs = [
        run.with_columns(contraction=0.6 + run["contraction"])
        for run in read_all(tmp_path, sweeps())
    ]
    with pytest.raises(ColumnError, match="no pneumatic muscle pulls beyond 55 %"):
        fit(blank_surface(4, 1e4), runs)


def test_the_data_of_a_fit_are_examined_when_its_notes_are_first_read(tmp_path, monkeypatch):
    result = fitted(tmp_path, changed(ramps(), FORCE, lambda f: f + 40.0))
    monkeypatch.setattr(EXAMINED, lambda runs: pytest.fail("examined"))
    with pytest.raises(pytest.fail.Exception, match="examined"):
        _ = result.notes
    monkeypatch.undo()
    sent = pickle.loads(pickle.dumps(result))
    monkeypatch.setattr(EXAMINED, lambda runs: pytest.fail("examined"))
    assert "40.2 N at zero pressure" in "".join(sent.notes)
    assert sent.notes == result.notes
    assert sent.scatter == result.scatter


@pytest.mark.parametrize(("column", "code"), [(FORCE, -999.0), (FORCE, 9999.0), (PRESSURE, 9999.0)])
def test_a_code_for_missing_values_is_named_and_nothing_else_is_blamed(tmp_path, column, code):
    (note,) = examine_recordings(read_all(tmp_path, with_code(sweeps(), column, code))).notes
    assert f"is {code:g} in 72 rows" in note
    assert "a code for a missing value" in note
    assert f"use missing=DropMissing(codes=({code},)) of ColumnMapping" in note


def test_an_elongation_under_contraction_is_named(tmp_path):
    tables = changed(sweeps(), LENGTH, lambda length: 2.0 * 300.0 - 72.0 - length)
    assert "The column probably counts the elongation" in notes_of(tmp_path, tables)


def test_the_delay_of_a_sensor_is_not_called_friction(tmp_path):
    result = fitted(tmp_path, ramps(FRICTIONLESS, duration=1.0, sample_time=0.005, delay=0.04))
    (note,) = [note for note in result.notes if "delay between the sensors" in note]
    assert "follows the pressure by 39.9 ms" in note or "follows the pressure by 40" in note
    assert not any("To identify the friction" in note for note in result.notes)


def test_a_pressure_that_is_read_late_is_not_called_friction(tmp_path):
    tables = ramps(dataclasses.replace(MUSCLE, friction=2.0), duration=1.0, sample_time=0.005)
    for table in tables.values():
        time = table["time [s]"]
        table[PRESSURE] = np.interp(time - 0.04, time, table[PRESSURE])
    notes = notes_of(tmp_path, tables)
    assert (
        "the pressure follows the force by 3" in notes
        or "the pressure follows the force by 4" in notes
    )
    assert "shift the pressure by this time" in notes


@pytest.mark.parametrize("offset", [-50.0, 50.0])
def test_the_zero_of_the_force_is_read_where_an_isobar_is_slack(tmp_path, offset):
    """At 60 and 80 kPa the muscle is slack from 15 % on; no reading without pressure and no line of
    the force shows it.
    """
    time = 0.05 * np.arange(181)
    contraction = 0.24 * (1.0 - np.abs(1.0 - time / 4.5))
    runs = {
        f"isobar_{p / 1e3:.0f}": measured(
            time, np.full(181, p), contraction, -np.sign(np.gradient(contraction)), i
        )
        for i, p in enumerate((60e3, 80e3, 5e5, 6e5))
    }
    assert notes_of(tmp_path / "right", runs) == ""
    notes = notes_of(tmp_path / "wrong", changed(runs, FORCE, lambda force: force + offset))
    assert f"the force is {offset:.0f} N over a range of contractions at constant pressure" in notes


@pytest.mark.parametrize(
    ("tables", "level"),
    [
        ({"isobar_400": sweeps()["isobar_400"]}, "pressure was measured at one level, 400 kPa"),
        ({"held_8": ramps()["held_8"]}, "contraction was measured at one level, 8 %"),
    ],
)
def test_a_fit_to_one_level_says_that_the_rest_is_the_form_of_the_law(tmp_path, tables, level):
    (recording,) = read_all(tmp_path, tables)
    law = TonduLopez2000(Braid(0.011, np.radians(25.0), RESTING_LENGTH), 1.15)
    notes = fit(law, recording, fixed=("geometry.braid_angle", "end_correction")).notes
    assert any(f"The {level}: how the force depends on it follows" in note for note in notes)
    assert not any("one level" in note for note in fitted(tmp_path / "all", sweeps()).notes)


def test_a_pressure_sensor_at_its_limit_is_named(tmp_path):
    tables = ramps()
    assert notes_of(tmp_path / "right", tables) == ""
    notes = notes_of(
        tmp_path / "wrong", changed(tables, PRESSURE, lambda pressure: np.minimum(pressure, 480.0))
    )
    assert "The pressure sensor saturates at 480 kPa" in notes
    assert "where the force still changes" in notes


def test_a_gauge_pressure_below_zero_is_named_and_a_vacuum_is_not(tmp_path):
    notes = notes_of(
        tmp_path / "zero", changed(ramps(), PRESSURE, lambda pressure: pressure - 12.0)
    )
    assert re.search(r"the gauge pressure is down to -(9|1\d)", notes)
    assert "Unless the rig draws a vacuum" in notes
    vacuum = changed(ramps(), PRESSURE, lambda pressure: np.maximum(pressure, 2.0) - 60.0)
    assert "vacuum" not in notes_of(tmp_path / "vacuum", vacuum)


def test_the_command_hysteresis_states_a_delay(tmp_path):
    tables = ramps(FRICTIONLESS, duration=12.0, sample_time=0.1, delay=0.4)
    paths = write({name: tables[name] for name in ("held_4", "held_12")}, tmp_path)
    options = ["--resting-length", "300 mm", "--elements", "2", "--out", str(tmp_path / "out")]
    result = airmuscle("hysteresis", *map(str, paths), *options)
    assert result.exit_code == 0, result.output
    assert "note: The loops of the ramps" in result.output
    assert "those of a delay between the sensors" in (tmp_path / "out" / "report.html").read_text(
        encoding="utf-8"
    )


def test_friction_is_not_called_a_delay(tmp_path):
    rough = dataclasses.replace(MUSCLE, friction=40.0)
    result = fitted(tmp_path, ramps(rough, duration=1.0, sample_time=0.005))
    assert not any("delay" in note for note in result.notes)
    assert any(
        "two branches" in note and "inflating and deflating" in note for note in result.notes
    )


def test_outliers_are_carried_into_the_notes_with_the_remedy(tmp_path):
    notes = notes_of(tmp_path, with_glitches(sweeps(), 0.01, (100.0, 400.0)))
    assert "Suspected outliers of the force pull the law" in notes
    assert "To leave them out, use drop_outliers=True of ColumnMapping." in notes
    assert "To reduce their weight, use loss=Huber(" in notes


def test_one_gross_outlier_is_reported_by_its_share_in_the_rms_error(tmp_path):
    """One row of 1100 is below the least share of rows, yet 600 N of it are 18 N of the rms
    error.
    """
    name, *others = sorted(tables := sweeps())
    glitch = with_glitches({name: tables[name]}, 0.0, (600.0, 601.0))
    notes = notes_of(tmp_path, {**tables, **glitch})
    rows = sum(table[FORCE].size for table in tables.values())
    assert (
        f"Suspected outliers of the force pull the law: 1 of {rows} rows, in 1 of {1 + len(others)}"
        " files" in notes
    )
    assert f"an rms error of {600 / rows**0.5:.2g} N" in notes
    assert "Suspected outliers" not in notes_of(
        tmp_path, {**tables, **with_glitches({name: tables[name]}, 0.0, (40.0, 41.0))}
    )


def test_the_branches_of_isobaric_loops_contract_and_extend(tmp_path):
    (note,) = [note for note in fitted(tmp_path, sweeps()).notes if "two branches" in note]
    assert "(contracting and extending)" in note


def test_a_fit_states_the_scatter_of_its_data_and_a_law_that_does_not_follow_them(tmp_path):
    tables = sweeps() | {f"again_{name}": table for name, table in sweeps(seed=30).items()}
    runs = read_all(tmp_path, tables)
    good, poor = (fit(blank_surface(degree, 1e4), runs) for degree in (4, 1))
    assert good.scatter is not None
    assert good.scatter.noise == pytest.approx(1.0, rel=0.5)
    assert 1.0 < good.scatter.repeatability < 2.0, (
        "noise of force, pressure and length, and the distance of the rows"
    )
    assert "noise of the data" in str(good)
    assert not any("does not follow" in note for note in good.notes)
    (misfit,) = [note for note in poor.notes if "does not follow" in note]
    assert re.search(
        r"times the scatter of the data \(noise of the data [\d.]+ N, difference of repeated runs",
        misfit,
    )


def test_a_comparison_states_the_remarks_of_a_fit(tmp_path):
    runs = read_all(tmp_path, every_other(sweeps(), PRESSURE, ATMOSPHERE))
    found = compare(runs, [Candidate("surface", blank_surface(3, 1e4))])
    assert any("are probably absolute" in note for note in found.notes)
    assert any("two branches" in note for note in found.notes)
    assert "note: Rows contradict each other" in str(found)


def test_a_ramp_held_at_rest_is_not_taken_for_ratios_as_percent(tmp_path):
    tables = {}
    for name, table in ramps(sample_time=0.2).items():
        percent = 100.0 * (1.0 - table.pop(LENGTH) / 300.0)
        tables[name] = {**table, "contraction [%]": np.round(percent, 4)}
    with warnings.catch_warnings():
        warnings.simplefilter("error", AirmuscleWarning)
        read(write(tables, tmp_path), ColumnMapping(resting_length=RESTING_LENGTH))
        read([tmp_path / "held_0.csv"], ColumnMapping(resting_length=RESTING_LENGTH))


def test_a_repeated_run_within_the_tolerance_of_a_bench_is_no_contradiction(tmp_path):
    again = changed(sweeps(seed=30), FORCE, lambda f: 1.03 * f)
    assert "contradict" not in notes_of(
        tmp_path, sweeps() | {f"again_{n}": t for n, t in again.items()}
    )


def test_a_campaign_states_what_it_finds_in_its_static_records(tmp_path):
    runs = read_all(tmp_path, every_other(ramps(sample_time=0.2), PRESSURE, ATMOSPHERE))
    stage = fit_static_stage(classify_records(runs), NoFriction(), CreepElements(), lambda _: None)
    assert isinstance(stage, StaticStage)
    assert any("absolute and gauge pressures are mixed" in note for note in stage.data_notes)
    assert "absolute and gauge pressures are mixed" in stage.verdict
