"""MATLAB and Octave functions of a system: one file with functions and solver, one that runs the scenario."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ...core.errors import printable
from ...engine.compile.kernel_text import MatlabKernels
from ...engine.compile.text.programs import DEFINITION, MatlabBody, MatlabLanguage
from .c_source import csv_header
from .exported_run import BETWEEN, SHAPES, STEP, ExportedLoop, RunData, SolverText, program_data
from .identifiers import filled, line_comment
from .printed_system import ExportedSystem

_BODY = MatlabBody()
_IN_LINE = 6
"""Numbers in a line."""
LOOP_HELP = """% In addition: controller_parameters, those of the control law; setpoint, with the fields ends, values
% and slopes.
"""
DRIVER_ARRAYS = """  states = loop.drivers.states;
  scratch = {zeros(3, 0), zeros(3, 0)};
"""
APPLY_DRIVERS = """    [states, signals, counts, scratch] = apply_drivers( ...
      loop.drivers.kinds, loop.drivers.settings, states, states, signals, counts, scratch, start, eps(finish));
"""
"""The lines that pass commands through their drivers."""


@dataclasses.dataclass(frozen=True, eq=False)
class OctaveFunctions:
    """The function file of one system and that of its run; `name` is the name of the function."""

    name: str
    system: ExportedSystem
    run: RunData
    provenance: Sequence[str]
    loop: ExportedLoop | None = None

    def files(self, columns: Sequence[str]) -> dict[str, str]:
        """Contents of the function, and of a function that writes these columns, after time, as CSV, by file name."""
        solver = self._solver()
        functions, _ = self.system.printed(MatlabLanguage(), implicit=solver.implicit)
        method = solver.constants
        steps = {key.lower(): m_number(method.pop(key)) for key in ("FIRST_STEP", "CLOSE")}
        held = {key.lower(): m_array(value) if np.ndim(value) else m_number(value) for key, value in method.items()}
        constants = self._constants()
        if self.loop is not None:
            functions += f"\n{self.loop.controller.sample_in(MatlabLanguage('control_'))}"
        places = {
            "provenance": line_comment(self.provenance), "file": self.name, "functions": f"{DEFINITION}\n{functions}",
            "constants": constants, "solver": filled("solver.m", {**solver.places, **steps}, self.name), **steps,
            "solver_constants": "".join(f"  s.{key} = {value};\n" for key, value in held.items()),
            "simulate": self._simulation(steps), "loop_help": LOOP_HELP if self.loop else "",
            "columns": m_strings(["time", *columns]), "header": m_string(csv_header(columns).strip("\n")),
        }  # fmt: skip
        return {
            f"{self.name}.m": filled("program.m", places, self.name),
            f"run_{self.name}.m": filled("run.m", places, self.name),
        }

    def _simulation(self, steps: Mapping[str, str]) -> str:
        """The function `simulate`."""
        if self.loop is None:
            return filled("simulate.m", steps, self.name)
        driven = len(self.loop.drivers.kinds)
        places = {
            "kernels": MatlabKernels().text("driven_inputs", self.loop.kernels),
            "driver_arrays": DRIVER_ARRAYS if driven else "",
            "apply_drivers": APPLY_DRIVERS if driven else "",
        }
        return filled("loop.m", {**places, **steps}, self.name)

    def _solver(self) -> SolverText:
        fields = {name: f"s.{name}" for name in {*STEP.values(), *BETWEEN.values()}} | {"end": "s.finish"}
        sizes = {"STATES": "s.n", "INPUTS": "numel(s.u)", "STAGES": "numel(s.weights)", "JACOBIAN": "0", "FACTORS": "0"}
        return SolverText(MatlabKernels(SHAPES), self.run.integrator, fields, sizes)

    def _constants(self) -> str:
        """The fields of the model and of its loop."""
        data = program_data(self.system, self.run)
        data |= {"units": tuple(self.system.units[name] for name in self.system.columns)}
        data["output_names"] = data.pop("outputs")
        data["run"] |= data["run"].pop("segments")
        return _fields("model", data if self.loop is None else {**data, "loop": self.loop.data(self.system)})


def _fields(name: str, value: Any) -> str:
    """Assignments of a value to a field, of those of a dictionary to its fields."""
    if isinstance(value, dict):
        return "".join(_fields(f"{name}.{key}", each) for key, each in value.items())
    text = m_strings(value) if isinstance(value, tuple) else m_array(value) if np.ndim(value) else m_number(value)
    return f"  {name} = {text};\n"


def m_number(value: float) -> str:
    """A number as MATLAB text; it is read back bit by bit."""
    return _BODY.constant(float(value)).strip("()")


def m_array(values: Any) -> str:
    """An array (N,) as a column, or a table (N, m)."""
    table = np.asarray(values, dtype=float)
    if not table.size:
        return f"zeros({', '.join(map(str, table.shape if table.ndim == 2 else (0, 1)))})"
    if table.ndim == 2:
        rows = [", ".join(map(m_number, row)) for row in table.tolist()]
        return f"[{f'; ...{chr(10)}    '.join(rows)}]"
    numbers = [m_number(value) for value in table.tolist()]
    lines = ["; ".join(numbers[i : i + _IN_LINE]) for i in range(0, len(numbers), _IN_LINE)]
    return f"[{f'; ...{chr(10)}    '.join(lines)}]"


def m_string(text: str) -> str:
    """A text in single quotes."""
    return "'" + printable(text).replace("\n", " ").replace("'", "''") + "'"


def m_strings(texts: Iterable[str]) -> str:
    """A row of texts (a cell array)."""
    return f"{{{', '.join(map(m_string, texts))}}}"
