"""Compiled sample of a control law: measurements, set points and memory to commands and memory, as
machine code.
"""

import array
import ctypes
import itertools
import math
from typing import NamedTuple

import numpy as np

from ...core import Array, Node, TraceError, autodiff, nodes, tree
from ..compile.function import Function
from ..loop import ControlLaw, Measurement

UNLIMITED = (-math.inf, math.inf)
"""Range of an input that a measurement does not contain."""
_functions: dict[tuple[tree.Structure, int], Function] = {}


def compiled_sample(law: ControlLaw, lanes: int = 1) -> Function:
    """A function (measured, setpoints, memory, minimum, maximum, sample time, parameters, commands,
    memory), with `lanes` above 1 of so many loops at once, one a lane.

    Control laws of one structure share it. Raises TraceError if the law cannot be traced.
    """
    key = tree.structure(law), lanes
    if key not in _functions:
        known = trace_sample(law)._asdict()
        results = {name: known.pop(name) for name in ("commands", "later")}
        _functions[key] = Function(known, results, lanes)
    return _functions[key]


class LawSample:
    """The sample of a control law as machine code that is called from Python; its memory is a
    tuple.

    Raises TraceError if the law cannot be traced.
    """

    def __init__(self, law: ControlLaw) -> None:
        self._function = compiled_sample(law)
        self._call = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 9)(self._function.address)
        self._measured = law.measured_columns
        self._setpoints = law.setpoints
        self._inputs = law.inputs
        self._parameters = parameters_of(law).tolist()
        self.initial = tuple(float(value) for value in law.initial_memory.values())
        sizes = (
            len(self._measured),
            len(self._setpoints),
            len(self.initial),
            len(self._inputs),
            len(self._inputs),
            1,
            len(self._parameters),
            len(self._inputs),
            len(self.initial),
        )
        self._ends = list(itertools.accumulate(sizes))
        self._offsets = [8 * (end - size) for end, size in zip(self._ends, sizes, strict=True)]

    def step(
        self, memory: tuple[float, ...], measurement: Measurement, dt: float
    ) -> tuple[dict[str, float], tuple[float, ...]]:
        """The commands of a sample and the memory after it, as `ControlLaw.step`."""
        columns, setpoints, ranges = measurement
        limits = [ranges.get(name, UNLIMITED) for name in self._inputs]
        buffer = array.array(
            "d",
            (
                *[columns[name] for name in self._measured],
                *[setpoints[name] for name in self._setpoints],
                *memory,
                *[low for low, _ in limits],
                *[high for _, high in limits],
                dt,
                *self._parameters,
            ),
        )
        buffer.frombytes(bytes(8 * (self._ends[8] - self._ends[6])))
        start = buffer.buffer_info()[0]
        self._call(*[start + offset for offset in self._offsets])
        commands = dict(zip(self._inputs, buffer[self._ends[6] : self._ends[7]], strict=True))
        return commands, tuple(buffer[self._ends[7] :])


def parameters_of(law: ControlLaw) -> Array:
    """The parameters of a law, for its compiled sample: at least one number, so that the array has
    an address.
    """
    parameters = tree.flatten(law)
    return parameters if len(parameters) else np.zeros(1)


class TracedSample(NamedTuple):
    """A sample of a control law as expressions; the arguments are vectors in the order of the names
    of the law.
    """

    measured: list[Node]
    setpoints: list[Node]
    memory: list[Node]
    minimum: list[Node]
    maximum: list[Node]
    sample_time: list[Node]
    parameters: list[Node]
    commands: list[Node]
    later: list[Node]


def trace_sample(law: ControlLaw) -> TracedSample:
    """A sample of a law with symbols. Raises TraceError if the law cannot be traced."""
    symbolic, parameters = autodiff.symbolic(law)
    names = {
        "measured": law.measured_columns,
        "setpoints": law.setpoints,
        "memory": tuple(law.initial_memory),
        "minimum": law.inputs,
        "maximum": law.inputs,
        "sample_time": ("sample_time",),
    }
    vectors = {key: nodes.symbols(key, len(of_key)) for key, of_key in names.items()}
    by_name = {key: dict(zip(of_key, vectors[key], strict=True)) for key, of_key in names.items()}
    ranges = {name: (by_name["minimum"][name], by_name["maximum"][name]) for name in law.inputs}
    measurement = Measurement(by_name["measured"], by_name["setpoints"], ranges)
    owner = type(law).__name__
    try:
        commands, memory = symbolic.step(by_name["memory"], measurement, vectors["sample_time"][0])
        commanded = nodes.as_nodes([commands[name] for name in law.inputs])
        later = nodes.as_nodes([memory[name] for name in names["memory"]])
    except KeyError as missing:
        raise TraceError(
            f"{owner}.step does not return {missing}; it must return a value for each of"
            f" {', '.join(law.inputs)}, and for each of its memory:"
            f" {', '.join(names['memory']) or 'none'}."
        ) from None
    except (TypeError, ValueError, RuntimeError, TraceError) as reason:
        raise TraceError(
            f"{owner}.step cannot be compiled ({' '.join(str(reason).split())[:160]}). Use"
            " airmuscle.core.ops instead of math, numpy and `if`, or derive the controller from"
            " Controller."
        ) from None
    autodiff.check_finite([*commanded, *later], f"{owner}.step")
    return TracedSample(**vectors, parameters=parameters, commands=commanded, later=later)
