"""Adapters of the actuators in the released packages of mjlab, Newton and Isaac Lab: a delay of n
steps shifts the pressures by n steps, whichever way the command takes; efforts are those of the
muscles; a command that is not a number is refused, and a reset begins anew.

`./run test-tools` installs the packages, the newest that there are; frameworks.py runs in their
environment.
"""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

import frameworks
import numpy as np
import pytest

from airmuscle.files import load_scenario
from airmuscle.outlets import TorchStack, WarpStack, write_actuator

pytestmark = pytest.mark.tool
ROOT = Path(__file__).parents[2]
BIN = "Scripts/python.exe" if sys.platform == "win32" else "bin/python"
PYTHON = ROOT / ".venv-frameworks" / BIN
LIFT = load_scenario("lift-dmsp-20").plant
NAMES = ("mjlab", "newton", "isaaclab")


class Measured(NamedTuple):
    """What one framework gave, as `main` of frameworks.py prints it, and the written files."""

    result: dict
    folder: Path


def is_there(name):
    find = f"import importlib.util, sys; sys.exit(not importlib.util.find_spec({name!r}))"
    return PYTHON.exists() and not subprocess.call([PYTHON, "-c", find])


@pytest.fixture(scope="module")
def runs():
    """What was measured, by the name of the framework."""
    return {}


@pytest.fixture(params=NAMES)
def measured(request, runs, tmp_path_factory):
    name = request.param
    if not is_there(name):
        pytest.skip(f"needs the package {name} in .venv-frameworks, which ./run test-tools makes")
    if name not in runs:
        folder = tmp_path_factory.mktemp(name)
        for stack in (TorchStack(), WarpStack()):
            write_actuator(LIFT, folder, stack, name="muscle")
        command = [PYTHON, frameworks.__file__, name, folder]
        run = subprocess.run(command, capture_output=True, text=True, timeout=600)
        assert run.returncode == 0, run.stderr
        runs[name] = Measured(json.loads(run.stdout.splitlines()[-1]), folder)
    return runs[name]


@pytest.mark.parametrize("path", ["own", "target"])
def test_a_delay_of_n_steps_shifts_the_pressures_by_n_steps(measured, path):
    """By the commands of the muscles, and by the effort of the joint, which is the command of one
    muscle; exactly, because nothing else differs.
    """
    pressures = {int(n): np.array(rows) for n, rows in measured.result[path].items()}
    prompt = pressures[0]
    assert np.ptp(prompt[: frameworks.BEGIN + 1]) == 0.0
    assert (np.abs(np.diff(prompt[frameworks.BEGIN :], axis=0)) > 10.0).all(), "each step moves"
    for delay, shifted in pressures.items():
        np.testing.assert_array_equal(shifted[delay:], prompt[: frameworks.STEPS - delay])
        np.testing.assert_array_equal(shifted[:delay], np.repeat(prompt[:1], delay, axis=0))


def test_a_command_that_is_not_a_number_is_refused_and_loses_one_step(measured):
    """The step is invalid and leaves the state; all others are those of the run without it."""
    pressures, valid = measured.result["lost"]
    lost = frameworks.LOST
    assert [step for step, flag in enumerate(valid) if not flag] == [lost]
    assert np.isnan(pressures[lost]).all()
    rest = np.array(pressures[:lost] + pressures[lost + 1 :])
    usual = np.array(measured.result["own"]["0"])
    np.testing.assert_array_equal(rest[: lost + 1], usual[: lost + 1])
    assert (np.abs(np.diff(rest[lost - 1 :], axis=0)) > 10.0).all(), "the muscles go on"


def test_the_efforts_are_those_of_the_muscles(measured):
    """Sum of gear times tension of the actuator in PyTorch, muscle by muscle."""
    pytest.importorskip("torch", reason="needs the package torch")
    spec = importlib.util.spec_from_file_location("muscle", measured.folder / "muscle.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    rows = np.array(measured.result["efforts"])
    efforts = np.zeros(len(rows))
    for (gear,), offset, command in zip(
        frameworks.GEARS, frameworks.OFFSETS, frameworks.COMMANDS[0], strict=True
    ):
        actuator = module.Muscle((1,))
        state = actuator.start(frameworks.PRESSURE, offset + gear * rows[0, 0])
        for step, (position, speed, _) in enumerate(rows):
            output = actuator.compute(
                state, command, offset + gear * position, gear * speed, frameworks.DT
            )
            state = output.state
            efforts[step] -= gear * float(output.tension)
    assert np.abs(efforts).max() > 1.0
    np.testing.assert_allclose(rows[:, 2], efforts, rtol=1e-4, atol=1e-3)


def test_after_a_reset_a_muscle_starts_at_its_initial_pressure(measured):
    anew, going = measured.result["after_reset"]
    assert anew == pytest.approx([frameworks.PRESSURE] * len(anew), rel=1e-6)
    assert all(abs(pressure / frameworks.PRESSURE - 1.0) > 0.01 for pressure in going)


@pytest.mark.parametrize("measured", ["isaaclab"], indirect=True)
def test_isaac_lab_limits_the_effort_by_the_name_of_its_release(measured):
    greatest, *messages = measured.result["messages"]
    assert greatest == pytest.approx(0.5)
    assert messages == []


@pytest.mark.parametrize("measured", ["newton"], indirect=True)
def test_what_newton_would_drop_is_taken_or_refused(measured):
    """`initial_pressure` and `max_delay` of add_actuator arrive; a delay that would not act, and a
    command for another number of muscles, are errors with their remedy.
    """
    refused_delay, refused_size = measured.result["messages"]
    assert "delay_steps does not delay muscle_command; give the drive max_delay" in refused_delay
    assert "muscle_command has 1 elements; assign an array of 2" in refused_size
    assert measured.result["own"]["0"][0] == [frameworks.PRESSURE] * 2
