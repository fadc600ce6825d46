"""Printed predictive control: a sample of it with the solver of its quadratic program, in C,
JavaScript and MATLAB; and the choice of what prints a controller.
"""

import dataclasses
import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...control import LinearModelPredictive, PredictiveControl
from ...core import Array, ParameterError
from ...engine import ControlLaw, ControlLoop, Problem
from ...engine.compile.ir.emission import TargetLanguage
from ...engine.compile.kernel_text import (
    CKernels,
    JavaScriptKernels,
    MatlabKernels,
    plain_kernels,
)
from ...engine.compile.text.languages import CLanguage, JavaScriptLanguage, MatlabLanguage
from ...engine.loop import Measurement
from ...engine.run.sampled_loop import SampledLoop
from .identifiers import (
    c_integers,
    c_number,
    c_values,
    filled,
    m_array,
    provenance,
)
from .printed_controller import SINGLE_TOLERANCE, PrintedController, print_controller

TOLERANCE = 1e-9
"""Part of its range by which a command in C may differ from that in Python (chosen): sums are in
another order.
"""
SINGLE_TOLERANCES = (1e-5, 1e-3, 1e-6, 1e-5)
"""Tolerances of the quadratic program in single precision, in place of `TOLERANCES` of the law
(chosen).
"""
SIGNALS = ("y", "r")
"""Arguments of the kernel that a sample computes from its measurements and set points."""
MODULE = "predictive"
SAMPLE = "predictive_sample"
"""The kernel of a sample and its module."""
PREDICTIVE_NOTE = (
    "The quadratic program is solved by the dual active-set method that runs in Python, printed"
    " from the same source; no library is needed. A sample without a solution applies the last plan"
    " and counts it in the last number of the memory."
)


@dataclasses.dataclass(frozen=True, eq=False)
class PrintedPredictive(PrintedController):
    """A predictive controller as the kernel of its sample with its constants."""

    law: LinearModelPredictive  # type: ignore[assignment]

    def sample_in(self, language: TargetLanguage) -> str:
        """The function of a sample in another language, with the functions that it calls and its
        tables; its arguments are those of a control law.
        """
        if isinstance(language, JavaScriptLanguage):
            return self._in_javascript(language)
        if isinstance(language, MatlabLanguage):
            return self._in_matlab(language)
        assert isinstance(language, CLanguage)
        return self._in_c(language)

    @property
    def _tables(self) -> dict[str, Array]:
        """All constant arrays, by the names of the kernel; deviations from the operating point are
        scaled.
        """
        model = self.law.model
        low, high = np.array(self.ranges).T
        single = {"tolerances": np.array(SINGLE_TOLERANCES)} if self.number == "float" else {}
        return {
            **self.law.constants,
            "low": (low - model.inputs) / model.input_sizes,
            "high": (high - model.inputs) / model.input_sizes,
            **single,
        }

    @property
    def _points(self) -> dict[str, Array]:
        """The operating point, and the sizes of the inputs."""
        model = self.law.model
        return {
            "at_measured": model.measured,
            "at_controlled": model.controlled,
            "operating": model.inputs,
            "sizes": model.input_sizes,
        }

    @property
    def _memory(self) -> dict[str, tuple[int, int]]:
        """The place and the size of each array of the memory."""
        places = dict[str, tuple[int, int]]()
        place = 0
        for name, values in self.law.init()._asdict().items():
            places[name] = (place, len(values))
            place += len(values)
        return places

    @property
    def _work(self) -> dict[str, Array]:
        """The arrays of the kernel that begin anew at each sample."""
        known = {*self._tables, *self._memory, *SIGNALS}
        return {name: array for name, array in self.law.arrays().items() if name not in known}

    def _in_c(self, language: CLanguage) -> str:
        law = self.law
        number = language.number
        arrays = law.arrays()
        shapes = {name: tuple(map(str, array.shape)) for name, array in arrays.items()}
        known = {**self._tables, **self._points}
        work = "".join(
            f"  {'int' if array.dtype == np.int64 else number}"
            f" {name}{''.join(f'[{size}]' for size in array.shape)};\n"
            for name, array in self._work.items()
        )
        prefix = language.prefix
        kernels = CKernels(shapes, number=number, tables=law.constants)
        places = {
            "number": number,
            "sample": f"{prefix}sample",
            "prefix": prefix,
            "tables": "".join(
                _table(f"{prefix}{name}", array, number) for name, array in known.items()
            ),
            "functions": kernels.text(MODULE, [SAMPLE]),
            "work": work.rstrip(),
            "arguments": ", ".join(f"{prefix}{name}" if name in known else name for name in arrays),
            **{f"{name}_at": str(place) for name, (place, _) in self._memory.items()},
            "memories": str(len(law.initial_memory)),
            "measured": str(len(law.measured)),
            "controlled": str(len(law.controlled)),
            "commands": str(len(law.inputs)),
        }
        return filled("predictive.c", places, self.name)

    def _in_javascript(self, language: JavaScriptLanguage) -> str:
        """A closure, so that its functions and tables have names of their own."""
        known = {**self._tables, **self._points}
        tables = "".join(f"  const {name} = {_json(array)};\n" for name, array in known.items())
        work = "".join(
            f"    const {name} = {_json(array)};\n" for name, array in self._work.items()
        )
        memory = "".join(
            f"    const {name} = later.subarray({place}, {place + size});\n"
            for name, (place, size) in self._memory.items()
        )
        places = {
            "sample": f"{language.prefix}sample",
            "tables": tables.rstrip(),
            "functions": JavaScriptKernels().text(MODULE, [SAMPLE]),
            "work": work.rstrip(),
            "memory": memory.rstrip(),
            "arguments": ", ".join(self.law.arrays()),
        }
        return filled("predictive.mjs", places, self.name)

    def _in_matlab(self, language: MatlabLanguage) -> str:
        known = {**self._tables, **self._points, **self._work}
        memory = "".join(
            f"  {name} = memory({place + 1}:{place + size});\n"
            for name, (place, size) in self._memory.items()
        )
        kernels = MatlabKernels()
        text = kernels.text(MODULE, [SAMPLE])
        written = kernels.kernels[SAMPLE].changed
        places = {
            "sample": f"{language.prefix}sample",
            "tables": "".join(f"  {name} = {m_array(array)};\n" for name, array in known.items()),
            "memory": memory.rstrip(),
            "results": ", ".join(["~", *written]),
            "arguments": ", ".join(self.law.arrays()),
            "later": "; ".join(f"{name}(:)" for name in self._memory),
            "functions": text,
        }
        return filled("predictive.m", places, self.name)

    def replay(self, measured: Array, setpoints: Array, *, single: bool = False) -> Array:
        """The commands (K, c) to measurements (K, p) and set points (K, q), in Python.

        single  the operations of the program itself, each rounded to single precision
        """
        law = self.law
        memory = self.law.init()
        rows = list[Any]()
        if single:
            sample = plain_kernels(MODULE)[SAMPLE]
            known = {**law.arrays(), **self._tables}
            arrays = {
                name: array if array.dtype == np.int64 else array.astype(np.float32)
                for name, array in known.items()
            }
            at = law.model.measured.astype(np.float32)
            to = law.model.controlled.astype(np.float32)
            sizes = law.model.input_sizes.astype(np.float32)
            operating = law.model.inputs.astype(np.float32)
            for values, points in zip(
                measured.astype(np.float32), setpoints.astype(np.float32), strict=True
            ):
                arrays |= {"y": values - at, "r": points - to}
                sample(*arrays.values())
                rows.append(operating + sizes * arrays["inputs"])
            return np.array(rows, dtype=float)
        ranges = dict(zip(law.inputs, self.ranges, strict=True))
        for values, points in zip(measured.tolist(), setpoints.tolist(), strict=True):
            seen = Measurement(
                dict(zip(law.measured, values, strict=True)),
                dict(zip(law.controlled, points, strict=True)),
                ranges,
            )
            commands, memory = law.step(memory, seen, 0.0)
            rows.append([commands[name] for name in law.inputs])
        return np.array(rows)


def with_printable_controller(problem: Problem) -> Problem:
    """The problem with the designed law in place of the declaration of predictive control."""
    loop = problem.input
    if not (isinstance(loop, ControlLoop) and isinstance(loop.controller, PredictiveControl)):
        return problem
    designed = dataclasses.replace(loop, controller=loop.controller.law)
    return dataclasses.replace(problem, input=designed)


def check_control_law(problem: Problem) -> ControlLoop:
    """The control loop of a problem. Raises ParameterError where its controller has no printed
    form.
    """
    loop = problem.input
    if not isinstance(loop, ControlLoop):
        raise ParameterError(
            "the problem has no controller to export; its input is a signal. Give it a ControlLoop."
        )
    if not isinstance(loop.controller, ControlLaw | LinearModelPredictive):
        raise ParameterError(
            f"{type(loop.controller).__name__} is a controller in Python and has no printed form."
            " Derive a law of your own from ControlLaw and write its step over airmuscle.core.ops,"
            " or use linear predictive control."
        )
    return loop


def print_any_controller(
    prepared: SampledLoop,
    name: str,
    title: str = "",
    tunable: Sequence[str] | None = (),
    number: str = "double",
    notes: Sequence[str] = (),
) -> PrintedController:
    """The controller of a prepared loop, by what prints it; arguments as of `print_controller`."""
    law = prepared.loop.controller
    if not isinstance(law, LinearModelPredictive):
        return print_controller(prepared, name, title, tunable, number, notes)
    if tunable:
        raise ParameterError(
            f"LinearModelPredictive has no tunable parameter '{tunable[0]}'; leave it out."
        )
    about = (
        f"Sample time {c_number(prepared.loop.sample_time)} s; set points"
        f" {', '.join(law.controlled)}; measured {', '.join(law.measured)}; commanded"
        f" {', '.join(law.inputs)}."
    )
    design = law.design.lines() if law.design else []
    remarks = [about, *design, PREDICTIVE_NOTE, *notes]
    lines = provenance(title or type(law).__name__, law, notes=remarks)
    tolerance = SINGLE_TOLERANCE if number == "float" else TOLERANCE
    ranges = [prepared.ranges[n] for n in law.inputs]
    return PrintedPredictive(name, law, {}, {}, ranges, (), lines, number, tolerance)


def _table(name: str, array: Array, number: str) -> str:
    """A constant array, which an embedded program has in its flash memory alone."""
    size = "".join(f"[{count}]" for count in array.shape)
    kind = number
    values = c_values(array, number=number)
    if array.dtype == np.int64:
        kind = "int"
        values = c_integers(array.tolist())
    head = f"static const {kind} {name}{size}"
    return f"{head} = {{{values}}};\n"


def _json(array: Array) -> str:
    """An array as a literal of JavaScript, with infinities by their name."""
    return json.dumps(array.tolist())
