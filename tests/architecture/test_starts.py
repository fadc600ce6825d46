"""Start of a process: heavy modules are imported only where they are used.

The target for the first result is 0.7 s (benchmarks/startup.py); the modules checked here do not
depend on the machine.
"""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from pathlib import Path

import pytest

import airmuscle as am
from airmuscle.errors import ParameterError

HEAVY = {
    *("numba", "scipy", "pandas", "pint", "matplotlib", "jinja2", "rich", "yaml", "jax"),
    "casadi",
}
FITS = {
    f"airmuscle.bench.{room}"
    for room in (
        "campaign",
        "prediction",
        "statics",
        "hysteresis",
        "dynamics",
        "diagnosis",
        "estimation",
    )
}
SIMULATION = """
import airmuscle as am
valve = am.Valve(conductance=1e-9, critical_ratio=0.4)
plant = am.Plant(am.load("dmsp-20-300").muscle, am.FillDischarge(am.Supply(6e5), valve, valve), am.HangingMass(10.0))
for method in (am.Rodas4(), am.RungeKutta4(1e-3)):
    am.simulate(plant, am.Schedule({"fill": ((0.5, 1),)}), duration=2.0, integrator=method)
"""
STARTS = {
    "import airmuscle": (
        "import airmuscle",
        {*HEAVY, *FITS, "llvmlite", "numpy.ma"},
    ),
    "simulate": (
        SIMULATION,
        {*HEAVY, *FITS, "numpy.ma", "airmuscle.engine.compile.kernels.rodas4"},
    ),
    "airmuscle list": (
        "from airmuscle.outlets.cli import app\napp(['list'], standalone_mode=False)",
        {*HEAVY, "llvmlite", "numpy", "airmuscle.physics", "airmuscle.core.units"},
    ),
    "airmuscle evaluate": (
        (
            "from airmuscle.outlets.cli import app\napp(['evaluate', 'chou-hannaford',"
            " '--pressure', '3 bar', '--force', '100 N'], standalone_mode=False)"
        ),
        {
            *HEAVY,
            *FITS,
            *("llvmlite", "airmuscle.bench.readers.formats.format_table"),
            "airmuscle.engine.compile.program",
        },
    ),
    "airmuscle convert": (
        "from airmuscle.outlets.cli import app\napp(['convert', '--help'], standalone_mode=False)",
        HEAVY | FITS - {"airmuscle.bench.diagnosis"} | {"airmuscle.physics"},
    ),
}


@pytest.mark.parametrize("start", STARTS)
def test_a_process_does_not_import_modules_that_it_does_not_need(start):
    code, absent = STARTS[start]
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", f"{code}\nimport sys; print(*sys.modules)"],
            capture_output=True,
            text=True,
            timeout=60,
        )
        assert done.returncode == 0, done.stderr
        if "compiling" not in done.stderr:  # otherwise the second run uses the kernel cache
            break
    assert absent & set(done.stdout.splitlines()[-1].split()) == set()


def test_names_that_are_imported_on_use_are_available():
    assert am.fit is am.bench.fit
    assert am.fit.__wrapped__ is sys.modules["airmuscle.bench.statics"].fit
    assert am.Fit is sys.modules["airmuscle.bench.statics"].Fit
    assert am.bench is sys.modules["airmuscle.bench"]
    assert {"fit", "Fit"} <= set(dir(am))
    with pytest.raises(AttributeError, match="module 'airmuscle' has no attribute 'fitt'"):
        am.fitt  # noqa: B018
    with pytest.raises(
        AttributeError, match=r"no attribute 'load_scenario'; it is in airmuscle\.files$"
    ):
        am.load_scenario  # noqa: B018


LINES = {
    "list": (("list",), 3_000),
    "evaluate": (
        ("evaluate", "chou-hannaford", "--pressure", "3 bar", "--force", "100 N"),
        10_900,
    ),
    "evaluate a law of measurements": (
        ("evaluate", "dmsp-20-300", "--pressure", "3 bar", "--force", "100 N"),
        11_050,
    ),
    "fit": (("fit", "dmsp-20-300", "--characteristic", "dmsp-20-300", "--out", "fit"), 35_000),
}
"""Commands, and the lines of source that each loads at most; these bounds may only be lowered."""
COUNT = """
import sys
from pathlib import Path
from airmuscle.outlets.cli import app
app(sys.argv[1:], standalone_mode=False)
modules = [m for name, m in sys.modules.items() if name.split(".")[0] == "airmuscle"]
files = {m.__file__ for m in modules if getattr(m, "__file__", None)}
print(sum(len(Path(file).read_text(encoding="utf-8").splitlines()) for file in files))
"""


@pytest.mark.parametrize("command", LINES)
def test_a_command_loads_few_lines_of_source(command: str, tmp_path: Path):
    arguments, most = LINES[command]
    done = subprocess.run(
        [sys.executable, "-c", COUNT, *arguments], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert int(done.stdout.split()[-1]) <= most


def test_a_muscle_is_loaded_without_readers_of_measurements():
    code = "import airmuscle as am\nam.load('dmsp-20-300')\nimport sys; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    readers = {
        name
        for name in done.stdout.split()
        if name.startswith(("airmuscle.bench.readers.formats", "airmuscle.recording.columns"))
        or name == "airmuscle.bench.readers.tables.mapping"
    }
    assert done.returncode == 0, done.stderr
    assert readers == set()


@pytest.mark.parametrize(
    "part",
    [
        *("spring", "damper", "friction", "wall", "series", "stop", "creep"),
        *("ratings", "uncertainty", "error_band"),
    ],
)
def test_the_type_of_a_part_of_an_entry_is_known_though_it_is_imported_on_use(part: str):
    with pytest.raises(ParameterError, match=f"Entry: {part} must be an instance of .*; it is 3"):
        dataclasses.replace(am.load("dmsp-20-300"), **{part: 3})
