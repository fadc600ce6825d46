"""Printed programs: the same instructions in C99, JavaScript and MATLAB text give the numbers of
the library.

Scale of a deviation: the greatest value that the rate, or the element of the Jacobian, has among
the points.
"""

from __future__ import annotations

import ctypes
import enum
import math
import subprocess

import numpy as np
import plants
import printed
import pytest
from operation_points import Operations, states_and_values

from airmuscle.engine.compile import compile_system, derivatives, functions
from airmuscle.engine.compile.ir.instructions import Operation
from airmuscle.engine.compile.ir.interpreter import InterpretedBody
from airmuscle.engine.compile.llvm.jit import engine_of, object_code
from airmuscle.engine.compile.text.languages import (
    DEFINITION,
    CLanguage,
    JavaScriptLanguage,
    MatlabLanguage,
)
from airmuscle.errors import TraceError

SOME = ("dmsp-20-300", "overlap", "shaped joint with friction", "manifold on tank and regulator")
"""Plants with every kind of block: valves that are shut, clamps, selections, a spool, several
coordinates.
"""
SMALL_DIFFERENCES = (
    "vessel",
    "three positions through a tube",
    "manifold on tank and regulator",
    "stop, lagging wall",
    "two pressure regulators on a tank",
)
ALL = [
    pytest.param(name, marks=() if name in SOME else pytest.mark.slow) for name in plants.EXAMPLES
]
JAVASCRIPT = """
import * as M from "./models.mjs";
import {readFileSync} from "fs";
const results = {};
for (const [name, d] of Object.entries(JSON.parse(readFileSync("data.json")))) {
  const c = new Float64Array(d.held);
  M[`${d.prefix}prepare`](d.parameters, c);
  results[name] = d.states.map((x, i) => {
    const f = new Float64Array(x.length), J = new Float64Array(d.jacobian);
    M[`${d.prefix}jac`](x, d.inputs[i], c, f, J);
    return [...f, ...J];
  });
}
console.log(JSON.stringify(results));
"""


def traced(plant):
    return compile_system(plant).program.traced


def c_values(plant, states, inputs, folder, kind=np.float64):
    """Rates and Jacobian at every point by printed C, compiled with all warnings as errors."""
    number = "double" if kind is np.float64 else "float"
    text, sizes = functions.system_module(traced(plant), CLanguage(number, public=None))
    library = printed.shared_library("#include <math.h>\n" + text, folder, number, "-O0")
    c = np.zeros(sizes.held + 1, kind)
    rows = []
    printed.call(library.prepare, compile_system(plant).parameters, c, kind=kind)
    for x, u in zip(states, inputs, strict=True):
        f = np.zeros(sizes.states, kind)
        j = np.zeros(sizes.jacobian + 1, kind)
        printed.call(library.jac, x, np.append(u, 0.0), c, f, j, kind=kind)
        rows.append(np.concatenate([f, j[: sizes.jacobian]]))
    return np.array(rows, dtype=float)


def test_c_gives_the_values_of_every_operation(tmp_path):
    states, values = states_and_values()
    inputs = np.zeros((len(states), 0))
    expected = printed.library_values(Operations(), states, inputs)
    found = c_values(Operations(), states, inputs, tmp_path)
    assert printed.deviation(found, expected) < 1e-14
    assert np.allclose(found[:, : states.shape[1]], values, rtol=1e-14, atol=0.0)


@pytest.mark.parametrize("name", ALL)
def test_c_gives_the_rates_and_slopes_of_the_library(name, tmp_path):
    plant = plants.EXAMPLES[name]
    states, inputs = printed.points_of(plant)
    expected = printed.library_values(plant, states, inputs)
    assert printed.deviation(c_values(plant, states, inputs, tmp_path), expected) < 1e-12


@pytest.mark.parametrize("name", ALL)
def test_single_precision_c_gives_the_rates_to_one_part_in_100_000(name, tmp_path):
    """Where a small difference of pressures or volumes gives a rate, rounding of the state has a
    greater effect.
    """
    plant = plants.EXAMPLES[name]
    states, inputs = printed.points_of(plant)
    n = len(plant.states)
    expected = printed.library_values(plant, states, inputs)[:, :n]
    found = c_values(plant, states, inputs, tmp_path, np.float32)[:, :n]
    allowed = 1e-5 * np.abs(expected).max(axis=0)
    if name in SMALL_DIFFERENCES:
        allowed = allowed + 4 * rounding_effect(plant, states, inputs)
    assert (np.abs(found - expected).max(axis=0) <= allowed).all()


def rounding_effect(plant, states, inputs):
    """Greatest change (n,) of each rate if every state is rounded to single precision: |J| |x|
    2^-24.
    """
    ready = compile_system(plant)
    slopes = [derivatives(ready, x, u).rates_by_state for x, u in zip(states, inputs, strict=True)]
    return (
        np.max([np.abs(j) @ np.abs(x) for j, x in zip(slopes, states, strict=True)], axis=0)
        * 2.0**-24
    )


@pytest.mark.parametrize(
    "names", [SOME, pytest.param(tuple(plants.EXAMPLES), marks=pytest.mark.slow)], ids=len
)
def test_javascript_gives_the_rates_and_slopes_of_the_library(names, tmp_path):
    printed.require("node")
    modules = []
    data = {}
    expected = {}
    for i, name in enumerate(names):
        plant = plants.EXAMPLES[name]
        text, sizes = functions.system_module(traced(plant), JavaScriptLanguage(f"m{i}_"))
        states, inputs = printed.points_of(plant)
        modules.append(text)
        expected[name] = printed.library_values(plant, states, inputs)
        data[name] = {
            "prefix": f"m{i}_",
            "parameters": compile_system(plant).parameters.tolist(),
            "held": sizes.held,
            "jacobian": sizes.jacobian,
            "states": states.tolist(),
            "inputs": inputs.tolist(),
        }
    (tmp_path / "models.mjs").write_text("\n".join(modules))
    found = printed.run_node(JAVASCRIPT, data, tmp_path)
    assert {
        name: d
        for name in names
        if not (d := printed.deviation(found[name], expected[name])) < 1e-12
    } == {}


def octave(script, folder):
    """What an Octave script prints."""
    (folder / "script.m").write_text(script)
    done = subprocess.run(
        [printed.require("octave-cli"), "--no-init-file", "--quiet", "script.m"],
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[:2000]
    return done.stdout


def column(values):
    return "[" + "; ".join(repr(float(v)) for v in values) + "]"


@pytest.mark.parametrize("name", ["dmsp-20-300", pytest.param("arm", marks=pytest.mark.slow)])
def test_octave_gives_the_rates_and_slopes_of_the_library(name, tmp_path):
    plant = plants.EXAMPLES[name]
    states, inputs = printed.points_of(plant, 3)
    text, _ = functions.system_module(traced(plant), MatlabLanguage())
    calls = [
        f"[f, J] = jac({column(x)}, {column([*u, 0.0])}, c); printf('%.17g ', f, J); printf('\\n');"
        for x, u in zip(states, inputs, strict=True)
    ]
    script = "\n".join(
        [
            "1;",
            DEFINITION,
            text,
            f"c = prepare({column(compile_system(plant).parameters)});",
            *calls,
        ]
    )
    found = np.array([row.split() for row in octave(script, tmp_path).splitlines()], dtype=float)
    assert printed.deviation(found, printed.library_values(plant, states, inputs)) < 1e-12


OF_TWO = {
    o
    for o in Operation
    if o.name
    in (
        "ADD",
        "SUBTRACT",
        "MULTIPLY",
        "DIVIDE",
        "POWER",
        "FMIN",
        "FMAX",
        "LESS",
        "LESS_EQUAL",
        "EQUAL",
        "NOT_EQUAL",
        "AND",
        "OR",
        "MASK",
        "MAXIMUM",
        "MINIMUM",
    )
}
EVERY = tuple(o for o in Operation if o not in (Operation.CONSTANT, Operation.SYMBOL))
POINTS = [
    (a, b, 7.0)
    for a in (-2.5, -1.0, -0.3, 0.0, 0.3, 1.0, 2.5)
    for b in (-1.5, -1.0, 0.0, 0.5, 1.0, 3.0)
]


def every_operation(language):
    """The text of a function f(x, y): every operation of an instruction list, with the operands x1,
    x2 and x3.
    """
    block = language.body()
    x = [block.load("x", i) for i in range(3)]
    for i, operation in enumerate(EVERY):
        count = 3 if operation is Operation.SELECT else 2 if operation in OF_TWO else 1
        block.store("y", i, block.operate(operation, x[:count]))
    return language.function("f", ["x"], ["y"], block)


@pytest.fixture(scope="module")
def operation_values():
    """The values of every operation at every point, by the machine code of the library."""
    engine = engine_of(object_code(every_operation(functions.LLVM)))
    function = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(
        engine.get_function_address("f")
    )
    rows = np.empty((len(POINTS), len(EVERY)))
    for row, point in zip(rows, POINTS, strict=True):
        x = np.array(point)
        function(x.ctypes.data, row.ctypes.data)
    return rows


def check_operations(found, expected):
    names = [o.name for o in EVERY]
    for name, a, b in zip(names, np.asarray(found, dtype=float).T, expected.T, strict=True):
        np.testing.assert_allclose(a, b, rtol=2e-15, atol=0, err_msg=name)


def test_every_operation_means_the_same_in_c(operation_values, tmp_path):
    library = printed.shared_library(
        "#include <math.h>\n" + every_operation(CLanguage(public=None)), tmp_path
    )
    rows = np.empty_like(operation_values)
    for row, point in zip(rows, POINTS, strict=True):
        printed.call(library.f, point, row)
    check_operations(rows, operation_values)


def test_every_operation_means_the_same_in_javascript(operation_values, tmp_path):
    rows = [list(point) for point in POINTS]
    results = (
        f"{rows}.map((x) => {{ const y = new Array({len(EVERY)}); f(x, y); return"
        " y.map(String); })"
    )
    module = f"{every_operation(JavaScriptLanguage())}console.log(JSON.stringify({results}));\n"
    found = [
        [number.replace("Infinity", "inf") for number in row]
        for row in printed.run_node(module, {}, tmp_path)
    ]
    check_operations(found, operation_values)


def test_every_operation_means_the_same_in_octave(operation_values, tmp_path):
    calls = [f"printf('%.17g ', f({column(p)})); printf('\\n');" for p in POINTS]
    script = "\n".join(["1;", DEFINITION, every_operation(MatlabLanguage()), *calls])
    check_operations(
        [row.split() for row in octave(script, tmp_path).splitlines()], operation_values
    )


@pytest.mark.parametrize(
    "language", [CLanguage(), CLanguage("float"), JavaScriptLanguage(), MatlabLanguage()], ids=repr
)
def test_constants_are_read_back_as_they_were(language):
    body = language.body()
    texts = [
        body.constant(value)
        for value in (0.0, -0.0, 1.0, -2.5, 1e300, 5e-324, math.inf, -math.inf, math.nan)
    ]
    if language == CLanguage("float"):
        assert texts[:4] == ["0.0f", "(-0.0f)", "1.0f", "(-2.5f)"]
        assert texts[4:6] == ["INFINITY", "0.0f"]
    else:
        assert [float(t.strip("()")) for t in texts[:6]] == [0.0, -0.0, 1.0, -2.5, 1e300, 5e-324]
        assert texts[1] == "(-0.0)"
    infinity, nan = {
        "CLanguage": ("INFINITY", "(float)NAN")
        if language == CLanguage("float")
        else ("HUGE_VAL", "(double)NAN"),
        "JavaScriptLanguage": ("Infinity", "NaN"),
        "MatlabLanguage": ("Inf", "NaN"),
    }[type(language).__name__]
    assert texts[6:] == [infinity, f"(-{infinity})", nan]


class Unknown(enum.Enum):
    ERF = -1


@pytest.mark.parametrize(
    "language", [functions.LLVM, CLanguage(), JavaScriptLanguage(), MatlabLanguage()], ids=repr
)
def test_an_operation_without_a_form_is_refused(language):
    with pytest.raises(
        TraceError, match=r"ERF has no [A-Za-z]+ form; write the law over airmuscle\.core\.ops"
    ):
        language.body().operate(Unknown.ERF, ["x"])


def test_the_text_is_the_same_every_time():
    texts = {
        functions.system_module(
            functions.trace_system(plants.EXAMPLES["dmsp-20-300"]), CLanguage()
        )[0]
        for _ in range(2)
    }
    assert len(texts) == 1


@pytest.mark.parametrize(
    ("operation", "arguments", "result"),
    [
        (Operation.SINH, (-1000.0,), -math.inf),
        (Operation.COSH, (-1000.0,), math.inf),
        (Operation.FLOOR, (-math.inf,), -math.inf),
        (Operation.LOG, (0.0,), -math.inf),
        (Operation.LOG1P, (-1.0,), -math.inf),
        (Operation.POWER, (-1e200, 3.0), -math.inf),
        (Operation.POWER, (0.0, -2.0), math.inf),
        (Operation.SQRT, (-1.0,), math.nan),
        (Operation.ASIN, (2.0,), math.nan),
    ],
    ids=str,
)
def test_the_interpreter_gives_infinity_or_nan_where_the_c_library_does(
    operation, arguments, result
):
    body = InterpretedBody({"x": arguments})
    body.store("y", 0, body.operate(operation, [body.load("x", i) for i in range(len(arguments))]))
    assert body.stored["y", 0] == pytest.approx(result, nan_ok=True)
