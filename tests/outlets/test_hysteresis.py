"""From loops on a bench to a muscle file with friction in it: `airmuscle hysteresis`.

Friction that made the loops comes back through the command line, judged by the second run; where
there is none, or where only the pressure moved, nothing is written. A run that does not come back
is refused.
"""

from __future__ import annotations

import dataclasses
import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle

from airmuscle.bench import (
    ColumnMapping,
    PressurePath,
    find_holds,
    find_loops,
    fit_held_creep,
    fit_loop,
    motion_direction,
    read,
    write,
)
from airmuscle.bench.hysteresis import hysteresis_chapters, plot_loops
from airmuscle.bench.prediction import creep_force
from airmuscle.files import load, load_scenario, save
from airmuscle.files.library import PLANT_READER, Location
from airmuscle.physics import CreepElements, MaxwellSlip, Muscle
from airmuscle.recording import Recording

SLIP = MaxwellSlip((2e4, 1e4, 3e3), (3e-4, 1.2e-3, 5e-3))
TURNS = (0.02, 0.14, 0.08, 0.12, 0.05, 0.14, 0.02)
MUSCLE = "dmsp-20-300"
EXAMPLES = Path(__file__).parents[2] / "examples"
LENGTH = ("--resting-length", "300 mm")


def loop(
    path: Path, seed: int, friction: MaxwellSlip | None = SLIP, turns=TURNS, rows=150, pressure=3e5
) -> Path:
    """A loop of contraction at constant pressure with minor loops, held at its end, as the muscle
    of the library would pull.
    """
    moving = [np.linspace(a, b, rows) for a, b in itertools.pairwise(turns)]
    contraction = np.concatenate([*moving, np.full(40, turns[-1])])
    rng = np.random.default_rng(seed)
    count = contraction.size
    force = load(MUSCLE).characteristic.force(pressure, contraction) + 0.5 * rng.standard_normal(
        count
    )
    if friction is not None:
        force = force - friction.force_along((contraction - contraction[0]) * 0.3)
    columns = {
        "time": 0.2 * np.arange(count),
        "pressure": pressure + 50.0 * rng.standard_normal(count),
        "contraction": contraction,
        "force": force,
    }
    write(Recording(columns, path.name), path)
    return path


@pytest.fixture(scope="module")
def two(tmp_path_factory) -> list[Path]:
    folder = tmp_path_factory.mktemp("loops")
    return [loop(folder / f"loop{seed}.csv", seed) for seed in (1, 2)]


def test_the_friction_of_two_loops_enters_the_muscle_file(two, tmp_path):
    result = airmuscle(
        "hysteresis", *two, *LENGTH, "--muscle", MUSCLE, "--creep", "--out", tmp_path / "out"
    )
    assert result.exit_code == 0, result.stderr
    assert "loop1.csv: isobaric at 300 kPa" in result.stdout.splitlines()
    assert "The data justify this friction." in result.stdout
    entry = load(tmp_path / "out" / "muscle.toml")
    assert entry.characteristic == load(MUSCLE).characteristic
    path = np.concatenate([np.linspace(a, b, 50) for a, b in itertools.pairwise(TURNS)]) * 0.3
    made, found = (law.force_along(path - path[0]) for law in (SLIP, entry.friction))
    assert (
        np.sqrt(np.mean((made - found) ** 2)) < 0.05 * np.abs(made).max()
    )  # the grid of limits is not the true one
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert all(
        word in page
        for word in ("minor loops", "Friction laws", "MaxwellSlip", "second run at the same level")
    )
    assert "loop2.csv, force in rows 90" in page.replace("\u00a0", " ")
    shown = airmuscle("show", tmp_path / "out" / "muscle.toml")
    assert "friction IdentifiedFriction" in shown.stdout
    assert "friction.inner.stiffnesses[0]" in shown.stdout


MAXWELL = CreepElements((4e3,), (6.0,))


def crept(folder: Path) -> list[Path]:
    """A loop and a quick shortening by 5 % with a hold of 40 s, of a muscle with one Maxwell
    element.
    """
    files = []
    rng = np.random.default_rng(3)
    strokes = {
        "loop": (np.array([0.02, 0.12, 0.02]), 120, 0.2),
        "hold": (np.array([0.04, 0.09]), 5, 0.1),
    }
    for name, (turns, rows, step) in strokes.items():
        moving = [np.linspace(a, b, rows, endpoint=False) for a, b in itertools.pairwise(turns)]
        contraction = np.concatenate([np.full(20, turns[0]), *moving, np.full(400, turns[-1])])
        time = step * np.arange(contraction.size)
        run = Recording(
            {"time": time, "pressure": np.full(time.size, 3e5), "contraction": contraction},
            name,
            {"resting_length": 0.3},
        )
        force = load(MUSCLE).characteristic.force(3e5, contraction) - creep_force(MAXWELL, run)
        force = (
            force
            - SLIP.force_along((contraction - contraction[0]) * 0.3)
            + 0.2 * rng.standard_normal(time.size)
        )
        files.append(folder / f"{name}.csv")
        write(run.with_columns(force=force), files[-1])
    return files


def test_creep_elements_of_a_hold_come_back_from_a_muscle_file(tmp_path):
    recordings = read(crept(tmp_path), ColumnMapping(resting_length=0.3))
    held = fit_held_creep(recordings)
    assert "Maxwell elements of" in held.verdict
    save(dataclasses.replace(load(MUSCLE), creep=held.elements), tmp_path / "muscle.toml")
    found = load(tmp_path / "muscle.toml").muscle.creep
    assert found.stiffnesses == pytest.approx(MAXWELL.stiffnesses, rel=0.05)
    assert found.relaxation_times == pytest.approx(MAXWELL.relaxation_times, rel=0.05)


@pytest.mark.slow
def test_creep_of_holds_enters_the_muscle_file_and_its_simulation(tmp_path):
    out = tmp_path / "out"
    words = (
        "hysteresis",
        *crept(tmp_path),
        *LENGTH,
        "--muscle",
        MUSCLE,
        "--elements",
        4,
        "--creep",
        "--out",
        out,
    )
    result = airmuscle(*words, "--json")
    assert result.exit_code == 0, result.stderr
    found = load(out / "muscle.toml")
    assert found.creep.stiffnesses == pytest.approx(MAXWELL.stiffnesses, rel=0.05)
    assert found.creep.relaxation_times == pytest.approx(MAXWELL.relaxation_times, rel=0.05)
    assert [
        row["stiffness"] for row in json.loads(result.stdout)["creep"]["creep_elements"]
    ] == pytest.approx(found.creep.stiffnesses)
    path = (
        np.concatenate([np.linspace(a, b, 50) for a, b in itertools.pairwise((0.02, 0.12, 0.02))])
        * 0.3
    )
    made, friction = (law.force_along(path - path[0]) for law in (SLIP, found.friction))
    assert np.sqrt(np.mean((made - friction) ** 2)) < 0.05 * np.abs(made).max(), (
        "the creep is no friction"
    )
    scenario = (EXAMPLES / "fill_discharge.toml").read_text(encoding="utf-8")
    scenario = scenario.replace('library = "dmsp-20-300"', 'library = "out/muscle.toml"')
    (tmp_path / "scenario.toml").write_text(scenario, encoding="utf-8")
    simulated = load_scenario(tmp_path / "scenario.toml").simulate()
    assert np.abs(simulated["creep1"]).max() > 0.0


def made_hold(
    contraction: np.ndarray, force: np.ndarray, step: float = 0.1, length: float | None = 0.3
) -> Recording:
    columns = {"time": step * np.arange(force.size), "pressure": np.full(force.size, 3e5)}
    constants = {} if length is None else {"resting_length": length}
    return Recording({**columns, "contraction": contraction, "force": force}, "hold", constants)


def test_a_hold_that_determines_no_stiffness_gives_none_and_the_reason():
    seconds = 0.1 * np.arange(300)
    relaxing = 300.0 - 20.0 * np.exp(-seconds / 5.0)
    still = fit_held_creep([made_hold(np.full(300, 0.1), relaxing)])
    assert not still.elements.stiffnesses
    assert "the length does not change before the hold" in still.verdict
    creeping = 0.1 + 0.01 * (1.0 - np.exp(-seconds / 5.0))
    loaded = made_hold(np.concatenate([np.full(20, 0.04), creeping]), np.full(320, 200.0))
    assert "needs the stiffness of the muscle" in fit_held_creep([loaded]).verdict
    assert fit_held_creep([loaded], law=load(MUSCLE).characteristic).elements.stiffnesses[0] > 0.0
    slow = made_hold(
        np.concatenate([np.full(20, 0.04), np.linspace(0.04, 0.1, 25), creeping]),
        np.full(345, 200.0),
    )
    assert (
        "not short compared with the time constant"
        in fit_held_creep([slow], law=load(MUSCLE).characteristic).verdict
    )
    lengthless = made_hold(
        np.concatenate([np.full(20, 0.04), np.full(300, 0.1)]),
        np.r_[np.full(20, 400.0), relaxing],
        length=None,
    )
    assert "need the resting length" in fit_held_creep([lengthless]).verdict


def test_without_a_muscle_the_friction_stands_in_a_table_that_a_plant_takes(two, tmp_path):
    import tomllib

    result = airmuscle("hysteresis", two[0], *LENGTH, "--out", tmp_path, "--json")
    data = json.loads(result.stdout)
    assert data["files"]["friction"] == str(tmp_path / "friction.toml")
    found = data["friction"]
    assert found["recommended"] in {row["law"] for row in found["laws"]}
    assert "rms_error_on_second_run" not in found["laws"][0], "one run has no second"
    table = tomllib.loads((tmp_path / "friction.toml").read_text(encoding="utf-8"))
    muscle = PLANT_READER.build(
        {"library": MUSCLE, **table},
        Location("scenario.toml", "plant.muscle", tmp_path),
        kind=Muscle,
    )
    assert type(muscle.friction.inner).__name__ == found["recommended"]


def test_friction_that_grows_with_pressure_is_written_once_for_all_runs_and_runs_in_simulate(
    tmp_path,
):
    files = [
        loop(
            tmp_path / f"{pressure}.csv",
            3,
            MaxwellSlip((factor * 2e4, factor * 1e4), (3e-4, 1.2e-3)),
            TURNS[:3],
            110,
            pressure,
        )
        for pressure, factor in ((3e5, 1.0), (4e5, 1.25), (5e5, 1.5))
    ]
    out = tmp_path / "out"
    result = airmuscle(
        "hysteresis", *files, *LENGTH, "--muscle", MUSCLE, "--elements", 4, "--out", out
    )
    assert result.exit_code == 0, result.stderr
    assert "The data justify this friction for all runs." in result.stdout
    listed = [line for line in result.stdout.splitlines() if "isobaric at" in line]
    assert [line.split()[0] for line in listed] == [
        f"{pressure}.csv" for pressure in (3e5, 4e5, 5e5)
    ]
    assert len(result.stdout.splitlines()) < 40
    friction = load(out / "muscle.toml").friction
    assert friction.pressure_factor(3.5e5) == pytest.approx(1.125 / 1.5, abs=0.05)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Friction of all runs" in page
    assert "runs that disagree" in page
    scenario = (EXAMPLES / "fill_discharge.toml").read_text(encoding="utf-8")
    scenario = scenario.replace('library = "dmsp-20-300"', 'library = "out/muscle.toml"')
    (tmp_path / "scenario.toml").write_text(scenario, encoding="utf-8")
    run = airmuscle("simulate", tmp_path / "scenario.toml", "--out", tmp_path / "run")
    assert run.exit_code == 0, run.stderr
    assert "outside the range of the data of its friction in speed" in run.stdout


@pytest.mark.slow
def test_friction_that_does_not_hold_for_all_runs_is_not_written(tmp_path):
    files = [
        loop(
            tmp_path / f"{pressure}.csv",
            3,
            MaxwellSlip((factor * 2e4, factor * 1e4), (3e-4, 1.2e-3)),
            TURNS[:3],
            150,
            pressure,
        )
        for pressure, factor in ((3e5, 0.5), (4e5, 2.0), (5e5, 0.6))
    ]
    result = airmuscle("hysteresis", *files, *LENGTH, "--elements", 4, "--out", tmp_path / "out")
    assert "The friction does not hold for all runs" in result.stdout
    assert (
        "no friction file: no model that a plant can use is justified for all runs together"
        in result.stdout
    )
    assert not list((tmp_path / "out").glob("*.toml"))


def test_a_branch_with_very_few_rows_is_remarked_once(tmp_path):
    found = find_loops(
        [read(loop(tmp_path / "loop.csv", 1), ColumnMapping(resting_length=0.3))[0]]
    )[0]
    few = (
        np.where(
            motion_direction(found.recording["contraction"]) < 0,
            np.arange(len(found.fitted_rows)) % 60 == 0,
            True,
        )
        & found.fitted_rows
    )
    fit = fit_loop(dataclasses.replace(found, fitted_rows=few), elements=3)
    (chapter,) = hysteresis_chapters([fit])
    summary = " ".join(chapter.paragraphs)
    assert summary.count("very few rows") == 1
    assert "use all rows" not in summary


def test_a_loop_without_friction_writes_none(tmp_path):
    file = loop(tmp_path / "loop.csv", 3, friction=None, turns=TURNS[-3:])
    again = loop(tmp_path / "again.csv", 4, friction=None, turns=TURNS[-3:])
    result = airmuscle(
        "hysteresis",
        file,
        again,
        *LENGTH,
        "--muscle",
        MUSCLE,
        "--use-characteristic",
        "--out",
        tmp_path / "out",
    )
    assert "The data justify none of the laws" in result.stdout
    assert "no friction file: no model that a plant can use is justified" in result.stdout
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"report.html", "figures", "data"}


def test_friction_on_the_pressure_is_reported_and_not_written(tmp_path):
    pressure = np.concatenate([np.linspace(0.5e5, 5e5, 300), np.linspace(5e5, 0.5e5, 300)])
    rng = np.random.default_rng(5)
    force = (
        2e-3 * pressure
        - SLIP.force_along(1e-8 * (pressure - pressure[0]))
        + 0.1 * rng.standard_normal(600)
    )
    columns = {
        "time": 0.2 * np.arange(600),
        "pressure": pressure,
        "contraction": np.full(600, 0.05),
        "force": force,
    }
    write(Recording(columns, "ramp"), tmp_path / "ramp.csv")
    result = airmuscle(
        "hysteresis", tmp_path / "ramp.csv", *LENGTH, "--degree", 1, "--out", tmp_path / "out"
    )
    assert "isometric at 5 %" in result.stdout
    slightly_negative = columns | {"contraction": np.full(600, -6e-6)}
    (loop,) = find_loops([Recording(slightly_negative, "ramp", {"resting_length": 0.3})])
    assert loop.description == "isometric at 0 %"
    assert "cannot be used in a plant" in result.stdout
    assert not list((tmp_path / "out").glob("*.toml"))


def test_figures_of_it_stand_over_the_pressure():
    axes = plot_loops(SLIP, PressurePath().axis).axes[0]
    assert axes.get_xlabel() == "gauge pressure [kPa]"
    drawn = np.concatenate([line.get_xdata() for line in axes.lines])
    assert drawn.max() == pytest.approx(2.0 * SLIP.presliding_distance * 1e5, rel=1e-6), (
        "1 mm stands for 100 kPa"
    )


def test_a_second_run_at_another_level_is_a_loop_of_its_own(two):
    first, second = read(two, ColumnMapping(resting_length=0.3))
    assert [found.repeat is not None for found in find_loops([first, second])] == [True]
    other = second.with_columns(pressure=second["pressure"] + 5e4)
    assert [found.repeat for found in find_loops([first, other])] == [None, None]


@pytest.mark.parametrize(
    ("turns", "options", "message"),
    [
        (
            (0.02, 0.14),
            LENGTH,
            (
                "loop.csv: the extending branch has no rows to fit, but a loop needs both branches,"
                " contracting and extending"
            ),
        ),
        (TURNS, (), "loop.csv: friction against shortening needs the resting length"),
        (TURNS, (*LENGTH, "--muscle", "none-such"), "no muscle or law 'none-such'"),
    ],
)
def test_what_is_no_loop_is_refused(turns, options, message, tmp_path):
    file = loop(tmp_path / "loop.csv", 1, turns=turns)
    result = airmuscle("hysteresis", file, *options, "--out", tmp_path / "out")
    assert result.exit_code == 1
    assert message in result.stderr
    assert not (tmp_path / "out").exists()


def test_quick_rows_do_not_count_unless_told_to(tmp_path):
    file = loop(tmp_path / "quick.csv", 1, rows=8)
    refused = airmuscle("hysteresis", file, *LENGTH, "--out", tmp_path / "out")
    assert "are excluded: not quasi-static" in refused.stderr
    assert "--all-rows" in refused.stderr
    assert (
        airmuscle("hysteresis", file, *LENGTH, "--all-rows", "--out", tmp_path / "out").exit_code
        == 0
    )


def test_a_hold_begins_where_the_length_has_arrived(two):
    (recording,) = read(two[0], ColumnMapping(resting_length=0.3))
    (found,) = find_holds(recording)
    assert (found.interval.start, found.interval.stop, found.quantity) == (899, 940, "force")
    weight = recording.with_columns(force=np.full(len(recording), 200.0))
    assert {hold.quantity for hold in find_holds(weight)} == {"contraction"}


def test_rows_on_the_way_to_a_hold_are_none_of_it():
    """The length creeps up by 0.01 % a row, less than what counts as held, and then stands for 40
    rows.
    """
    contraction = np.concatenate([np.linspace(0.0897, 0.1, 103, endpoint=False), np.full(40, 0.1)])
    rows = {"time": 0.5 * np.arange(143), "pressure": np.full(143, 3e5), "contraction": contraction}
    force = np.linspace(100.0, 300.0, 143)
    found = max(
        find_holds(Recording({**rows, "force": force}, "hold")), key=lambda hold: len(hold.interval)
    )
    assert (found.interval.start, found.interval.stop) == (103, 143)
