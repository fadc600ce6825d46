"""One sizing names one choice: text, tables, valves, figure, scenario and JSON are the same muscle.

The first choice is that with the least value of the stated criterion, all laws of its product are
shown side by side, and no length is a mean of lengths by different laws.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from typing import Any

import pytest
from command_line import airmuscle
from widths import widened

import airmuscle as am
from airmuscle.design import (
    SORT_KEYS,
    GripperRequirement,
    JointRequirement,
    LiftRequirement,
    SizingConditions,
    SizingResult,
    size_muscles,
)
from airmuscle.design.sizing import (
    CRITERIA,
    DISAGREEMENT,
    LEAST_COVERAGE,
    STRENGTHS,
    sizing_scenario,
)
from airmuscle.report import Chapter, Table

pytestmark = pytest.mark.filterwarnings("ignore::airmuscle.core.errors.AirmuscleWarning")

REQUIREMENTS: dict[str, Any] = {
    "lift": LiftRequirement(stroke=0.040, mass=20.0),
    "joint": JointRequirement(angle=math.radians(50.0), torque=4.0),
    "light lift": LiftRequirement(stroke=0.010, mass=2.0),
    "long lift": LiftRequirement(stroke=0.150, mass=60.0),
    "heavy lift": LiftRequirement(stroke=0.040, force=2500.0),
    "spring": LiftRequirement(stroke=0.030, force=80.0, stiffness=4000.0),
    "strong joint": JointRequirement(angle=math.radians(90.0), torque=40.0, inertia=0.2),
    "lever": LiftRequirement(stroke=0.200, mass=8.0, lever=5.0),
    "gripper": GripperRequirement(opening=0.020, grip=50.0, lever=2.0),
    "weak joint": JointRequirement(angle=math.radians(20.0), torque=0.3),
}
CONDITIONS = SizingConditions(supply=6e5)


@pytest.fixture(
    scope="module",
    params=widened(REQUIREMENTS, lambda name: name in ("lift", "joint", "lever", "gripper")),
)
def sized(request) -> tuple[SizingResult, Chapter, str]:
    result = size_muscles(REQUIREMENTS[request.param], CONDITIONS)
    scenario = sizing_scenario(result.best, "scenario.toml")
    return result, result.chapter(scenario), scenario.text


def table(chapter: Chapter, name: str) -> Table:
    return next(table for table in chapter.tables if table.name == name)


def test_text_tables_valves_and_scenario_are_of_the_best_choice(sized):
    result, chapter, text = sized
    best = result.best
    assert best.size in chapter.paragraphs[0]
    products = table(chapter, "products").columns
    first = {name: column.values[0] for name, column in products.items()}
    assert (first["product"], first["number"]) == (best.product, best.total_count)
    assert (first["law"], first["nominal length"]) == (best.entry.name, best.length)
    for name in ("choices", "air"):
        columns = table(chapter, name).columns
        assert columns["nominal length"].values[0] == best.length
        assert columns["muscle"].values[0] == best.entry.name
    assert table(chapter, "valves").title.endswith(f"with {best.size}")
    scenario = tomllib.loads(text)
    assert scenario["title"].startswith(f"{best.size}{best.by_law}: ")
    muscles = scenario["plant"]["muscle"]
    for muscle in muscles if isinstance(muscles, list) else [muscles]:
        assert muscle["geometry"]["resting_length"] == pytest.approx(best.length, rel=1e-12)
    (note,) = chapter.notes
    assert f"The scenario of this choice, {best.size}, is scenario.toml" in note
    (plot,) = chapter.plots
    assert best.size in plot.draw().axes[0].get_title()


@pytest.mark.parametrize(
    "name", widened(sorted(SORT_KEYS), lambda name: name in ("area", "reserve"))
)
def test_the_stated_criterion_is_least_for_the_first_choice(name):
    sort = SORT_KEYS[name]
    result = size_muscles(REQUIREMENTS["lift"], CONDITIONS, sort=sort)
    assert CRITERIA[sort] in result.chapter().paragraphs[0]
    values = [value for choice in result.choices if (value := sort(choice)) is not None]
    assert sort(result.best) <= min(values) + 1e-6 * abs(min(values))


def test_the_mounting_area_of_the_first_row_is_the_least_of_the_table(sized):
    result, chapter, _ = sized
    assert CRITERIA[result.sort] in chapter.paragraphs[0]
    areas = table(chapter, "products").columns["mounting area"].values
    assert areas[0] <= min(areas) * (1 + 1e-6)
    for choice, area in zip(result.choices, areas, strict=True):
        assert area == pytest.approx(choice.total_count * choice.diameter * choice.length)


def test_no_length_is_a_mean_of_laws_and_laws_that_differ_are_named(sized):
    result, chapter, _ = sized
    rows = table(chapter, "laws").columns
    by_law = {
        (law.name, count): choice.length
        for law in result.laws
        for count, choice in law.choices.items()
    }
    for choice in result.choices:
        assert choice.length == by_law[choice.entry.name, choice.count]
    sides = result.best.total_count // result.best.count
    for law, number, length in zip(
        rows["law"].values, rows["number"].values, rows["nominal length"].values, strict=True
    ):
        assert length == by_law.get((law, number // sides))
    of_best = [law for law in result.laws if law.product == result.best.product]
    lengths = [
        law.choices[result.best.count].length for law in of_best if result.best.count in law.choices
    ]
    differs = max(lengths) > DISAGREEMENT * min(lengths)
    assert ("contradict each other by a factor" in chapter.paragraphs[0]) is differs
    if differs:
        longest = f"asks for {1e3 * max(lengths):.4g} mm: this choice"
        assert longest in chapter.paragraphs[0]
        falls_short = max(lengths) > result.best.length
        assert ("does not reach both end points" in chapter.paragraphs[0]) is falls_short
    for law in of_best if len(of_best) > 1 else ():
        assert law.name in chapter.paragraphs[1]


def test_the_law_that_is_used_covers_half_of_the_range_and_of_these_rests_on_most(sized):
    result, _, _ = sized
    used = {choice.product: choice.entry.name for choice in result.choices}
    for product, name in used.items():
        laws = [law for law in result.laws if law.product == product and law.coverage > 0.0]
        covering = [law for law in laws if law.coverage >= LEAST_COVERAGE] or laws
        strongest = min(STRENGTHS.index(law.strength) for law in covering)
        chosen = next(law for law in laws if law.name == name)
        assert chosen in covering
        assert STRENGTHS.index(chosen.strength) == strongest


def test_a_long_thin_muscle_is_not_first_for_a_short_stroke(sized):
    """By air alone a muscle of 25 times the stroke was first; twelve times is a contraction of 8 %,
    a third of what the makers permit.
    """
    result, _, _ = sized
    best = result.best
    if isinstance(best.requirement, JointRequirement):
        pytest.skip("the travel of a joint is a result")
    shortest = 3.0 * best.entry.ratings.diameter
    assert best.length <= max(12.0 * best.requirement.travel, 1.001 * shortest)


def test_the_makers_table_of_a_tenth_of_the_contraction_does_not_set_the_length():
    """The table of DMSP-10 covers 11 % contraction from 3 bar: a muscle by it is three times as
    long as by the measured law, because the table ends.
    """
    result = size_muscles(REQUIREMENTS["joint"], CONDITIONS)
    laws = {law.name: law for law in result.laws if law.product == "festo-dmsp-10"}
    table_of_maker = laws["festo-tool-dmsp-10"]
    assert (table_of_maker.strength, table_of_maker.coverage < 0.25) == ("maker's table", True)
    assert table_of_maker.choices[1].length > 3.0 * laws["dmsp-10-250"].choices[1].length
    assert next(iter(laws)) == "dmsp-10-250"


@pytest.mark.parametrize(
    "words",
    [
        ("--torque", "4 N m", "--angle", "50 deg", "--muscle", "dmsp-10-250", "--count", "2"),
        ("--load", "20 kg", "--stroke", "4 cm"),
    ],
    ids=["joint", "lift"],
)
def test_the_command_writes_the_choice_that_it_names(words, tmp_path):
    """JSON, report and scenario; with two muscles on each side the scenario is one of two pairs."""
    result = airmuscle("size", *words, "--supply", "6 bar", "--json", "--out", tmp_path)
    sizing = json.loads(result.stdout)["sizing"]
    row = sizing["products"][0]
    size = f"{row['number']} x {row['product']}, {1e3 * row['nominal_length']:.4g} mm"
    assert size in sizing["summary"][0]
    page = " ".join((tmp_path / "report.html").read_text(encoding="utf-8").split())
    assert f"The best choice is {size}" in page.replace("\u00a0", " ")
    scenario = am.files.load_scenario(tmp_path / "scenario.toml")
    assert scenario.title.startswith(size)
    for muscle in scenario.plant.muscles:
        assert muscle.geometry.resting_length == pytest.approx(row["nominal_length"])
    joint = scenario.plant.mechanism
    if row["number"] == 4:
        assert joint.radius == pytest.approx(row["pulley_radius"])
        half = math.radians(25.0)
        assert joint.weight_torque * math.sin(half) == pytest.approx(2.0)
    assert re.search(r"\d x \S+, [\d.]+ mm", sizing["notes"][0])[0] == size
