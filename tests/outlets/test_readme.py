"""What the README and the page of commands show is what runs; the files that the README points to
are there.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import airmuscle

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")


COMMANDS = (ROOT / "docs" / "tutorials/commands.md").read_text(encoding="utf-8")


def blocks(language, text=README):
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


def test_six_lines_of_python_print_what_the_page_shows(tmp_path):
    (block,) = blocks("python")
    assert len([line for line in block.splitlines() if line]) <= 6
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", block], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    (shown,) = blocks("text")
    assert done.stdout == shown


def commands():
    lines = [
        line.partition("#")[0].strip()
        for block in blocks("sh", COMMANDS)
        for line in block.replace("\\\n", " ").splitlines()
    ]
    served = "./run airmuscle studio"  # a server, which the tests of the studio start
    return [line for line in lines if line.startswith("./run airmuscle") and line != served]


@pytest.mark.parametrize(
    "command",
    [pytest.param(each, marks=[pytest.mark.slow] * (" study " in each)) for each in commands()],
    ids=lambda words: words,
)
def test_the_commands_run(command, tmp_path, monkeypatch):
    words = shlex.split(command)[2:]
    words = [str(ROOT / word) if word.startswith("examples/") else word for word in words]
    monkeypatch.chdir(tmp_path)
    done = airmuscle(*words)
    assert done.exit_code == 0, done.stderr


def test_the_files_it_points_to_are_there():
    for target in re.findall(r"\]\(([^)]+)\)", README):
        assert (ROOT / target).exists(), target


TOOLS = {
    "Simulink, Dymola, OpenModelica and other importers of FMUs": ("test_export_fmu", "fmpy"),
    "MuJoCo": ("test_export_mujoco", "mujoco"),
    "MuJoCo, ROS": ("test_robot_description", "mujoco"),
    "C and C++": ("test_export_loop", "g++"),
    "microcontrollers": ("test_export_controller", "program"),  # compiler and QEMU
    "browsers and Node": ("test_export_loop", "node"),
    "MATLAB and Octave": ("test_export_loop", "octave-cli"),
    "pandas, xarray, Parquet, HDF5 (extra `lab`)": ("test_exchange", "xarray"),
    "ROS 1 and 2": ("test_rosbag", "rosbags"),
    "Modelica tools": ("test_export_modelica", "rumoca"),
    "python-control": ("../dynamics/test_linearise", "control"),
    "JAX": ("test_jax", "jax"),
    "PyTorch, mjlab, Isaac Lab": ("test_actuators", "torch"),
    "Warp, Newton": ("test_frameworks", "newton"),
    "ONNX Runtime": ("test_actuators", "onnxruntime"),
}
"""The test of each way into a tool, and the program or package that it needs."""


def test_each_way_into_a_tool_has_a_test_in_it():
    table = README.partition("| tool | way |")[2].partition("\n\n")[0]
    rows = re.findall(r"^\| ([^|]+) \|", table.partition("|---|---|")[2], flags=re.MULTILINE)
    assert rows == list(TOOLS)
    for row, (file, tool) in TOOLS.items():
        text = (Path(__file__).parent / f"{file}.py").read_text(encoding="utf-8")
        asked = rf'(importorskip|require|NAMES = )\([^)]*["\']{re.escape(tool)}'
        needed = re.search(asked, text)
        assert needed or (f"require({tool})" in text), row
