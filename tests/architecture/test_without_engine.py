"""What a bench needs runs on NumPy and SciPy: laws, fits and predictions load no compiler.

A process in which numba, llvmlite and casadi cannot be imported gives the same numbers.
"""

from __future__ import annotations

import json
import subprocess
import sys

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
