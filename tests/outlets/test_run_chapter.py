"""The chapter of a run describes the inputs in one line, whatever their length, and plots them with
their steps.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from airmuscle.engine import PWM, Periodic, SampledSignal, Schedule, WithDrivers
from airmuscle.files import load_scenario, run_chapter
from airmuscle.files.scenario import MAX_DRIVER_SEGMENTS, describe_input

EXAMPLE = Path(__file__).parents[2] / "examples" / "fill_discharge.toml"


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (Schedule({}), "none"),
        (
            Schedule({"fill": ((5, 1), (15, 0)), "discharge": ((19, 1),)}),
            "fill 0 before 5 s, 1 from 5 s, 0 from 15 s; discharge 0 before 19 s, 1 from 19 s",
        ),
        (SampledSignal({"fill": ((0, 0), (2, 0.5))}), "fill 0 at 0 s, 0.5 at 2 s"),
        (
            Schedule({"fill": tuple((i, i % 2) for i in range(1000))}),
            "fill: 1000 values between 0 and 1, 0 to 999 s",
        ),
        (
            Periodic(Schedule({"fill": ((1, 1),)}), 2.0),
            "periodic, 2 s: fill 0 before 1 s, 1 from 1 s",
        ),
        (
            WithDrivers(Schedule({"fill": ((1, 0.5),)}), {"fill": PWM(50.0)}),
            (
                "fill 0 before 1 s, 0.5 from 1 s; drivers: fill: PWM(frequency=50.0,"
                " smallest_pulse=0.0)"
            ),
        ),
    ],
)
def test_an_input_is_described_in_one_sentence(command, words: str):
    assert describe_input(command) == words


def drawn(command, duration: float):
    scenario = load_scenario(EXAMPLE)
    scenario = replace(
        scenario, problem=replace(scenario.problem, input=command, duration=duration)
    )
    plot = run_chapter(scenario, scenario.simulate()).plots[-1]
    return plot, {line.get_label(): line.get_xydata() for line in plot.draw().axes[0].lines}


def test_a_jump_is_upright():
    plot, lines = drawn(Schedule({"fill": ((0.1, 1), (0.2, 0))}), 0.3)
    assert plot.caption == "Inputs applied to the plant."
    assert lines["applied input"].tolist() == [
        [0, 0],
        [0.1, 0],
        [0.1, 1],
        [0.2, 1],
        [0.2, 0],
        [0.3, 0],
    ]


def test_the_beginning_of_a_long_input_is_plotted_with_the_command_of_its_driver():
    command = WithDrivers(Schedule({"fill": ((0.0, 0.5),)}), {"fill": PWM(1000.0)})
    plot, lines = drawn(command, 0.5)
    assert (
        plot.caption
        == "Inputs applied to the plant (first 300 segments); dashed: commands to the drivers."
    )
    applied = lines["applied input"]
    commanded = lines["command"]
    assert applied[-1, 0] == commanded[-1, 0] == pytest.approx(MAX_DRIVER_SEGMENTS * 0.5e-3)
    assert np.array_equal(commanded[:, 1], [0.5, 0.5])


def test_a_run_that_ended_at_once_still_shows_what_was_commanded():
    scenario = load_scenario(EXAMPLE)
    run = scenario.simulate()
    chapter = run_chapter(scenario, run.rows(slice(0, 1)))
    assert chapter.summary.startswith(
        "Simulation of 25 s, ended early at 0 s; the last note gives the reason."
    )
    assert chapter.plots[-1].draw().axes[0].lines[0].get_xdata()[-1] == 25.0


def test_a_setting_that_the_scenario_does_not_state_has_the_source_default(tmp_path):
    lines = EXAMPLE.read_text(encoding="utf-8").splitlines()
    for name, added in (
        ("plain", []),
        ("stated", ['initial_state = { pressure = "1 bar" }', 'integrator = "Rodas4"']),
    ):
        place = lines.index("[run]") + 1
        (tmp_path / f"{name}.toml").write_text(
            "\n".join([*lines[:place], *added, *lines[place:]]), encoding="utf-8"
        )
        scenario = load_scenario(tmp_path / f"{name}.toml")
        sources = {
            what: source for what, _, source in run_chapter(scenario, scenario.simulate()).chosen
        }
        state = "scenario" if added else "default: equilibrium at ambient pressure"
        integrator = "scenario" if added else "default"
        assert sources == {
            "integrator": integrator,
            "initial state (SI)": state,
            "inputs": "scenario",
        }


JOINT = """
[[plant.muscle]]
library = "dmsp-20-300"
name = "left"
[[plant.muscle]]
library = "dmsp-20-300"
name = "right"
[[plant.circuit]]
model = "ClosedChamber"
[[plant.circuit]]
model = "ClosedChamber"
[plant.mechanism]
model = "AntagonisticJoint"
radius = "40 mm"
inertia = 0.05
offset = 0.1
[input]
[run]
duration = "10 ms"
initial_state = { pressure = "2 bar" }
"""


def test_a_joint_has_one_panel_for_each_quantity_with_the_angle_and_its_speed_after_those_of_the_muscles(
    tmp_path,
):
    (tmp_path / "joint.toml").write_text(JOINT, encoding="utf-8")
    scenario = load_scenario(tmp_path / "joint.toml")
    axes = run_chapter(scenario, scenario.simulate()).plots[0].draw().axes
    names = [axis.get_ylabel().partition("\n")[0] for axis in axes]
    assert names == ["pressure", "contraction", "force", "angle", "angular speed"]
    assert [len(axis.get_lines()) for axis in axes] == [2, 2, 2, 1, 1]
