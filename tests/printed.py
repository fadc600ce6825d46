"""Printed programs, built and called: C as a shared library, JavaScript in Node, MATLAB text in
Octave.
"""

from __future__ import annotations

import ctypes
import json
import shutil
import subprocess

import numpy as np
import pytest

from airmuscle.engine.compile import compile_system
from airmuscle.errors import GeometryLimitError

STRICT = (
    "-std=c99",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wdouble-promotion",
    "-Wshadow",
    "-Werror",
)
"""Warnings that printed C must not cause."""


ROUNDING = 1e-16
"""Entries of a Jacobian below this are rounding of sums that are zero; the smallest others are
above 1e-9.
"""


def require(program: str) -> str:
    """The path of a program; the test is skipped where it is missing."""
    path = shutil.which(program)
    if path is None:
        pytest.skip(f"needs the program {program}")
    return path


def shared_library(text: str, folder, name="printed", level="-O1"):
    """C text as a loaded shared library."""
    source = folder / f"{name}.c"
    target = folder / f"{name}.so"
    source.write_text(text)
    command = [
        require("gcc"),
        *STRICT,
        level,
        "-fPIC",
        "-shared",
        str(source),
        "-o",
        str(target),
        "-lm",
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[:2000]
    return ctypes.CDLL(str(target))


def built(folder, *options, level="-O1", compiler="gcc"):
    """The path of the program of all C sources in a folder, compiled with all warnings as
    errors.
    """
    sources = sorted(path.name for path in folder.glob("*.c"))
    command = [
        require(compiler),
        *STRICT,
        "-pedantic",
        *(options or (level,)),
        *sources,
        "-o",
        "program",
        "-lm",
    ]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[:2000]
    return str(folder / "program")


def finished(command, folder):
    """Standard error and standard output of a program that must end well."""
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stderr, done.stdout


def run_octave(folder):
    """Steps in words, and the CSV, of an exported program in Octave."""
    function = next(folder.glob("run_*.m")).stem
    script = (
        f"r = {function}('run.csv'); fprintf(stderr, '%d steps, %d rejected\\n', r.steps,"
        " r.rejected);"
    )
    said, _ = finished(
        [require("octave-cli"), "--no-init-file", "--quiet", "--eval", script], folder
    )
    return said, (folder / "run.csv").read_text()


def call(function, *arrays, kind=np.float64):
    """Call a C function of arrays; lists are converted to arrays of `kind`."""
    given = [a if isinstance(a, float) else np.ascontiguousarray(a, dtype=kind) for a in arrays]
    number = ctypes.c_double if kind is np.float64 else ctypes.c_float
    function.restype = None
    function(
        *(number(a) if isinstance(a, float) else ctypes.c_void_p(a.ctypes.data) for a in given)
    )


def run_node(script: str, data, folder):
    """The JSON that a JavaScript module prints, which finds `data` in data.json beside it."""
    (folder / "data.json").write_text(json.dumps(data))
    (folder / "script.mjs").write_text(script)
    done = subprocess.run(
        [require("node"), "script.mjs"], cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr[:2000]
    return json.loads(done.stdout)


def points_of(plant, count=6, seed=0):
    """States and inputs (count, n + m) around a filled muscle, in the middle of the ranges of the
    inputs and at rest.
    """
    rng = np.random.default_rng(seed)
    ready = compile_system(plant)
    pressures = rng.uniform(1e5, 4e5, count)
    states = []
    inputs = []
    for pressure in pressures:
        states.append(possible_state_near(plant, plant.state_at(pressure=float(pressure)), rng))
        known = ready.description
        low = np.maximum(known.input_minimum, -10.0)
        high = np.minimum(known.input_maximum, 10.0)
        inputs.append(
            (low + rng.uniform(0, 1, low.size) * (high - low)) * rng.integers(0, 2, low.size)
        )
    return np.float32(states).astype(float), np.float32(inputs).astype(float).reshape(count, -1)


def possible_state_near(plant, state, rng):
    """A state (n,) at random near a given one, within the ranges of the plant's geometries."""
    moving = {name for c in plant.mechanism.coordinates for name in (c.name, c.speed)}
    while True:
        values = {
            s.name: (
                state[s.name]
                + rng.uniform(-0.3, 0.3) * s.nominal * (1.0 if s.name in moving else 0.1)
            )
            for s in plant.states
        }
        try:
            plant.check_state(values)
        except GeometryLimitError:
            continue
        return list(values.values())


def library_values(plant, states, inputs):
    """Rates and non-zeros of the Jacobian at every point, by the library."""
    ready = compile_system(plant)
    f = np.empty(ready.sizes.states)
    j = np.zeros(max(ready.sizes.jacobian, 1))
    rows = []
    for x, u in zip(states, inputs, strict=True):
        ready.call("jac", x.copy(), np.append(u, 0.0), ready.precomputed, f, j)
        rows.append(np.concatenate([f, j[: ready.sizes.jacobian]]))
    return np.array(rows)


def deviation(found, expected):
    """Greatest difference of each column relative to the greatest value of the column, over all
    columns.
    """
    assert np.isfinite(expected).all()
    scale = np.abs(expected).max(axis=0)
    difference = np.abs(np.asarray(found) - expected).max(axis=0)
    difference[difference < ROUNDING] = 0.0
    assert (difference[scale == 0] == 0).all()
    return float((difference[scale > 0] / scale[scale > 0]).max(initial=0.0))
