"""Kernels as text: the drivers that C, JavaScript and Octave print from the kernels compute the
numbers of the kernels.
"""

from __future__ import annotations

import subprocess

import numpy as np
import plants
import printed
import pytest

from airmuscle.engine import Problem, RungeKutta4, Schedule, solve
from airmuscle.engine.compile.kernel_text import (
    CKernels,
    JavaScriptKernels,
    MatlabKernels,
    read_kernels,
    read_text,
    typed,
)
from airmuscle.engine.compile.kernels.driven_inputs import DriverKind, apply_drivers
from airmuscle.errors import TraceError
from airmuscle.outlets import C99, JavaScript, Octave, write_program

CASES = 2000
CAPACITY = 64
PIECES = 5
SIGNAL = ("", "CAPACITY")
TABLE = ("1", "4")
SHAPES = {
    "columns": ("1", "3", "CAPACITY"),
    "scratch": ("2", "3", "CAPACITY"),
    "kinds": ("1", "2"),
    **dict.fromkeys(("signal", "result", "events"), SIGNAL),
    **dict.fromkeys(("settings", "states", "later"), TABLE),
}
LANGUAGES = (CKernels(SHAPES), JavaScriptKernels(), MatlabKernels())
FUNCTION = {DriverKind.MODULATOR: "pulse_width_modulation", DriverKind.SWITCH: "delayed_switch"}


def random_case(rng):
    """Kind, start, settings and state (4,) of a driver at random, and a signal (3, PIECES) from the
    start.
    """
    kind = int(rng.integers(len(DriverKind)))
    start = float(rng.choice([0.0, rng.uniform(0, 5)]))
    ends = start + np.cumsum(rng.uniform(1e-4, 0.02, PIECES))
    values = rng.choice([0.0, 0.5, 1.0, rng.uniform()], PIECES)
    slopes = np.where(
        rng.uniform(size=PIECES) < 0.5, 0.0, (rng.uniform(size=PIECES) - values) / 0.02
    )
    if kind == DriverKind.MODULATOR:
        frequency = rng.uniform(10, 200)
        begun = rng.integers(0, 3)
        settings = (frequency, rng.choice([0.0, 0.2 / frequency]), 0.0, 0.0)
        state = (
            start - begun / frequency,
            begun,
            rng.choice([-np.inf, np.inf, start + rng.uniform(-0.01, 0.01)]),
            0.0,
        )
    else:
        settings = rng.choice([0.0, 1e-3, rng.uniform(0, 0.02)], 4)
        pending = rng.choice([np.inf, start + rng.uniform(0, 0.05)])
        state = (rng.integers(2), pending, rng.integers(2), rng.choice([0.0, 1.0, rng.uniform()]))
    return (
        kind,
        start,
        np.array(settings, dtype=float),
        np.array(state, dtype=float),
        np.array([ends, values, slopes]),
    )


@pytest.fixture(scope="module")
def cases():
    rng = np.random.default_rng(20)
    return [random_case(rng) for _ in range(CASES)]


@pytest.fixture(scope="module")
def expected(cases):
    """Count, state and segments that the kernels compute, as rows (CASES, 5 + 3 CAPACITY)."""
    return np.array([by_kernel(*case) for case in cases])


def by_kernel(kind, start, settings, state, signal):
    columns = np.zeros((1, 3, CAPACITY))
    scratch = np.zeros((2, 3, CAPACITY))
    counts = np.array([PIECES])
    columns[0, :, :PIECES], states = signal, state[None].copy()
    ulp = float(np.spacing(signal[0, -1]))
    apply_drivers.py_func(
        np.array([[0, kind]]), settings[None], states, states, columns, counts, scratch, start, ulp
    )
    return row(counts[0], states[0], columns[0])


def row(count, state, segments):
    """Count, state and segments in one row; what lies behind the segments is not compared."""
    used = np.zeros((3, CAPACITY))
    used[:, : int(count)] = np.asarray(segments)[:, : int(count)]
    return [float(count), *state, *used.ravel()]


def test_c_computes_what_the_kernels_compute(cases, expected, tmp_path):
    text = (
        "#include <math.h>\n#define CAPACITY"
        f" {CAPACITY}\n{CKernels(SHAPES).text('driven_inputs', ['apply_drivers'])}"
    )
    text += """
void drive(int kind, double start, double ulp, double *setting, double *state, double *column, double *scratch, int *count);
void drive(int kind, double start, double ulp, double *setting, double *state, double *column, double *scratch, int *count)
{
  int kinds[1][2] = {{0, 0}};
  kinds[0][1] = kind;
  apply_drivers(kinds, (double (*)[4])setting, (double (*)[4])state, (double (*)[4])state,
                (double (*)[3][CAPACITY])column, count, (double (*)[3][CAPACITY])scratch, start, ulp);
}
"""
    library = printed.shared_library(text, tmp_path)
    ctypes = printed.ctypes
    found = []
    (tmp_path / "printed.cpp").write_text(text)
    plus = [
        printed.require("g++"),
        "-std=c++17",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-pedantic",
        "-c",
        "printed.cpp",
    ]
    printed.finished(plus, tmp_path)
    for kind, start, settings, state, signal in cases:
        column = np.zeros((3, CAPACITY))
        scratch = np.zeros((2, 3, CAPACITY))
        count = ctypes.c_int(PIECES)
        after = state.copy()
        column[:, :PIECES] = signal
        arrays = [ctypes.c_void_p(a.ctypes.data) for a in (settings, after, column, scratch)]
        numbers = (
            ctypes.c_int(kind),
            ctypes.c_double(start),
            ctypes.c_double(float(np.spacing(signal[0, -1]))),
        )
        library.drive(*numbers, *arrays, ctypes.byref(count))
        found.append(row(count.value, after, column))
    np.testing.assert_array_equal(found, expected)


def as_data(cases):
    """The cases as numbers that JSON can hold, with infinities as texts."""
    return [
        [
            kind,
            start,
            float(np.spacing(signal[0, -1])),
            settings.tolist(),
            [str(x) for x in state],
            signal.tolist(),
        ]
        for kind, start, settings, state, signal in cases
    ]


def test_javascript_computes_what_the_kernels_compute(cases, expected, tmp_path):
    script = f"""import {{readFileSync}} from "node:fs";
{JavaScriptKernels().text("driven_inputs", ["apply_drivers"])}
const found = JSON.parse(readFileSync("data.json")).map(([kind, start, ulp, settings, state, signal]) => {{
  const states = [state.map((x) => Number(x.replace("inf", "Infinity")))], columns = [signal], counts = [{PIECES}];
  const scratch = [[[], [], []], [[], [], []]];
  apply_drivers([[0, kind]], [settings], states, states, columns, counts, scratch, start, ulp);
  return [counts[0], states[0].map(String), columns[0]];
}});
console.log(JSON.stringify(found));
"""
    found = printed.run_node(script, as_data(cases), tmp_path)
    np.testing.assert_array_equal([row(n, [float(x) for x in s], c) for n, s, c in found], expected)


def test_octave_computes_what_the_kernels_compute(cases, expected, tmp_path):
    octave = printed.require("octave-cli")
    np.savetxt(
        tmp_path / "cases.txt",
        [[c[0], c[1], np.spacing(c[4][0, -1]), *c[2], *c[3], *c[4].ravel()] for c in cases],
        fmt="%.17g",
    )
    script = f"""1;
{MatlabKernels().text("driven_inputs", ["apply_drivers"])}
cases = load('cases.txt');
for k = 1:size(cases, 1)
  c = cases(k, :);
  [state, columns, count] = apply_drivers([0, c(1)], c(4:7), c(8:11), c(8:11), {{reshape(c(12:end), [], 3)'}}, {PIECES}, ...
    {{zeros(3, 0), zeros(3, 0)}}, c(2), c(3));
  printf('%.17g ', count, state, columns{{1}}(:, 1:count)'); printf('\\n');
end
"""
    (tmp_path / "drive.m").write_text(script)
    done = subprocess.run(
        [octave, "--no-init-file", "--quiet", "drive.m"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[:2000]
    rows = [np.array(line.split(), dtype=float) for line in done.stdout.splitlines()]
    np.testing.assert_array_equal([row(r[0], r[1:5], r[5:].reshape(3, -1)) for r in rows], expected)


@pytest.mark.parametrize("language", LANGUAGES, ids=lambda language: type(language).__name__)
@pytest.mark.parametrize("kind", DriverKind)
def test_every_kind_of_driver_is_printed_in_every_language(kind, language):
    text = language.text("driven_inputs", ["apply_drivers"])
    assert f"{FUNCTION[kind]}(" in text
    assert f"{kind.name} = {kind.value}" in text or kind == max(DriverKind)


def test_the_kernel_of_drivers_calls_a_function_for_each_kind():
    kernel = read_kernels("driven_inputs")["apply_drivers"]
    assert {name for name, module in kernel.imported.items() if module == "drivers"} == set(
        FUNCTION.values()
    )
    assert set(FUNCTION) == set(DriverKind)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (
            "x = [i for i in range(3)]",
            "wrong.py, line 2, f: the expression ListComp has no printed form: `",
        ),
        ("x = a % 2", "line 2, f: the operator Mod has no printed form: `a % 2`"),
        ("x = open(a)", "line 2, f: the function open has no printed form"),
        ("for i in range(4, 1, -1): x = 1", "line 2, f: a range with a step has no printed form"),
        ("for i in a: x = 1", "line 2, f: a loop over something else than a range"),
        ("for i in range(3): i = 2", "line 2, f: a loop that changes its variable or its range"),
        ("a, b = b, a", "line 2, f: an assignment that reads a variable which it changes"),
        ("x = (a > 1) == b", "line 2, f: a comparison of a flag with a number"),
        ("with a: pass", "line 2, f: the statement With has no printed form"),
        ("x = UNKNOWN + a", "line 2, f: the unknown name UNKNOWN has no printed form"),
    ],
)
@pytest.mark.parametrize("language", LANGUAGES, ids=lambda language: type(language).__name__)
def test_a_construct_without_printed_form_is_named_with_file_and_line(line, message, language):
    kernel = typed(read_text(f"def f(a, b):\n    {line}\n    return a\n", "wrong.py")["f"], {})
    with pytest.raises(TraceError) as raised:
        language.printed({"f": kernel})
    assert message in str(raised.value)


def test_a_conditional_value_within_an_expression_has_no_form_in_matlab():
    kernel = typed(
        read_text("def f(a, b):\n    return a + (1.0 if b > 0.0 else 2.0)\n", "wrong.py")["f"], {}
    )
    with pytest.raises(
        TraceError,
        match=r"line 2, f: a conditional value that does not stand alone in an assignment",
    ):
        MatlabKernels().printed({"f": kernel})


@pytest.mark.parametrize(
    "expression",
    ["a - (b - 1.0)", "a / (b * 3.0)", "-(a + b) * 2.0", "a - b - 1.0", "int(a - 0.5)"],
)
@pytest.mark.parametrize("language", LANGUAGES, ids=lambda language: type(language).__name__)
def test_the_order_of_operations_is_kept(expression, language):
    kernel = typed(read_text(f"def f(a, b):\n    return {expression}\n", "order.py")["f"], {})
    text = language.printed({"f": kernel}).replace(".0", "")
    for own in ("(int)", "Math.trunc", "fix"):
        text = text.replace(own, "int")
    assert expression.replace(".0", "") in text


MIDPOINT = """
from .calls import invoke, pointer
from .evaluate import set_inputs

def single_step(rhs, c, y, base, w, t, start, end, h, f0, u, x, yn):
    last = t + 1.000001 * h >= end
    taken = end - t if last else h
    reached = end if last else t + taken
    set_inputs(base, t - start, w, u)
    invoke(rhs, (pointer(y), pointer(u), pointer(c), pointer(f0)))
    for i in range(y.shape[0]):
        x[i] = y[i] + 0.5 * taken * f0[i]
    set_inputs(base, t + 0.5 * taken - start, w, u)
    invoke(rhs, (pointer(x), pointer(u), pointer(c), pointer(f0)))
    for i in range(y.shape[0]):
        yn[i] = y[i] + taken * f0[i]
    return 0, reached, taken, h, 0

def state_between(y, yn, t, h, time, between):
    for i in range(y.shape[0]):
        between[i] = y[i] + (time - t) / h * (yn[i] - y[i])
"""


class Midpoint(RungeKutta4):
    """A method that the library does not have."""

    printed_step = "midpoint"

    def tableau(self):
        return ((0.5,),), (0.0, 1.0)


def run_c(folder):
    return printed.finished([printed.built(folder)], folder)


def run_javascript(folder):
    return printed.finished([printed.require("node"), "plant.run.mjs"], folder)


@pytest.mark.parametrize(
    ("target", "run"),
    [(C99(), run_c), (JavaScript(), run_javascript), (Octave(), printed.run_octave)],
    ids=lambda each: getattr(each, "__name__", None),
)
def test_a_new_integrator_in_the_kernels_is_in_every_outlet(target, run, tmp_path, monkeypatch):
    def read(module):
        return read_text(MIDPOINT, "midpoint.py") if module == "midpoint" else read_kernels(module)

    monkeypatch.setattr("airmuscle.engine.compile.kernel_text.printer.read_kernels", read)
    plant = plants.EXAMPLES["heat"]
    signal = Schedule(dict.fromkeys(plant.inputs, ((0.0, 0.3), (0.05, 0.1))))
    problem = Problem(plant, signal, 0.1, plant.state_at(pressure=1e5), integrator=Midpoint(1e-3))
    write_program(problem, tmp_path, target, name="plant")
    steps, csv = run(tmp_path)
    assert "100 steps, 0 rejected" in steps
    last = [float(number) for number in csv.splitlines()[-1].split(",")]
    expected = solve(problem).final_state.values()
    np.testing.assert_allclose(last[1 : 1 + len(expected)], list(expected), rtol=1e-11)
