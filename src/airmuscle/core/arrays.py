"""Arrays of double-precision floats, and traced functions evaluated on whole arrays.

CasADi evaluates a function point by point, which takes about 10 us each. NumPy needs a few
microseconds per instruction for all points together. Instructions that the required outputs do not
need are left out.
"""

import contextlib
import ctypes
import functools
import math
import os
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
"""A NumPy array of float64."""
NUMBERS = frozenset({float, int, np.float64})
"""Types of numbers that need no conversion."""
FEW = 64
"""Numbers up to which a Python loop is faster than NumPy (measured)."""


def as_slice(rows: npt.NDArray[np.intp]) -> slice | npt.NDArray[np.intp]:
    """Ascending indices as a slice where they are successive, which copies no rows."""
    if rows.size and rows[-1] - rows[0] + 1 == rows.size:
        return slice(int(rows[0]), int(rows[-1]) + 1)
    return rows


def all_finite(values: Array) -> bool:
    """Whether all numbers of an array are finite."""
    if values.size > FEW:
        return bool(np.isfinite(values).all())
    return all(map(math.isfinite, values.ravel().tolist()))


def flat_view(array: npt.NDArray[Any]) -> Any:
    """A view of a C-contiguous array whose items are read and written as plain numbers, faster than
    those of NumPy.
    """
    items: Any = array.reshape(-1)
    return memoryview(items)


MIN_POINTS = 50
"""Points below which CasADi itself is faster (chosen)."""


class _Step(NamedTuple):
    operation: Callable[..., Any]
    target: int
    sources: tuple[int, ...]
    released: tuple[int, ...] = ()
    """Registers that no later step reads, and that are no output: their memory is used again while
    it is cached.
    """


class ArrayProgram(NamedTuple):
    """The instructions for some non-zeros of one output of a traced function."""

    size: int
    """Number of registers."""
    constants: tuple[tuple[int, float], ...]
    """Register and value."""
    inputs: tuple[tuple[int, int, int], ...]
    """Register, argument and element."""
    steps: tuple[_Step, ...]
    outputs: tuple[tuple[int, int], ...]
    """Column and register."""

    def columns(self, arguments: Sequence[Array], parameters: Sequence[float], count: int) -> Array:
        """The required columns of the output at N points, shape (N, count); columns without an
        instruction are 0.
        """
        registers: list[Any] = [0.0] * self.size
        for register, value in self.constants:
            registers[register] = value
        for register, argument, element in self.inputs:
            registers[register] = (
                arguments[argument] if argument < len(arguments) else parameters[element]
            )
        with np.errstate(all="ignore"):
            for operation, target, sources, released in self.steps:
                registers[target] = operation(*[registers[i] for i in sources])
                for register in released:
                    registers[register] = None
        result = np.zeros((count, arguments[0].size))
        for column, register in self.outputs:
            result[column] = registers[register]
        return result.T


def instructions_of(function: Any) -> Iterator[tuple[int, list[int], list[int]]]:
    """Operation, places of the results and places of the arguments of each instruction of a CasADi
    function.
    """
    for k in range(function.n_instructions()):
        yield (
            function.instruction_id(k),
            function.instruction_output(k),
            function.instruction_input(k),
        )


def make_program(function: Any, output: int, columns: Sequence[int]) -> ArrayProgram | None:
    """The instructions for these columns of one output (a row) of a CasADi function; None where
    NumPy lacks one.

    Column number k of the program is the k-th of `columns`. Every result has a register of its own.
    """
    import casadi

    operations = _operations()
    current = dict[int, int]()
    nonzeros = function.sparsity_out(output).get_col()
    constants = []
    inputs = []
    results = []
    outputs = []
    for k, (code, target, source) in enumerate(instructions_of(function)):
        if code == casadi.OP_OUTPUT:
            if target[0] == output and nonzeros[target[1]] in columns:
                outputs.append((columns.index(nonzeros[target[1]]), current[source[0]]))
            continue
        if code == casadi.OP_CONST:
            constants.append((k, float(function.instruction_constant(k))))
        elif code == casadi.OP_INPUT:
            inputs.append((k, int(source[0]), int(source[1])))
        elif code in operations:
            results.append((operations[code], k, tuple(current[i] for i in source)))
        else:
            return None
        current[target[0]] = k
    used = {register for _, register in outputs}
    steps = list[_Step]()
    for operation, register, sources in reversed(results):
        if register in used:
            steps.append(_Step(operation, register, sources, tuple(set(sources) - used)))
            used.update(sources)
    constants = [each for each in constants if each[0] in used]
    inputs = [each for each in inputs if each[0] in used]
    return ArrayProgram(
        function.n_instructions(),
        tuple(constants),
        tuple(inputs),
        tuple(steps[::-1]),
        tuple(outputs),
    )


def _if_else_zero(condition: Any, x: Any) -> Any:
    """`x` where the condition holds, else 0; one number where it holds nowhere, as in most
    extrapolation terms.
    """
    holds = np.not_equal(condition, 0.0)
    if holds.all():
        return x
    return np.where(holds, x, 0.0) if holds.any() else 0.0


@functools.cache
def _operations() -> dict[int, Callable[..., Any]]:
    """NumPy functions by CasADi's number of the operation."""
    import casadi

    named: dict[str, Callable[..., Any]] = {
        "ASSIGN": lambda x: x,
        "ADD": np.add,
        "SUB": np.subtract,
        "MUL": np.multiply,
        "DIV": np.divide,
        "NEG": np.negative,
        "SQ": lambda x: x * x,
        "TWICE": lambda x: x + x,
        "INV": lambda x: np.divide(1.0, x),
        "SQRT": np.sqrt,
        "FABS": np.abs,
        "SIGN": np.sign,
        "FLOOR": np.floor,
        "POW": np.power,
        "CONSTPOW": np.power,
        "EXP": np.exp,
        "LOG": np.log,
        "LOG1P": np.log1p,
        "EXPM1": np.expm1,
        "SIN": np.sin,
        "COS": np.cos,
        "TAN": np.tan,
        "ASIN": np.arcsin,
        "ACOS": np.arccos,
        "ATAN": np.arctan,
        "SINH": np.sinh,
        "COSH": np.cosh,
        "TANH": np.tanh,
        "ASINH": np.arcsinh,
        "FMIN": np.fmin,
        "FMAX": np.fmax,
        "LT": lambda a, b: np.less(a, b) * 1.0,
        "LE": lambda a, b: np.less_equal(a, b) * 1.0,
        "EQ": lambda a, b: np.equal(a, b) * 1.0,
        "NE": lambda a, b: np.not_equal(a, b) * 1.0,
        "NOT": lambda a: np.equal(a, 0.0) * 1.0,
        "AND": lambda a, b: np.logical_and(a, b) * 1.0,
        "OR": lambda a, b: np.logical_or(a, b) * 1.0,
        "IF_ELSE_ZERO": _if_else_zero,
    }
    return {getattr(casadi, f"OP_{name}"): operation for name, operation in named.items()}


BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables that limit the threads of linear algebra, which a process reads when it
loads the library.
"""


@contextlib.contextmanager
def one_thread() -> Iterator[None]:
    """One thread for the linear algebra of this process, unless the environment states a number.

    NumPy and SciPy load a copy of OpenBLAS each. Without effect for another library.
    """
    from numpy.linalg import _umath_linalg
    from scipy.linalg import _fblas

    before = []
    stated = any(name in os.environ for name in BLAS_THREADS)
    for module, suffix in () if stated else ((_umath_linalg, "64_"), (_fblas, "")):
        with contextlib.suppress(OSError, AttributeError):
            library = ctypes.CDLL(module.__file__)
            get, limit = (
                getattr(library, f"scipy_openblas_{verb}_num_threads{suffix}")
                for verb in ("get", "set")
            )
            before.append((limit, get()))
    try:
        for limit, _ in before:
            limit(1)
        yield
    finally:
        for limit, count in before:
            limit(count)
