"""What a bench needs runs on NumPy and SciPy: laws, fits and predictions load no compiler.

A process in which numba, llvmlite and casadi cannot be imported gives the same numbers.
"""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

import pytest

COMPILERS = ("numba", "llvmlite", "casadi")
WORK = """
import json, sys, warnings
warnings.simplefilter("ignore")
for name in sys.argv[1:]:
    sys.modules[name] = None  # an import of it is then an ImportError
import numpy as np
import airmuscle as am
from airmuscle.core import autodiff
law = am.load("dmsp-20-300").characteristic
bench = am.load_data("dmsp-20-300")
fit = am.fit(law, bench)
print(json.dumps({
    "force": law.force(3e5, 0.1),
    "inverse": float(law.contraction(3e5, 200.0)),
    "slope": autodiff.derivative(law, "force", 3e5, 0.1, wrt=1),
    "slopes at points": np.sum(autodiff.jacobian(law, "force", np.linspace(1e5, 5e5, 60), 0.1)[1]),
    "fitted force": float(fit.model.force(3e5, 0.1)),
}))
"""


def numbers(*without: str) -> dict[str, float]:
    command = [sys.executable, "-c", WORK, *without]
    process = subprocess.run(command, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr[-2000:]
    return json.loads(process.stdout)


def test_laws_slopes_and_fits_need_no_compiler():
    assert numbers(*COMPILERS) == pytest.approx(numbers(), rel=1e-12)


FURTHER = """
import tempfile
import numpy as np
import airmuscle as am
from airmuscle.bench import FixedCharacteristic, fit_hysteresis
from airmuscle.physics.muscle import compute_isobars
from airmuscle.report import write_report
law = am.load("dmsp-20-300").characteristic
time = np.linspace(0.0, 20.0, 401)
contraction = 0.1 + 0.05 * np.sin(0.2 * np.pi * time)
pressure = np.full_like(time, 3e5)
rubbed = law.force(pressure, contraction) - 15.0 * np.tanh(np.gradient(contraction, time) / 0.002)
loop = am.Recording(
    {"time": time, "pressure": pressure, "contraction": contraction, "force": rubbed}, "a loop",
    constants={"resting_length": 0.3},
)
friction = fit_hysteresis(am.friction.Dahl(1e4, 10.0), loop, static_curve=FixedCharacteristic(law))
with tempfile.TemporaryDirectory() as folder:
    page = write_report([friction.chapter()], folder).read_text(encoding="utf-8")
results = {
    "friction": friction.rmse,
    "isobars": float(np.nansum(compute_isobars(law).forces)),
    "figures": page.count("<figure"),
}
"""


SIZING = """
from airmuscle.design import LiftRequirement, SizingConditions, size_muscles
conditions = SizingConditions(supply=6e5, max_length=0.4)
choice = size_muscles(LiftRequirement(stroke=0.04, mass=20.0), conditions).best
results = {"length": choice.length, "count": choice.count, "air": choice.air}
"""


@pytest.mark.parametrize(
    "work",
    [
        pytest.param(FURTHER, id="friction, figures and a report"),
        pytest.param(SIZING, id="sizing", marks=pytest.mark.slow),
    ],
)
def test_further_work_of_a_bench_needs_no_compiler(work: str):
    blocked = f"import json, sys\nfor name in sys.argv[1:]:\n    sys.modules[name] = None\n{work}"
    command = [sys.executable, "-c", f"{blocked}\nprint(json.dumps(results))", *COMPILERS]
    process = subprocess.run(command, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr[-2000:]
    scope: dict[str, Any] = {}
    exec(work, scope)
    assert json.loads(process.stdout) == pytest.approx(scope["results"], rel=1e-12)
    assert all(scope["results"].values())


CALLS = """
import sys
for name in ("numba", "llvmlite"):
    sys.modules[name] = None
import numpy as np
import airmuscle as am
from airmuscle.engine import simulate_batch
from airmuscle.errors import AirmuscleError
from airmuscle.physics import find_equilibrium, linearise
valve = am.Valve(conductance=1e-9, critical_ratio=0.4)
circuit = am.FillDischarge(am.Supply(6e5), valve, valve)
plant = am.Plant(am.load("dmsp-20-300").muscle, circuit, am.HangingMass(10.0))
inputs = am.Schedule({"fill": ((0.5, 1),)})
for call in (
    lambda: am.simulate(plant, inputs, duration=1.0),
    lambda: simulate_batch(plant, {"mechanism.mass": [5.0, 6.0]}, inputs, duration=1.0),
    lambda: find_equilibrium(plant, pressure=2e5),
    lambda: linearise(plant, {state.name: state.nominal for state in plant.states}),
):
    try:
        call()
    except AirmuscleError as error:
        print(type(error).__name__, error)
    else:
        print("no error")
"""


def test_python_calls_that_need_the_engine_say_what_to_install():
    done = subprocess.run([sys.executable, "-c", CALLS], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    sentence = (
        "MissingPackageError simulation needs the engine, the packages numba and llvmlite, which"
        ' are not both installed; install them: pip install "airmuscle[sim]"'
    )
    assert done.stdout.splitlines() == [sentence] * 4


BROKEN = """
import sys
class Broken:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == sys.argv[1]:
            raise ImportError("needs NumPy 2.3 or less")
sys.meta_path.insert(0, Broken())
from airmuscle.engine.compile.llvm import engine_packages
from airmuscle.errors import MissingPackageError
call = {"numba": engine_packages.numba_module, "llvmlite": engine_packages.llvm_binding}
try:
    call[sys.argv[1]]()
except MissingPackageError as error:
    print(error)
"""


@pytest.mark.parametrize("package", ["numba", "llvmlite"])
def test_an_engine_that_does_not_start_states_its_reason(package: str):
    done = subprocess.run([sys.executable, "-c", BROKEN, package], capture_output=True, text=True)
    assert "which do not start (needs NumPy 2.3 or less); install them: pip" in done.stdout
