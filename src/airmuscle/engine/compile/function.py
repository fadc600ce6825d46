"""Expressions as compiled functions of arrays, at one point or at several side by side; rates with disturbances."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core import Array
from .cache.kernel import evaluate
from .cache.store import load_module
from .functions import PARAMETERS, Printer
from .llvm import vector_math
from .llvm.emit import LlvmLanguage, LlvmType
from .program import CompiledSystem, Program, prepare_function


class Function:
    """CasADi expressions of vectors, compiled: `address` is that of a function of the inputs' and outputs' arrays.

    A matrix is written row by row. The machine code lives as long as this object.
    """

    def __init__(self, inputs: dict[str, Any], outputs: dict[str, Any]) -> None:
        import casadi

        rows = {name: casadi.densify(casadi.vec(casadi.SX(value).T)) for name, value in outputs.items()}
        printer = Printer()
        printer.add("function", inputs, rows)
        self._engine = load_module(printer.module())
        self.address = int(self._engine.get_function_address("function"))


LANES = 8
"""Points of one call: the widest register (chosen)."""
_ALIGNMENT = 64


class LanesFunction:
    """CasADi expressions of vectors, compiled for several points at once; `address`: f(inputs..., outputs...).

    Element i of an input or output is a row of `lanes` numbers, in arrays that `lanes_array` gives for LANES points.
    The machine code lives as long as this object.
    """

    def __init__(self, inputs: dict[str, Any], outputs: dict[str, Any], lanes: int = LANES) -> None:
        import casadi

        number = LlvmType(lanes=lanes)
        printer = Printer(LlvmLanguage(number))
        printer.add("function", inputs, {name: casadi.densify(casadi.SX(value)) for name, value in outputs.items()})
        parts = [vector_math.definition(name, count, number) for name, count in printer.needed.items()]
        text = "\n".join([vector_math.declarations({number}), *parts, printer.module()])
        self._engine = load_module(text)
        self.address = int(self._engine.get_function_address("function"))


def lanes_array(*shape: int) -> Array:
    """An array of zeros whose last dimension has LANES numbers, aligned as vectors must be."""
    count = int(np.prod(shape)) * LANES
    raw = np.zeros(count + _ALIGNMENT // 8)
    start = (-raw.ctypes.data % _ALIGNMENT) // 8
    return raw[start : start + count].reshape(*shape, LANES)


@dataclasses.dataclass(frozen=True, eq=False)
class AugmentedRates:
    """Compiled functions of z = (x, theta, d): states (n,), parameters that are estimated, and disturbances of rates.

    rates(z, u, c, f, A)      f (n,) rates with f_i + d_i where there is a disturbance, A = df/dz (n, N)
    measured(z, u, c, y, C)   measured columns (p,) and dy/dz (p, N)
    outputs(z, u, c, o)       all outputs (k,)

    `constants` is the array c. Parameters and disturbances have no rates: they are constant but for noise.
    """

    engine: Any
    constants: Array
    rates: int
    measured: int
    outputs: int


def augmented_rates(
    ready: CompiledSystem, measured: Sequence[int], parameters: Sequence[int], disturbed: Sequence[int]
) -> AugmentedRates:
    """The functions of a system; `measured` are columns among states and outputs, `parameters` indices of leaves and
    `disturbed` indices of states."""
    text, held = _module(ready.program, measured, parameters, disturbed)
    engine = load_module(text)
    addresses = (int(engine.get_function_address(name)) for name in ("rates", "measured", "outputs"))
    return AugmentedRates(engine, prepare_function(engine)(ready.parameters, held), *addresses)


def _module(
    program: Program, measured: Sequence[int], parameters: Sequence[int], disturbed: Sequence[int]
) -> tuple[str, int]:
    """LLVM text of the functions, and the length of `c`."""
    import casadi

    t = program.traced
    n = t.x.numel()
    z = casadi.SX.sym("z", n + len(parameters) + len(disturbed))
    values = [t.p[i] for i in range(t.p.numel())]
    for k, index in enumerate(parameters, n):
        values[index] = z[k]
    f, o = casadi.Function("system", [t.x, t.u, t.p], [t.f, t.o])(z[:n], t.u, casadi.vertcat(*values))
    for k, index in enumerate(disturbed, n + len(parameters)):
        f[index] += z[k]
    columns = casadi.vertcat(z[:n], o)
    y = casadi.vertcat(*(columns[i] for i in measured))
    printer, point = Printer(), {"z": z, "u": t.u, PARAMETERS: t.p}
    printer.add("rates", point, {"f": casadi.densify(f), "A": _by_row(casadi.jacobian(f, z))})
    printer.add("measured", point, {"y": casadi.densify(y), "C": _by_row(casadi.jacobian(y, z))})
    printer.add("outputs", point, {"o": casadi.densify(o)})
    return printer.module(), printer.held


def _by_row(matrix: Any) -> Any:
    import casadi

    return casadi.densify(casadi.vec(matrix.T))


def states_and_outputs(functions: AugmentedRates, count: int, states: Array, inputs: Array, outputs: int) -> Array:
    """States and outputs (M, n + k) at augmented states (M, N) under inputs (M, m); `count` is n, `outputs` is k."""
    values = np.empty((len(states), outputs))
    evaluate(functions.outputs, functions.constants, np.ascontiguousarray(states), np.ascontiguousarray(inputs), values)
    return np.hstack([states[:, :count], values])
