"""A system ready to run: machine code shared by all of its structure, and its own parameters."""

from __future__ import annotations

import ctypes
import dataclasses
import functools
import threading
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from ..core import tree
from ..core.system import SensitivitySystem, System
from . import functions, sensitivities, sensitivities_explicit
from .functions import ArraySizes, TracedSystem
from .functions_simd import lanes_module
from .llvm.jit import jit_compile
from .llvm.types import LlvmType

_FUNCTIONS = ("rhs", "jac", "factor", "solve", "stage", "drift", "outputs")


class Program:
    """The compiled functions of one structure; it keeps the machine code alive and is never pickled."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._form: TracedSystem | sensitivities.TangentSystem
        if isinstance(system, SensitivitySystem):
            self._form = sensitivities.tangent_system(system)
            text, self.sizes = sensitivities.implicit_module(self._form)
        else:
            self._form = functions.trace_system(system)
            text, self.sizes = functions.implicit_module(self._form)
        self.output_names = self._form.output_names
        self._engine = jit_compile(text)
        self.address = {name: int(self._engine.get_function_address(name)) for name in _FUNCTIONS}
        self._prepare = _preparing(self._engine)
        self._steps: dict[Any, tuple[Any, int]] = {}
        self._compiling = threading.Lock()  # of two threads that ask for a step, one makes it: an engine must not go

    @functools.cached_property
    def traced(self) -> TracedSystem:
        """The system's own rates and outputs as expressions, also of a differentiated one."""
        return self._form if isinstance(self._form, TracedSystem) else functions.trace_system(self._system)

    def precompute(self, parameters: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """What the functions need of a set of parameters, computed once."""
        return self._prepare(parameters, self.sizes.held)

    def step(
        self, a: tuple[tuple[float, ...], ...], b: tuple[float, ...], parameters: npt.NDArray[np.float64]
    ) -> tuple[int, npt.NDArray[np.float64]]:
        """The address of an explicit step of this tableau, and what it needs of the parameters."""
        with self._compiling:
            if (a, b) not in self._steps:
                text, held = self._printed_step(a, b)
                self._steps[a, b] = jit_compile(text), held
        engine, held = self._steps[a, b]
        return int(engine.get_function_address("step")), _preparing(engine)(parameters, held)

    def _printed_step(self, a: tuple[tuple[float, ...], ...], b: tuple[float, ...]) -> tuple[str, int]:
        if isinstance(self._form, sensitivities.TangentSystem):
            return sensitivities_explicit.explicit_module(self._form, a, b)
        return functions.explicit_module(self._form, a, b)

    def lanes(
        self, a: tuple[tuple[float, ...], ...], b: tuple[float, ...], number: LlvmType
    ) -> tuple[tuple[int, int, int], int]:
        """The addresses of `prepare`, the explicit step and `outputs` in lanes, and how long `c` must be."""
        with self._compiling:
            if (a, b, number) not in self._steps:
                text, held = lanes_module(self.traced, a, b, number)
                self._steps[a, b, number] = jit_compile(text), held
        engine, held = self._steps[a, b, number]
        prepare, step, outputs = (int(engine.get_function_address(n)) for n in ("prepare", "step", "outputs"))
        return (prepare, step, outputs), held


_PREPARE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)


def _preparing(engine: Any) -> Callable[[npt.NDArray[np.float64], int], npt.NDArray[np.float64]]:
    """What a set of parameters leaves for functions of this machine code, so many numbers."""
    function = _PREPARE(engine.get_function_address("prepare"))

    def prepare(parameters: npt.NDArray[np.float64], size: int) -> npt.NDArray[np.float64]:
        handed = np.zeros(max(size, 1))
        function(parameters.ctypes.data, handed.ctypes.data)
        return handed

    return prepare


_programs: dict[Any, Program] = {}


@dataclasses.dataclass(frozen=True, eq=False)
class CompiledSystem:
    """A system with its program: addresses, parameters, and the layout of its arrays."""

    system: System
    program: Program
    parameters: npt.NDArray[np.float64]
    precomputed: npt.NDArray[np.float64]
    known_nominal: npt.NDArray[np.float64] | None = None
    """The nominal sizes of the states, where they are not to be asked of the system."""

    @property
    def sizes(self) -> ArraySizes:
        """Lengths of the arrays that the functions read and write."""
        return self.program.sizes

    @property
    def address(self) -> dict[str, int]:
        """The functions' addresses by name."""
        return self.program.address

    @property
    def output_names(self) -> tuple[str, ...]:
        """The outputs, in the order of their vector."""
        return self.program.output_names

    def nominal(self) -> npt.NDArray[np.float64]:
        """The size of each state below which its relative error no longer matters."""
        return np.array([s.nominal for s in self.system.states]) if self.known_nominal is None else self.known_nominal

    def at(self, parameters: npt.NDArray[np.float64], nominal: npt.NDArray[np.float64]) -> CompiledSystem:
        """The same system with other parameters, its nominal sizes given: for those who change them often."""
        return CompiledSystem(self.system, self.program, parameters, self.program.precompute(parameters), nominal)

    def call(self, name: str, *arrays: npt.NDArray[np.float64] | float) -> None:
        """Call one printed function by hand; arrays are passed by address, floats by value."""
        kinds = [ctypes.c_double if isinstance(a, float) else ctypes.c_void_p for a in arrays]
        values = [a if isinstance(a, float) else a.ctypes.data for a in arrays]
        ctypes.CFUNCTYPE(None, *kinds)(self.address[name])(*values)

    def rates(self, state: Sequence[float], inputs: Sequence[float]) -> npt.NDArray[np.float64]:
        """The compiled rates at a state vector (n,) under inputs (m,)."""
        x, u = np.array(state, dtype=float), np.array(inputs, dtype=float)
        f = np.empty(self.sizes.states)
        self.call("rhs", x, u, self.precomputed, f)
        return f


def compile_system(system: System) -> CompiledSystem:
    """The system with compiled functions. Another parameter set of the same structure costs nothing."""
    key = tree.structure(system)
    if key not in _programs:
        _programs[key] = Program(system)
    program = _programs[key]
    parameters = tree.flatten(system)
    return CompiledSystem(system, program, parameters, program.precompute(parameters))
