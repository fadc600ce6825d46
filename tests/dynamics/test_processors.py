"""Machine code for a processor without AVX-512, and for one without AVX2, contains none of their
registers and computes the same: plants in lanes, loops in lanes, single runs, and vector functions
that call the C library where there is no instruction. The code of each processor is stored by
itself.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys

import llvmlite.binding as llvm
import numpy as np
import pytest
from control_plants import LIFT, SPLIT
from plants import EXAMPLES
from widths import widened

from airmuscle.control import PID
from airmuscle.core import nodes
from airmuscle.engine import (
    ControlLoop,
    DormandPrince8,
    Rodas4,
    RungeKutta4,
    Schedule,
    Single,
    simulate,
    simulate_batch,
)
from airmuscle.engine.compile import Function, program
from airmuscle.engine.compile.cache import store
from airmuscle.engine.compile.cache.kernel import Kernel, aligned_array
from airmuscle.engine.compile.llvm import jit
from airmuscle.engine.compile.llvm import processor as processors
from airmuscle.engine.run import compiled_law
from airmuscle.errors import ParameterError

WIDTHS = {"x86-64-v2": 16, "x86-64-v3": 32, "x86-64-v4": 64}
MISSING = {"x86-64-v2": r"%[yz]mm", "x86-64-v3": r"%zmm"}
"""Registers that a processor of the level does not have."""
X86 = llvm.get_process_triple().startswith("x86_64")
EQUAL = 1e-12
"""Largest difference of a result of two processors, divided by the size of its column."""
PLANTS = 19
"""Lanes of two blocks, of which the second is not full."""


def runs_here(level):
    return level in processors.possible_levels()


LEVELS = [
    pytest.param(level, marks=pytest.mark.skipif(not runs_here(level), reason="not reached"))
    for level in MISSING
]


@pytest.fixture
def compiled_for(monkeypatch):
    """A function that compiles everything anew for a level and calculates; what it printed is in
    `texts`.
    """

    def calculate(level, function, *arguments):
        with monkeypatch.context() as patch:
            for module, name in (
                (program, "_programs"),
                (program, "_descriptions"),
                (compiled_law, "_functions"),
            ):
                patch.setattr(module, name, {})
            patch.setattr(program, "load_module", lambda text: texts.append(text) or load(text))
            patch.setenv(processors.VARIABLE, level)
            return function(*arguments)

    texts = []
    load = store.load_module
    calculate.texts = texts
    return calculate


def assert_equal(results, expected, limit=EQUAL):
    assert set(results) == set(expected)
    for name, column in expected.items():
        size = np.abs(column).max()
        assert np.isfinite(size), name
        np.testing.assert_allclose(results[name], column, rtol=0.0, atol=limit * size, err_msg=name)


def assert_lacks(level, texts, monkeypatch):
    """Every printed module, compiled for the level, uses only registers that it has."""
    assert texts
    monkeypatch.setenv(processors.VARIABLE, level)
    for text in texts:
        assembly = jit.native(jit.LEVEL).emit_assembly(jit.optimised(text))
        assert not re.search(MISSING[level], assembly)
        assert "%xmm" in assembly


def lanes_of(plant, integrator, **options):
    """States of plants in lanes, which differ in their initial states, in nominal sizes, and a row
    of outputs.
    """
    inputs = Schedule(dict.fromkeys(plant.inputs, ((0.0, 0.02), (0.004, 0.05))))
    nominal = {state.name: state.nominal for state in plant.states}
    factors = np.linspace(1.0, 1.01, PLANTS)
    batch = simulate_batch(
        plant,
        {},
        inputs,
        duration=0.01,
        initial_states={name: 0.1 * size * factors for name, size in nominal.items()},
        integrator=integrator,
        output_times=0.0025,
        **options,
    )
    assert not batch.failed.size
    states = {name: 1.0 + batch.columns[name] / size for name, size in nominal.items()}
    return states | {name: x for name, x in batch.columns.items() if name.endswith("volume")}


def loops_in_lanes():
    """Columns of control loops in lanes, of plants of different mass."""
    loop = ControlLoop(
        PID("pressure", SPLIT, gain=8e-6, integral_time=0.3),
        0.0125,
        Schedule({"pressure": ((0.0, 1e5), (0.05, 3e5))}),
    )
    masses = np.linspace(1.0, 2.5, PLANTS)
    integrator = RungeKutta4(1e-3)
    batch = simulate_batch(
        LIFT, {"mechanism.mass": masses}, loop, duration=0.2, integrator=integrator
    )
    return batch.columns


def single_run(integrator):
    """The columns of one plant alone."""
    run = simulate(
        LIFT,
        Schedule({"fill": ((0.01, 0.5), (0.1, 0.0)), "discharge": ((0.12, 1.0),)}),
        duration=0.2,
        integrator=integrator,
        output_times=0.01,
    )
    return {name: run[name] for name in ("pressure", "position", "speed")}


IN_LANES = ("chou-hannaford", "surface", "LuGre")


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("name", widened(EXAMPLES, lambda name: name in IN_LANES))
def test_plants_in_lanes_are_equal(name, level, compiled_for, monkeypatch):
    plant = EXAMPLES[name]
    integrator = RungeKutta4(2e-5)
    expected = lanes_of(plant, integrator)
    assert_equal(compiled_for(level, lanes_of, plant, integrator), expected)
    (step,) = (text for text in compiled_for.texts if "@step(" in text)
    assert set(re.findall(r"load <(\d+) x double>", step)) == {str(WIDTHS[level] // 8)}
    assert_lacks(level, compiled_for.texts, monkeypatch)


@pytest.mark.parametrize("level", LEVELS)
def test_the_method_of_order_eight_and_single_precision_are_equal(level, compiled_for):
    plant = EXAMPLES["surface"]
    method = DormandPrince8(1e-4)
    expected = lanes_of(plant, method)
    assert_equal(compiled_for(level, lanes_of, plant, method), expected)
    single = lanes_of(plant, method, precision=Single())
    results = compiled_for(level, lambda: lanes_of(plant, method, precision=Single()))
    assert_equal(results, single, limit=1e-5)


@pytest.mark.parametrize("level", LEVELS)
def test_loops_in_lanes_are_equal(level, compiled_for, monkeypatch):
    expected = loops_in_lanes()
    assert_equal(compiled_for(level, loops_in_lanes), expected)
    assert_lacks(level, compiled_for.texts, monkeypatch)


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("integrator", [Rodas4(), RungeKutta4(1e-3)], ids=["implicit", "explicit"])
def test_single_runs_are_equal(integrator, level, compiled_for, monkeypatch):
    expected = single_run(integrator)
    assert_equal(compiled_for(level, single_run, integrator), expected)
    assert_lacks(level, compiled_for.texts, monkeypatch)


@pytest.mark.parametrize("level", LEVELS)
def test_vector_functions_are_equal(level, monkeypatch):
    """Without a fused multiply-add, LLVM calls the C library for it."""
    monkeypatch.setenv(processors.VARIABLE, level)
    x = nodes.symbol("x")
    values = [nodes.exp(x), nodes.log(x), nodes.sin(x), nodes.tanh(x), x**2.7, nodes.floor(x)]
    function = Function({"x": [x]}, {"y": values}, lanes=8)
    column = aligned_array((1, 8))
    column[:] = np.linspace(0.3, 7.2, 8)
    results = aligned_array((6, 8))
    call = program.ctypes.CFUNCTYPE(None, *[program.ctypes.c_void_p] * 2)(function.address)
    call(column.ctypes.data, results.ctypes.data)
    x = column[0]
    expected = [np.exp(x), np.log(x), np.sin(x), np.tanh(x), x**2.7, np.floor(x)]
    np.testing.assert_allclose(results, expected, rtol=1e-14)


@pytest.fixture(scope="module")
def kernel():
    """A numba kernel as a module, and the kinds of its arguments."""
    kinds = ("q", "d1", "d2", "d2", "d2")
    return jit.standalone(Kernel("evaluate").numba, kinds)


@pytest.mark.parametrize("level", LEVELS)
def test_a_kernel_lacks_the_registers(level, kernel, monkeypatch):
    monkeypatch.setenv(processors.VARIABLE, level)
    assert not re.search(MISSING[level], jit.native(3).emit_assembly(kernel))


@pytest.mark.slow
@pytest.mark.parametrize("level", LEVELS)
def test_a_whole_process_is_equal(level):
    """All kernels, too, are those of the level."""
    code = (
        "import json, test_processors as t\nprint(json.dumps({name: {key: column.tolist() for key,"
        " column in run.items()} for name, run in t.everything().items()}))"
    )
    environment = {
        **os.environ,
        processors.VARIABLE: level,
        "PYTHONPATH": os.pathsep.join(sys.path),
    }
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    results = json.loads(done.stdout)
    for name, expected in everything().items():
        assert_equal({key: np.array(x) for key, x in results[name].items()}, expected)


def everything():
    """All runs of this file, by name."""
    return {
        "lanes": lanes_of(EXAMPLES["surface"], RungeKutta4(2e-5)),
        "loops": loops_in_lanes(),
        "implicit": single_run(Rodas4()),
        "explicit": single_run(RungeKutta4(1e-3)),
    }


@pytest.mark.skipif(not X86, reason="levels are those of x86-64")
def test_a_level_has_registers_of_its_own_and_files_of_its_own(monkeypatch):
    names = set()
    for level, width in WIDTHS.items():
        if runs_here(level):
            monkeypatch.setenv(processors.VARIABLE, level)
            assert processors.processor().register == width
            names.add(store._file_name("lanes", ("q",)))
    monkeypatch.delenv(processors.VARIABLE)
    names.add(store._file_name("lanes", ("q",)))
    assert len(names) == 1 + sum(map(runs_here, WIDTHS))


@pytest.mark.parametrize(
    ("features", "width"),
    [
        ({"sse2": True, "avx": True, "avx2": True, "avx512f": True}, 64),
        ({"sse2": True, "avx": True, "avx2": True, "avx512f": False}, 32),
        ({"sse2": True, "avx": False}, 16),
        ({"neon": True}, 16),
    ],
)
def test_the_width_of_a_register_follows_from_the_features(features, width):
    assert processors.register_width(features) == width


def test_a_level_that_is_unknown_is_refused_and_the_remedy_works(monkeypatch):
    monkeypatch.setenv(processors.VARIABLE, "haswell")
    with pytest.raises(ParameterError, match="AIRMUSCLE_PROCESSOR is 'haswell'; this") as caught:
        processors.processor()
    for level in re.findall(r"x86-64-v\d", str(caught.value)):
        assert processors.level_of(level).name == level
    assert "Unset it" in str(caught.value)
    monkeypatch.delenv(processors.VARIABLE)
    assert processors.processor().register in (16, 32, 64)


def test_a_level_above_this_processor_is_refused(monkeypatch):
    monkeypatch.setattr(processors, "_features", lambda: {"sse4.2": True, "avx2": False})
    assert processors.level_of("x86-64-v2").register == 16
    with pytest.raises(ParameterError, match=r"this processor can run x86-64-v2\. Unset it"):
        processors.level_of("x86-64-v3")
