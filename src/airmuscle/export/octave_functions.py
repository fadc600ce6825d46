"""MATLAB and Octave functions of a system: one file with functions and solver, one that runs the scenario."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ..compile.text.matlab import DEFINITION, MatlabBody, MatlabLanguage
from ..core.errors import printable
from ..simulation.integrators import ExplicitRungeKutta, Rodas4
from .c_source import COEFFICIENTS, csv_header
from .printed_system import ExportedSystem
from .provenance import line_comment
from .run_data import RunData, tableau_arrays
from .templates import filled

_BODY = MatlabBody()
_IN_LINE = 6
"""Numbers in a line."""


@dataclasses.dataclass(frozen=True, eq=False)
class OctaveFunctions:
    """The function file of one system and that of its run; `name` is the name of the function."""

    name: str
    system: ExportedSystem
    run: RunData
    provenance: Sequence[str]

    def files(self, columns: Sequence[str]) -> dict[str, str]:
        """Contents of the function, and of a function that writes these columns, after time, as CSV, by file name."""
        implicit = isinstance(self.run.integrator, Rodas4)
        functions, _ = self.system.printed(MatlabLanguage(), implicit=implicit)
        steps = self._steps()
        solver = filled("rodas4.m" if implicit else "explicit.m", steps, self.name)
        places = {
            "provenance": line_comment(self.provenance), "file": self.name, "functions": f"{DEFINITION}\n{functions}",
            "constants": self._constants(), "solver": solver, **steps,
            "columns": m_strings(["time", *columns]), "header": m_string(csv_header(columns).strip("\n")),
        }  # fmt: skip
        return {
            f"{self.name}.m": filled("program.m", places, self.name),
            f"run_{self.name}.m": filled("run.m", places, self.name),
        }

    def _steps(self) -> dict[str, str]:
        integrator = self.run.integrator
        if isinstance(integrator, ExplicitRungeKutta):
            rows, weights, nodes = map(m_array, tableau_arrays(integrator))
            step, close = m_number(integrator.step), m_number(1e-9 * integrator.step)
            return {"rows": rows, "weights": weights, "nodes": nodes, "first_step": step, "close": close}
        assert isinstance(integrator, Rodas4)
        values = {name: m_number(value) for name, value in COEFFICIENTS.items()}
        return {"rtol": m_number(integrator.rtol), "first_step": "0", "close": "0", **values}

    def _constants(self) -> str:
        system, run, known = self.system, self.run, self.system.compiled.description
        values = {
            "states": m_strings(system.state_names),
            "inputs": m_strings(system.input_names),
            "output_names": m_strings(system.output_names),
            "units": m_strings(system.units[name] for name in system.columns),
            "parameters": m_strings(leaf.path for leaf in system.tunable),
            "defaults": m_array(system.defaults),
            "nominal": m_array(system.nominal),
            "input_minimum": m_array(known.input_minimum),
            "input_maximum": m_array(known.input_maximum),
            "run.initial": m_array(run.initial),
            "run.start": m_number(run.start),
            "run.ends": m_array(run.segments.ends),
            "run.values": m_array(run.segments.values),
            "run.slopes": m_array(run.segments.slopes),
            "run.times": m_array(run.times),
        }
        return "".join(f"  model.{name} = {text};\n" for name, text in values.items())


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
