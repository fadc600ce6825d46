"""The lane printer is the scalar printer with another type: every operation in lanes means what it
means in NumPy, also at zero, infinity and NaN; exp, log, pow, sin and cos, which have forms of
their own, err by a unit of the last place at most, a power with a steady exponent by 1e-12."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from airmuscle.core import nodes
from airmuscle.core.operations import Operation
from airmuscle.engine.compile import Printer
from airmuscle.engine.compile.cache.kernel import aligned_array
from airmuscle.engine.compile.llvm import emit, vector_math
from airmuscle.engine.compile.llvm.emit import LlvmType
from airmuscle.engine.compile.llvm.jit import engine_of, object_code
from airmuscle.errors import TraceError

NUMBERS = {
    "16 doubles": LlvmType(64, 16),
    "8 doubles": LlvmType(64, 8),
    "32 singles": LlvmType(32, 32),
}
WIDE = max(number.lanes for number in NUMBERS.values())
ENDS = np.array(
    [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.5,
        2.0,
        -3.0,
        1e-300,
        5e-324,
        1e300,
        -1e300,
        40.0,
        np.inf,
        -np.inf,
        np.nan,
        3.0,
    ]
)


def run(number, expressions, *columns):
    """The expressions of x, y, z at every row of the columns, computed in lanes; (rows,
    expressions).
    """
    symbols = nodes.symbols("x", len(columns))
    printer = Printer(emit.LlvmLanguage(number))
    outputs = expressions(*symbols)
    printer.add("f", {"x": symbols}, {"y": outputs})
    parts = [vector_math.definition(name, count, number) for name, count in printer.needed.items()]
    text = "\n".join([vector_math.declarations({number}), *parts, printer.module()])
    return call(engine_of(object_code(text)), number, columns, len(outputs))


def call(engine, number, columns, results):
    kind = np.float64 if number.bits == 64 else np.float32
    x, y = (aligned_array((count, number.lanes), kind) for count in (len(columns), results))
    function = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(
        engine.get_function_address("f")
    )
    size = len(columns[0])
    found = []
    for at in range(0, size, number.lanes):
        rows = np.minimum(np.arange(at, at + number.lanes), size - 1)
        for i, column in enumerate(columns):
            x[i] = np.asarray(column)[rows]
        function(x.ctypes.data, y.ctypes.data)
        found.append(y.T.copy())
    return np.concatenate(found)[:size]


OPERATIONS = {
    "sum, difference, product, quotient": (
        lambda x, y: [x + y, x - y, x * y, x / y],
        lambda x, y: [x + y, x - y, x * y, x / y],
    ),
    "negative, square, twice, inverse": (
        lambda x, y: [-x, x**2, 2 * x, 1 / y],
        lambda x, y: [-x, x * x, x + x, 1 / y],
    ),
    "root and size": (
        lambda x, y: [nodes.sqrt(x), abs(y)],
        lambda x, y: [np.sqrt(x), np.abs(y)],
    ),
    "comparisons": (
        lambda x, y: [x < y, x <= y, x == y, x != y, nodes.negated(x)],
        lambda x, y: [x < y, x <= y, x == y, x != y, x == 0],
    ),
    "and, or": (
        lambda x, y: [nodes.logical_and(x > 0, y > 0), nodes.logical_or(x > 0, y > 0)],
        lambda x, y: [(x > 0) & (y > 0), (x > 0) | (y > 0)],
    ),
    "choices": (
        lambda x, y: [
            nodes.where(x > y, x, y),
            nodes.where(x > 0, y, 0),
            nodes.where(x < y, x * 3, y - 1),
        ],
        lambda x, y: [np.where(x > y, x, y), np.where(x > 0, y, 0), np.where(x < y, x * 3, y - 1)],
    ),
    "masks of what is below or above zero": (
        lambda x, y: [
            nodes.where(x >= 0, x, 0),
            nodes.where(x >= 0, 0, x),
            nodes.where(x <= 0, 0, x),
        ],
        lambda x, y: [np.where(x >= 0, x, 0), np.where(x >= 0, 0, x), np.where(x <= 0, 0, x)],
    ),
    "extremes": (
        lambda x, y: [nodes.smaller(x, y), nodes.larger(x, y), nodes.unary(Operation.SIGN, x)],
        lambda x, y: [
            np.where(x < y, x, y),
            np.where(x > y, x, y),
            np.where(x > 0, 1, np.where(x < 0, -1, 0)),
        ],
    ),
    "exponentials": (
        lambda x, y: [nodes.exp(x), nodes.log(x), nodes.log1p(x), nodes.expm1(x)],
        lambda x, y: [np.exp(x), np.log(x), np.log1p(x), np.expm1(x)],
    ),
    "angles": (
        lambda x, y: [
            nodes.sin(x),
            nodes.cos(x),
            nodes.tan(x),
            nodes.arctan(x),
            nodes.arcsin(x),
            nodes.arccos(x),
        ],
        lambda x, y: [np.sin(x), np.cos(x), np.tan(x), np.arctan(x), np.arcsin(x), np.arccos(x)],
    ),
    "hyperbolics": (
        lambda x, y: [nodes.sinh(x), nodes.cosh(x), nodes.tanh(x), nodes.arcsinh(x)],
        lambda x, y: [np.sinh(x), np.cosh(x), np.tanh(x), np.arcsinh(x)],
    ),
    "powers": (
        lambda x, y: [x**y, x**3, x**-2, x**0.5, x**-1.5, x**1.7, x**7.5, x**17],
        lambda x, y: [
            np.power(x, y),
            *(np.power(x, k) for k in (3.0, -2.0, 0.5, -1.5, 1.7, 7.5, 17.0)),
        ],
    ),
}


def arguments(kind, ordinary):
    """Ordinary numbers in pairs and, unless only those are wanted, every pair of the ends."""
    rng = np.random.default_rng(2)
    x, y = rng.uniform(-3, 3, (2, 64))
    if not ordinary:
        with np.errstate(over="ignore"):
            ends = np.unique(ENDS.astype(kind))
        x, y = (
            np.concatenate([x, np.repeat(ends, ends.size)]),
            np.concatenate([y, np.tile(ends, ends.size)]),
        )
    return x.astype(kind), y.astype(kind)


@pytest.mark.parametrize("number", NUMBERS.values(), ids=NUMBERS)
@pytest.mark.parametrize("name", OPERATIONS)
def test_an_operation_in_lanes_means_what_it_means_in_numpy(name, number):
    """Constant powers that are products, and sums in the fast arithmetic, are held to ordinary
    numbers.
    """
    kind, tolerance = (np.float64, 4e-15) if number.bits == 64 else (np.float32, 2e-6)
    x, y = arguments(kind, ordinary=name == "powers")
    if name == "powers":
        x = np.abs(x) + kind(0.1)
    symbolic, numeric = OPERATIONS[name]
    with np.errstate(all="ignore"):
        expected = np.column_stack([np.asarray(column, dtype=kind) for column in numeric(x, y)])
    np.testing.assert_allclose(run(number, symbolic, x, y), expected, rtol=tolerance, atol=0)


@pytest.mark.parametrize("number", NUMBERS.values(), ids=NUMBERS)
def test_the_printers_own_operations_choose_lane_by_lane(number):
    block = emit.FunctionBody((), number)
    a = block.load("x", 0)
    b = block.load("x", 1)
    for i, (operation, operands) in enumerate(
        [
            (Operation.MAXIMUM, (a, b)),
            (Operation.MINIMUM, (a, b)),
            (Operation.SELECT, (a, b, a)),
            (Operation.AND, (a, b)),
        ]
    ):
        block.store("y", i, block.operate(operation, operands))
    engine = engine_of(object_code(emit.function("f", ["x", "y"], block)))
    kind = np.float64 if number.bits == 64 else np.float32
    x, y = (
        column.astype(kind)
        for column in ([0.0, 1.0, 0.0, -2.0] * 5, np.arange(20.0))
        for column in [np.array(column)]
    )
    found = call(engine, number, (x, y), 4)
    expected = [np.maximum(x, y), np.minimum(x, y), np.where(x != 0, y, x), x * y]
    np.testing.assert_array_equal(found, np.column_stack(expected))


def test_an_unknown_operation_is_refused_in_lanes_too():
    block = emit.FunctionBody((), NUMBERS["8 doubles"])
    with pytest.raises(TraceError, match="operation SYMBOL has no LLVM form"):
        block.operate(Operation.SYMBOL, [])


def units_of_last_place(found, exact):
    """Errors against extended precision, where the result is an ordinary number."""
    with np.errstate(all="ignore"):
        usual = np.isfinite(found) & (np.abs(exact) > 1e-290) & (np.abs(exact) < 1e300)
    return np.abs(found[usual] - exact[usual]) / np.spacing(np.abs(found[usual]))


extended = pytest.mark.skipif(
    np.finfo(np.longdouble).nmant <= 52, reason="no extended precision to compare with"
)


@extended
def test_exp_errs_by_less_than_a_unit_over_its_whole_range():
    x = np.concatenate(
        [
            np.linspace(-745, 709.7, 40001),
            np.linspace(-1, 1, 20001),
            10.0 ** np.linspace(-300, 0, 301),
        ]
    )
    found = run(NUMBERS["16 doubles"], lambda x: [nodes.exp(x)], x)[:, 0]
    assert units_of_last_place(found, np.exp(x.astype(np.longdouble))).max() < 0.9
    tiny = np.exp(x.astype(np.longdouble)) < 1e-290
    assert np.abs(found[tiny] - np.exp(x[tiny])).max() <= 1e-305
    np.testing.assert_array_equal(
        run(NUMBERS["16 doubles"], lambda x: [nodes.exp(x)], [710.0, 1e9, -746.0, -1e9, -0.0])[
            :, 0
        ],
        [np.inf, np.inf, 0.0, 0.0, 1.0],
    )


@extended
def test_log_errs_by_less_than_a_unit_over_its_whole_range():
    x = np.concatenate(
        [
            10.0 ** np.linspace(-323, 308, 40001),
            1 + np.linspace(-0.3, 0.42, 20001),
            [5e-324, 2.0**-1022],
        ]
    )
    found = run(NUMBERS["16 doubles"], lambda x: [nodes.log(x)], x)[:, 0]
    exact = np.log(x.astype(np.longdouble))
    near = exact != 0
    assert (np.abs(found[near] - exact[near]) / np.spacing(np.abs(found[near]))).max() < 0.51
    np.testing.assert_array_equal(
        run(NUMBERS["16 doubles"], lambda x: [nodes.log(x)], [0.0, -0.0, 1.0, -1.0, np.inf])[:, 0],
        [-np.inf, -np.inf, 0.0, np.nan, np.inf],
    )


@extended
def test_pow_errs_by_about_a_unit_over_its_whole_range():
    rng = np.random.default_rng(4)
    x = np.concatenate([10.0 ** rng.uniform(-300, 300, 40000), rng.uniform(0.5, 2, 40000)])
    y = np.concatenate([rng.uniform(-1, 1, 40000), rng.uniform(-900, 900, 40000)])
    found = run(NUMBERS["16 doubles"], lambda x, y: [x**y], x, y)[:, 0]
    with np.errstate(all="ignore"):
        exact = np.power(x.astype(np.longdouble), y.astype(np.longdouble))
    assert units_of_last_place(found, exact).max() < 1.1


def steady_power(number, x, y):
    """x**y in lanes with an exponent that stands among what depends on parameters alone."""
    block = emit.FunctionBody((), number)
    block.store("y", 0, block.power(block.load("x", 0), block.load("c", 0)))
    parts = [vector_math.definition(name, count, number) for name, count in block.needed.items()]
    text = emit.function("f", ["x", "c", "y"], block)
    engine = engine_of(object_code("\n".join([vector_math.declarations({number}), *parts, text])))
    function = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3)(engine.get_function_address("f"))
    kind = np.float64 if number.bits == 64 else np.float32
    found = []
    arrays = [aligned_array((1, number.lanes), kind) for _ in range(3)]
    for at in range(0, x.size, number.lanes):
        rows = np.minimum(np.arange(at, at + number.lanes), x.size - 1)
        arrays[0][0] = x[rows]
        arrays[1][0] = y[rows]
        function(*(array.ctypes.data for array in arrays))
        found.append(arrays[2][0].copy())
    return np.concatenate(found)[: x.size]


@extended
@pytest.mark.parametrize("number", NUMBERS.values(), ids=NUMBERS)
def test_a_power_with_a_steady_exponent_errs_by_less_than_1e_12(number):
    """In single precision by less than 2e-6; in the range of a polytropic process much less."""
    kind, widest, tolerance, usual = (
        (np.float64, 300, 1e-12, 3e-15) if number.bits == 64 else (np.float32, 37, 2e-6, 6e-7)
    )
    rng = np.random.default_rng(5)
    x = np.concatenate(
        [10.0 ** rng.uniform(-widest, widest, 20000), rng.uniform(0.05, 20, 20000)]
    ).astype(kind)
    y = np.concatenate([rng.uniform(-1, 1, 20000), rng.uniform(1.001, 1.667, 20000)]).astype(kind)
    exact = np.power(x.astype(np.longdouble), y.astype(np.longdouble))
    error = np.abs(steady_power(number, x, y) / exact - 1)
    assert error.max() < tolerance
    assert error[20000:].max() < usual


@pytest.mark.parametrize("number", NUMBERS.values(), ids=NUMBERS)
def test_a_power_with_a_steady_exponent_has_the_exceptions_of_ieee_754_in_each_lane_alone(number):
    kind, tolerance = (np.float64, 1e-12) if number.bits == 64 else (np.float32, 2e-6)
    with np.errstate(over="ignore"):
        ends = np.unique(ENDS.astype(kind))
    x, y = np.repeat(ends, ends.size), np.tile(ends, ends.size)
    with np.errstate(all="ignore"):
        np.testing.assert_allclose(
            steady_power(number, x, y), np.power(x, y), rtol=tolerance, atol=0
        )
    usual = np.linspace(0.5, 9.0, number.lanes).astype(kind)
    beside = usual.copy()
    beside[1] = 0.0
    exponents = np.full(number.lanes, 1.2, kind)
    alone = steady_power(number, usual, exponents)
    together = steady_power(number, beside, exponents)
    assert together[1] == 0.0
    np.testing.assert_array_equal(np.delete(alone, 1), np.delete(together, 1))


@extended
@pytest.mark.parametrize(
    ("symbolic", "exact"), [(nodes.sin, np.sin), (nodes.cos, np.cos)], ids=["sin", "cos"]
)
def test_sin_and_cos_err_by_less_than_a_unit(symbolic, exact):
    """Also next to multiples of a quarter turn; what is large, infinite or NaN is left to the C
    library.
    """
    quarters = np.arange(-600.0, 600.0) * np.pi / 2
    x = np.concatenate(
        [
            np.linspace(-10, 10, 40001),
            quarters,
            np.nextafter(quarters, 1e9),
            np.linspace(-9e5, 9e5, 40001),
        ]
    )
    found = run(NUMBERS["16 doubles"], lambda x: [symbolic(x)], x)[:, 0]
    reduced = exact(x.astype(np.longdouble))
    assert units_of_last_place(found, reduced).max() < 0.85
    x = np.array([0.0, -0.0, 1e-300, 1e7, -1e22, 1e300, np.inf, np.nan, 0.5])
    with np.errstate(all="ignore"):
        np.testing.assert_allclose(
            run(NUMBERS["16 doubles"], lambda x: [symbolic(x)], x)[:, 0], exact(x), rtol=2e-16
        )


def test_pow_has_the_exceptions_of_ieee_754():
    ends = np.concatenate([ENDS, [-2.5, -0.5, 1.5, -1.5, 2.0**53, -(2.0**53) - 2, 4.0, -4.0]])
    x, y = np.repeat(ends, ends.size), np.tile(ends, ends.size)
    found = run(NUMBERS["16 doubles"], lambda x, y: [x**y], x, y)[:, 0]
    with np.errstate(all="ignore"):
        expected = np.power(x, y)
    np.testing.assert_allclose(found, expected, rtol=1e-14, atol=0)
    np.testing.assert_array_equal(
        np.signbit(found[~np.isnan(expected)]), np.signbit(expected[~np.isnan(expected)])
    )
