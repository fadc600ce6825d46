"""Compiled systems: machine code shared by all systems of one structure, and the data of one
system.
"""

import ctypes
import dataclasses
import functools
import math
import threading
import weakref
from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from ...core import Array, SensitivitySystem, System, nodes, tree
from . import functions, sensitivities, sensitivities_explicit
from .cache.kernel import address_of
from .cache.store import load_module
from .functions import ArraySizes, TracedSystem
from .functions_simd import lanes_module, row_outputs, rows_at_once
from .llvm.emit import LlvmType
from .llvm.groups import LaneGroups
from .llvm.processor import processor


class Pool:
    """Objects that one run at a time may use, by a key; with more keys than `max_keys` all of them
    are dropped.
    """

    def __init__(self, max_keys: int = 1_000) -> None:
        self._idle: dict[Hashable, list[Any]] = {}
        self._max_keys = max_keys

    def __len__(self) -> int:
        """The number of keys."""
        return len(self._idle)

    def borrow(self, key: Hashable) -> Any:
        """An object that no other run uses; None where there is none."""
        try:
            return self._idle[key].pop()
        except (KeyError, IndexError):  # none, or another thread was quicker
            return None

    def give_back(self, key: Hashable, used: Any) -> None:
        """Keep an object for the next run."""
        if key not in self._idle and len(self._idle) >= self._max_keys:
            self._idle.clear()
        self._idle.setdefault(key, []).append(used)


@dataclasses.dataclass(eq=False)
class RunCache:
    """What runs of one system leave for the next one; it belongs to the system's description.

    A run takes over what the last one checked or computed if its arguments are the same, and
    borrows bound kernels.

    default_state  the default initial state (n,), once it has been found
    checked_state  the last initial state that was checked and found possible
    checked_input  the last segments of inputs that were found within their ranges, what output
                   times a run with them asked for, and these times, if nobody can write to the
                   arrays
    sources        sources of the models and of an integrator, by the integrator
    integrators    integrators bound to the system, by their integrator
    holders        the same for steps with held inputs
    recorders      kernels of the rows bound to the system, under None
    loops          runs of control loops, by the form of the loop
    """

    default_state: Array | None = None
    checked_state: list[float] | None = None
    checked_input: tuple[Any, Any, Any] = None, None, None
    sources: dict[Any, tuple[Any, ...]] = dataclasses.field(default_factory=dict)
    integrators: Pool = dataclasses.field(default_factory=Pool)
    holders: Pool = dataclasses.field(default_factory=Pool)
    recorders: Pool = dataclasses.field(default_factory=Pool)
    loops: Pool = dataclasses.field(default_factory=lambda: Pool(max_keys=4))


Tableau = tuple[tuple[tuple[float, ...], ...], tuple[float, ...]]
"""Rows of an explicit Runge-Kutta tableau below its first, and its weights."""
INPUT_TOLERANCE = 1e-9
"""Part of an input's range by which it may be exceeded through rounding."""
_FUNCTIONS = ("rhs", "jac", "factor", "solve", "stage", "df_dt", "outputs")


class Module:
    """Machine code of printed functions; their addresses are valid as long as it lives. It cannot
    be pickled.
    """

    def __init__(self, text: str, held: int = 0) -> None:
        self._engine, self._addresses = load_module(text), dict[str, int]()
        self.held = held
        """The length of `c`, what the functions need of the parameters."""

    def address(self, name: str) -> int:
        """The address of a function; it is asked for once, which takes 10 us."""
        if name not in self._addresses:
            self._addresses[name] = int(self._engine.get_function_address(name))
        return self._addresses[name]

    def prepare(self, parameters: Array) -> Array:
        """The array `c` for a set of parameters."""
        values = np.zeros(max(self.held, 1))
        self._prepare(parameters.ctypes.data, address_of(values))
        return values

    @functools.cached_property
    def _prepare(self) -> Any:
        return ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(self.address("prepare"))


class Program:
    """The compiled functions of one structure; it owns the machine code and cannot be pickled."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._form: TracedSystem | sensitivities.TangentSystem
        rows = 1
        with nodes.recording():
            if isinstance(system, SensitivitySystem):
                self._form = sensitivities.tangent_system(system)
                text, self.sizes = sensitivities.implicit_module(self._form)
            else:
                self._form = functions.trace_system(system)
                rows = rows_at_once(self._form)
                extend = row_outputs(self._form) if rows > 1 else None
                text, self.sizes = functions.system_module(self._form, extend=extend)
        self.output_names = self._form.output_names
        self._module = Module(text, self.sizes.held)
        self.address = {name: self._module.address(name) for name in _FUNCTIONS}
        self.outputs_at_rows = self._module.address("row_outputs" if rows > 1 else "outputs"), rows
        """The address of the function that computes the outputs at rows, and at how many at
        once.
        """
        self._steps: dict[Tableau, Module] = {}
        self._lane_modules: dict[Any, Module] = {}
        self._compiling = (
            threading.Lock()
        )  # of two threads that need a step, one compiles it: an engine must stay

    @functools.cached_property
    def traced(self) -> TracedSystem:
        """The system's own rates and outputs as expressions, also of a differentiated one."""
        return (
            self._form
            if isinstance(self._form, TracedSystem)
            else functions.trace_system(self._system)
        )

    def precompute(self, parameters: Array) -> Array:
        """Values that the functions need of a set of parameters, computed once."""
        return self._module.prepare(parameters)

    def step(self, tableau: Tableau, parameters: Array) -> tuple[int, Array]:
        """The address of an explicit step with this tableau, and the values that it needs of the
        parameters.
        """
        with self._compiling:
            if tableau not in self._steps:
                if isinstance(self._form, TracedSystem):
                    printed = functions.explicit_module(self._form, *tableau)
                else:
                    printed = sensitivities_explicit.explicit_module(self._form, *tableau)
                self._steps[tableau] = Module(*printed)
        module = self._steps[tableau]
        return module.address("step"), module.prepare(parameters)

    def lanes(self, tableau: Tableau, number: LlvmType) -> tuple[tuple[int, int, int], int]:
        """The addresses of `prepare`, the explicit step and `outputs` in lanes, and the length of
        `c`.
        """
        made_for = processor()
        key = tableau, number, made_for
        with self._compiling:
            if key not in self._lane_modules:
                groups = LaneGroups(number, made_for.register)
                self._lane_modules[key] = Module(*lanes_module(self.traced, *tableau, groups))
        module = self._lane_modules[key]
        return (
            module.address("prepare"),
            module.address("step"),
            module.address("outputs"),
        ), module.held


class Description:
    """Data of one system that runs need, derived once and stored for the lifetime of the system."""

    def __init__(self, system: System) -> None:
        self.program = _program(system)
        self.parameters = tree.flatten(system)
        self.precomputed = self.program.precompute(self.parameters)
        states = system.states
        inputs = system.input_variables
        self.state_names = tuple(s.name for s in states)
        self.input_names = tuple(i.name for i in inputs)
        self.output_names = self.program.output_names
        self.nominal = np.array([s.nominal for s in states])
        self.lower_bounds = np.array(system.state_lower_bounds, dtype=float)
        self.input_minimum = np.array([i.minimum for i in inputs])
        self.input_maximum = np.array([i.maximum for i in inputs])
        with np.errstate(invalid="ignore"):
            slack = np.nan_to_num(
                INPUT_TOLERANCE * (self.input_maximum - self.input_minimum), posinf=0.0
            )
        self.input_lower_limits = self.input_minimum - slack
        self.input_upper_limits = self.input_maximum + slack
        positive = set(system.positive_outputs)
        self.positive_outputs = np.array(
            [i for i, n in enumerate(self.output_names) if n in positive], dtype=np.intp
        )
        self.constants = dict(system.constants)
        self.remarks = system.describe()
        self.cache = RunCache()
        self._name_columns()
        self._name_ranges(system)

    def _name_columns(self) -> None:
        """The columns of a run, their order, and the limits of states and inputs by their names."""
        self.column_names = (*self.state_names, *self.input_names, *self.output_names)
        self.recorded_names = ("time", *self.state_names, *self.output_names, *self.input_names)
        """The columns of a recording, in their order."""
        self.remark_texts = tuple(remark.message for remark in self.remarks)
        self.state_limits = dict(zip(self.state_names, self.lower_bounds.tolist(), strict=True))
        """The lower bound of each state by its name."""
        limits = zip(
            self.input_lower_limits.tolist(), self.input_upper_limits.tolist(), strict=True
        )
        self.input_limits = dict(zip(self.input_names, enumerate(limits), strict=True))
        """The index and the limits, with their tolerance, of each input by its name."""

    def _name_ranges(self, system: System) -> None:
        """The states and outputs that have a limit, with which their range in a run is compared."""
        names = (*self.state_names, *self.output_names)
        bounds = self.lower_bounds.tolist()
        bounded = {
            name: low for name, low in zip(self.state_names, bounds, strict=True) if low > -math.inf
        }
        positive = [self.output_names[i] for i in self.positive_outputs.tolist()]
        limited = [limit.column for limit in system.column_limits if limit.column in names]
        self.ranged_names = tuple(dict.fromkeys((*bounded, *positive, *limited)))
        self.range_places = {name: i for i, name in enumerate(self.ranged_names)}
        """The place of each of them among the ranges of a run."""
        self.ranged_columns = np.array(
            [names.index(name) for name in self.ranged_names], dtype=np.int64
        )
        """Their places among the states and, after these, the outputs."""
        self.range_floors = [*bounded.values(), *(math.ulp(0.0) for _ in positive)]
        """The smallest possible values of the first of them: those of states, then of outputs that
        must be positive.
        """


_programs: dict[tree.Structure, Program] = {}
_descriptions: dict[int, Description] = {}
"""Descriptions by the identities of their systems."""


def _program(system: System) -> Program:
    structure = tree.structure(system)
    if structure not in _programs:
        _programs[structure] = Program(system)
    return _programs[structure]


def describe(system: System) -> Description:
    """The description of a system, stored for the lifetime of the system."""
    key = id(system)
    if key not in _descriptions:
        description = Description(system)
        weakref.finalize(system, _descriptions.pop, key, None).atexit = False
        _descriptions[key] = description
    return _descriptions[key]


@dataclasses.dataclass(frozen=True, eq=False)
class CompiledSystem:
    """A system with its program: addresses, parameters, and the layout of its arrays."""

    system: System
    program: Program
    parameters: Array
    precomputed: Array
    nominal: Array
    """The size of each state below which its relative error no longer matters."""
    description: Description

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

    def at(self, parameters: Array, nominal: Array) -> "CompiledSystem":
        """The same system with other parameters and nominal sizes, for callers that change them
        often.
        """
        precomputed = self.program.precompute(parameters)
        return dataclasses.replace(
            self, parameters=parameters, precomputed=precomputed, nominal=nominal
        )

    def call(self, name: str, *arrays: Array | float) -> None:
        """Call one compiled function; arrays are passed by address, floats by value."""
        kinds = [ctypes.c_double if isinstance(a, float) else ctypes.c_void_p for a in arrays]
        values = [a if isinstance(a, float) else a.ctypes.data for a in arrays]
        ctypes.CFUNCTYPE(None, *kinds)(self.address[name])(*values)

    def rates(self, state: Sequence[float], inputs: Sequence[float]) -> Array:
        """The compiled rates at a state vector (n,) under inputs (m,)."""
        x = np.array(state, dtype=float)
        u = np.array(inputs, dtype=float)
        f = np.empty(self.sizes.states)
        self._rhs(*map(address_of, (x, u, self.precomputed, f)))
        return f

    @functools.cached_property
    def _rhs(self) -> Any:
        return ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 4)(self.address["rhs"])


def compile_system(system: System) -> CompiledSystem:
    """The system with compiled functions, at no cost where one of the same structure was compiled
    before.
    """
    known = describe(system)
    return CompiledSystem(
        system, known.program, known.parameters, known.precomputed, known.nominal, known
    )
