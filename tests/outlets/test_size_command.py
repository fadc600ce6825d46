"""`airmuscle size`: table, JSON, report and a scenario that `airmuscle simulate` runs and that
reaches both ends.
"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from command_line import airmuscle
from widths import widened

import airmuscle as am
from airmuscle.design import (
    GripperRequirement,
    JointRequirement,
    LiftRequirement,
    SizingConditions,
    choose,
    scenario_text,
)
from airmuscle.design.sizing import MOVING, RESTING, air_path
from airmuscle.files import load_scenario

LIFT = ("size", "--load", "20 kg", "--stroke", "40 mm", "--supply", "6 bar")
ONE = ("--muscle", "dmsp-20-300", "--max-count", "1")
CONDITIONS = SizingConditions(supply=6e5)


def simulate(text: str, folder: Path) -> am.Recording:
    file = folder / "scenario.toml"
    file.write_text(text, encoding="utf-8")
    return load_scenario(file).simulate()


# The scenario


@pytest.mark.parametrize(
    ("requirement", "count", "name"),
    [
        (LiftRequirement(stroke=0.04, mass=20.0), 1, "dmsp-20-300"),
        (LiftRequirement(stroke=0.04, mass=20.0), 2, "dmsp-10-250"),
        (LiftRequirement(stroke=0.03, force=80.0, stiffness=4000.0), 1, "dmsp-20-300"),
        (LiftRequirement(stroke=0.03, force=150.0), 1, "dmsp-20-300"),
        (LiftRequirement(stroke=0.08, mass=10.0, lever=2.0), 1, "dmsp-20-300"),
        (GripperRequirement(opening=0.03, grip=60.0), 1, "dmsp-20-300"),
    ],
)
def test_the_lift_of_the_scenario_reaches_both_ends_of_the_stroke(
    requirement, count, name, tmp_path
):
    choice = choose(am.load(name), requirement, CONDITIONS, count)
    run = simulate(scenario_text(choice), tmp_path)
    cycle = CONDITIONS.cycle_time
    position = run["position"] - choice.design.extended.contraction * choice.length
    end_of_rest = np.interp((2 * RESTING + MOVING) * cycle, run["time"], position)
    assert end_of_rest == pytest.approx(requirement.travel, rel=0.02)
    assert np.interp(RESTING * cycle, run["time"], position) == pytest.approx(
        0.0, abs=1e-6 * requirement.travel
    )
    assert position[-1] == pytest.approx(0.0, abs=0.02 * requirement.travel)
    assert position.max() < 1.02 * requirement.travel
    warm = simulate(scenario_text(choice).replace("Isothermal", "WallHeatTransfer"), tmp_path)[
        "position"
    ]
    further = (warm.max() - choice.design.extended.contraction * choice.length) / requirement.travel
    assert 1.03 < further < 1.06, "as the scenario states of the default gas"


@pytest.mark.parametrize("name", ["festo-tool-dmsp-20", "festo-tool-dmsp-40"])
def test_the_lift_of_a_table_reaches_the_end_of_the_stroke(name, tmp_path):
    """The law of the scenario is a polynomial of the table: its error is stated, and small."""
    choice = choose(am.load(name), LiftRequirement(stroke=0.04, mass=20.0), CONDITIONS)
    text = scenario_text(choice)
    error = float(re.search(r"error of at most about (\S+) N", text)[1])
    assert error < 0.02 * float(choice.muscle.capacity(choice.design.extended.contraction))
    position = simulate(text, tmp_path)["position"]
    start = choice.design.extended.contraction * choice.length
    assert position.max() - start == pytest.approx(0.04, rel=0.02)
    assert position[0] == pytest.approx(start, abs=1e-9)


def test_a_fill_through_the_sized_valve_takes_its_part_of_the_cycle(tmp_path):
    choice = choose(am.load("dmsp-20-300"), LiftRequirement(stroke=0.04, mass=20.0), CONDITIONS)
    run = simulate(scenario_text(choice), tmp_path)
    filled = (
        np.interp((RESTING + MOVING) * CONDITIONS.cycle_time, run["time"], run["air_mass"])
        - run["air_mass"][0]
    )
    assert filled == pytest.approx(choice.air, rel=0.02)


@pytest.mark.parametrize(
    ("name", "count"), [("dmsp-20-300", 1), ("dmsp-20-300", 2), ("festo-tool-dmsp-40", 1)]
)
def test_the_joint_of_the_scenario_reaches_both_ends_of_the_angle(name, count, tmp_path):
    """One of two equal pairs with half the torque and the inertia as well."""
    requirement = JointRequirement(angle=math.radians(60.0), torque=5.0, inertia=0.05)
    choice = choose(am.load(name), requirement, CONDITIONS, count)
    run = simulate(scenario_text(choice), tmp_path)
    cycle = CONDITIONS.cycle_time
    at = [
        np.interp(part * cycle, run["time"], run["angle"])
        for part in (0.99 * (1 - MOVING), 1 + MOVING)
    ]
    assert at == pytest.approx([requirement.angle / 2, -requirement.angle / 2], rel=0.01)


def test_a_scenario_states_what_is_chosen():
    text = scenario_text(
        choose(am.load("dmsp-20-300"), LiftRequirement(stroke=0.03, force=150.0), CONDITIONS)
    )
    comments = " ".join(line for line in text.splitlines() if line.startswith("#"))
    for chosen in ("critical pressure ratio", "isothermal air", "damper", "moving mass"):
        assert chosen in comments


# The command


def test_the_command_writes_a_report_and_a_scenario_that_runs(tmp_path):
    folder = tmp_path / "lift"
    result = airmuscle(*LIFT, *ONE, "--out", folder)
    assert result.exit_code == 0, result.output
    written = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    assert {
        "report.html",
        "scenario.toml",
        "data/choices.csv",
        "figures/working_points.png",
    } <= written
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "Force of one festo-dmsp-20 by the law dmsp-20-300" in page
    assert "scenario.toml" in page
    run = load_scenario(folder / "scenario.toml").simulate()
    assert np.ptp(run["position"]) == pytest.approx(0.04, rel=0.02)


def test_json_contains_the_choices_in_si_units():
    found = json.loads(airmuscle(*LIFT, *ONE, "--json").stdout)["sizing"]
    choice = choose(am.load("dmsp-20-300"), LiftRequirement(stroke=0.04, mass=20.0), CONDITIONS)
    (row,) = found["choices"]
    assert row["nominal_length"] == choice.length
    assert row["pressure_short"] == pytest.approx(choice.design.contracted.pressure, abs=1e-8)
    assert found["air"][0]["air_a_cycle"] == choice.reference_volume
    assert found["units"]["choices.nominal_length"] == "m"
    assert found["units"]["air.air_a_cycle"] == "m3 (ANR)"


def test_the_table_names_choices_and_reasons():
    result = airmuscle(
        *LIFT, "--muscle", "dmsp-20-300", "--muscle", "festo-tool-dmsp-10", "--max-length", "300 mm"
    )
    assert re.search(r"festo-dmsp-20 +1 +220\.6 .* 1\.22 to 5\.13", result.output), result.output
    assert re.search(
        r"festo-tool-dmsp-10 .*with 300 mm, the stroke needs a contraction of", result.output
    )


def test_the_number_of_muscles_can_be_given():
    found = json.loads(airmuscle(*LIFT, "--muscle", "dmsp-20-300", "--count", "2", "--json").stdout)
    assert [row["number"] for row in found["sizing"]["choices"]] == [2]


def test_a_joint_is_sized_with_its_radius():
    result = airmuscle("size", "--torque", "5 N m", "--angle", "60 deg", "--supply", "6 bar", *ONE)
    assert "radius [mm]" in result.output
    assert result.exit_code == 0


def test_a_law_without_geometry_gives_a_report_without_a_scenario(tmp_path):
    light = ("size", "--load", "60 N", "--stroke", "20 mm", "--supply", "4 bar")
    result = airmuscle(*light, "--muscle", "hunt2017-festo-10", "--out", tmp_path)
    assert result.exit_code == 0
    assert (
        "No scenario is written: hunt2017-festo-10: the enclosed volume is not known"
        in result.output
    )
    assert (tmp_path / "report.html").exists()
    assert not (tmp_path / "scenario.toml").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("--load", "-20 kg", "--stroke", "40 mm", "--supply", "6 bar"),
            r"mass .* is -20 kg; allowed range: 0 to",
        ),
        (
            ("--load", "20 kg", "--stroke", "0 mm", "--supply", "6 bar"),
            r"stroke\) is 0 m; allowed range: 0\.0001 to 10",
        ),
        (
            ("--load", "nan kg", "--stroke", "40 mm", "--supply", "6 bar"),
            "--load: 'nan kg' is not a number",
        ),
        (
            ("--load", "20 mm", "--stroke", "40 mm", "--supply", "6 bar"),
            "A load is a mass or a force: '20 kg' or",
        ),
        (("--load", "20", "--stroke", "40 mm", "--supply", "6 bar"), "has no unit"),
        (("--load", "20 kg", "--stroke", "40 kg", "--supply", "6 bar"), "--stroke"),
        (("--load", "20 kg", "--stroke", "40 mm", "--supply", "6 mm"), "--supply"),
        (
            ("--load", "20 kg", "--stroke", "40 mm", "--supply", "9 bar", *ONE),
            "exceeds the permitted 6 bar; reduce it",
        ),
        (
            ("--load", "20 kg", "--stroke", "40 mm", "--supply", "6 bar", "--safety", "nan"),
            "--safety: 'nan' is not a number",
        ),
        (
            ("--load", "20 kg", "--stroke", "40 mm", "--supply", "6 bar", "--safety", "0.5"),
            "allowed range: 1.05 to 20",
        ),
        (
            ("--load", "20 kg", "--stroke", "40 mm", "--supply", "6 bar", "--max-count", "0"),
            "max_count is 0",
        ),
        (
            ("--load", "20 kg", "--stroke", "40 mm", "--supply", "6 bar", "--muscle", "dmsp-30"),
            "no muscle or law",
        ),
        (
            (
                "--load",
                "20 kg",
                "--stroke",
                "40 mm",
                "--supply",
                "6 bar",
                "--muscle",
                "festo-dmsp-20",
            ),
            "is a product",
        ),
        (
            ("--load", "900 kg", "--stroke", "40 mm", "--supply", "6 bar", *ONE),
            "Reachable: .* over 40 mm",
        ),
        (
            ("--torque", "0 N m", "--angle", "60 deg", "--supply", "6 bar"),
            "torque of the load is 0 N m",
        ),
        (
            ("--torque", "5 N m", "--angle", "600 deg", "--supply", "6 bar"),
            "allowed range: 0.001 to 6",
        ),
        (("--torque", "5 N", "--angle", "60 deg", "--supply", "6 bar"), "--torque"),
    ],
)
def test_a_request_that_cannot_be_met_is_one_line_and_writes_nothing(arguments, message, tmp_path):
    folder = tmp_path / "out"
    result = airmuscle("size", *arguments, "--out", folder)
    assert result.exit_code == 1, result.output
    (line,) = [line for line in result.stderr.splitlines() if not line.startswith("warning: ")]
    assert re.match(f"error: .*{message}", line), line
    assert not folder.exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ("--supply", "6 bar"),
        ("--load", "20 kg", "--supply", "6 bar"),
        ("--load", "20 kg", "--stroke", "40 mm"),
        (
            "--load",
            "20 kg",
            "--stroke",
            "40 mm",
            "--torque",
            "5 N m",
            "--angle",
            "60 deg",
            "--supply",
            "6 bar",
        ),
        ("--stiffness", "2 N/mm", "--torque", "5 N m", "--angle", "60 deg", "--supply", "6 bar"),
        ("--grip", "50 N", "--supply", "6 bar"),
        ("--grip", "50 N", "--opening", "2 cm", "--load", "2 kg", "--supply", "6 bar"),
        ("--torque", "5 N m", "--angle", "60 deg", "--lever", "2", "--supply", "6 bar"),
        (*LIFT[1:], "--sort", "price"),
    ],
)
def test_wrong_usage_is_exit_code_2(arguments):
    result = airmuscle("size", *arguments)
    assert result.exit_code == 2
    assert "Usage: " in result.stderr


def test_an_equal_force_at_both_ends_is_one_number():
    arguments = [
        "size",
        "--load",
        "40 kg",
        "--stroke",
        "60 mm",
        "--supply",
        "6 bar",
        "--muscle",
        "dmsp-20-300",
    ]
    result = airmuscle(*arguments, width=200)
    assert result.exit_code == 0, result.output
    assert "392" in result.stdout
    assert "392 to 392" not in result.stdout


def test_a_valve_of_the_library_reaches_the_cycle_time_if_it_fills_and_discharges_in_it():
    """The time of a fill is that of a simulated one; a valve that is too small is not among the
    suitable ones.
    """
    fast, slow = (
        json.loads(airmuscle(*LIFT, *ONE, "--cycle-time", time, "--json").stdout)["sizing"][
            "valves"
        ]
        for time in ("0.6 s", "4 s")
    )
    reaching = [
        {row["valve"] for row in rows if row["reaches_the_cycle_time"]} for rows in (fast, slow)
    ]
    assert reaching[0] < reaching[1]
    row = next(row for row in slow if row["valve"] == "matrix-821")
    choice = choose(am.load("dmsp-20-300"), LiftRequirement(stroke=0.04, mass=20.0), CONDITIONS)
    path = air_path(choice)
    assert row["fills_in"] == pytest.approx(path.time(am.load("matrix-821").valve, filling=True))
    assert (row["conductance"], row["warning"]) == (am.load("matrix-821").valve.conductance, "")
    assert max(row["fills_in"], row["discharges_in"]) < MOVING * 4.0


@pytest.mark.parametrize("width", widened([90, 100], lambda width: width == 90))
def test_no_heading_and_no_number_of_the_table_is_broken(width):
    words = [
        "size",
        "--load",
        "20 kg",
        "--stroke",
        "40 mm",
        "--supply",
        "6 bar",
        "--max-length",
        "400 mm",
    ]
    lines = airmuscle(*words, width=width).stdout.splitlines()
    start = lines.index("Products, best first") + 1
    table = lines[start : lines.index("", start)]
    assert max(map(len, table)) <= width
    head = " ".join(table[:3])
    assert all(word in head.split() for word in ("length", "pressure", "reserve", "air"))
    assert any(line.split()[-1] == "20.5" for line in table)
