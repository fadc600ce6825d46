"""C99 sources of a system: header, source with solver, and a main program that runs a scenario."""

from __future__ import annotations

import csv
import dataclasses
import io
from collections.abc import Mapping, Sequence
from typing import Any

from ..compile.functions import ArraySizes, Extension
from ..compile.kernels import rodas4_coefficients
from ..compile.text.c import CLanguage
from ..recording.recording import column_heading
from ..simulation.integrators import ExplicitRungeKutta, Integrator, Rodas4
from .c_text import c_array, c_number, c_string, c_strings
from .identifiers import make_identifiers
from .printed_system import ExportedSystem
from .provenance import block_comment
from .run_data import RunData, tableau_arrays
from .templates import filled

PUBLIC = frozenset({"prepare", "rhs", "outputs", "partials", "indicators"})
"""Printed functions that other files may call."""
COEFFICIENTS = {name: value for name, value in vars(rodas4_coefficients).items() if name.isupper()}
"""Coefficients of Rodas4 by name."""


@dataclasses.dataclass(frozen=True, eq=False)
class CSource:
    """The C99 files of one system; `name` is the beginning of every name in them, and the name of the files.

    provenance  lines of the comment at the beginning of each file
    """

    name: str
    system: ExportedSystem
    integrator: Integrator
    provenance: Sequence[str]
    extend: Extension | None = None
    """Further functions; those named in PUBLIC can be called by other files."""

    def files(self) -> dict[str, str]:
        """Contents of the header and of the source, by file name."""
        language = CLanguage("double", f"{self.name}_", PUBLIC)
        functions, sizes = self.system.printed(
            language, implicit=isinstance(self.integrator, Rodas4), extend=self.extend
        )
        common = {"provenance": block_comment(self.provenance), "file": self.name}
        header = {**common, **self._sizes(sizes), **self._steps(), "enumerations": self._enumerations()}
        source = {**common, "constants": self._constants(), "functions": functions, "solver": self._solver(sizes)}
        return {
            f"{self.name}.h": filled("model.h", header, self.name),
            f"{self.name}.c": filled("model.c", source, self.name),
        }

    @property
    def upper(self) -> str:
        """Beginning of the macros."""
        return self.name.upper()

    def main(self, run: RunData, columns: Sequence[str]) -> str:
        """A main program that runs a scenario and writes these columns, after time, as CSV."""
        every, segments = list(self.system.columns), run.segments
        row = f"[{self.upper}_INPUTS + 1]"
        constants = [
            f"static const char header[] = {c_string(csv_header(columns))};\n",
            f"static const int columns[COLUMNS] = {{{', '.join(str(every.index(name)) for name in columns)}}};\n",
            f"static const double start = {c_number(run.start)};\n",
            c_array(f"static const double initial[{self.upper}_STATES]", run.initial),
            c_array("static const double times[ROWS]", run.times),
            c_array("static const double ends[SEGMENTS]", segments.ends),
            c_array(f"static const double values[SEGMENTS]{row}", segments.values, 1),
            c_array(f"static const double slopes[SEGMENTS]{row}", segments.slopes, 1),
        ]
        places = {
            "provenance": block_comment(self.provenance),
            "file": self.name,
            "rows": str(run.times.size),
            "segments": str(segments.ends.size),
            "columns": str(len(columns)),
            "constants": "".join(constants),
            "valid": filled("valid.c", {}, self.name),
            "program": filled("program.c", {"failures": ""}, self.name),
        }
        return filled("main.c", places, self.name)

    def _sizes(self, sizes: ArraySizes) -> dict[str, str]:
        return {
            "states": str(sizes.states), "inputs": str(sizes.inputs), "parameters": str(len(self.system.tunable)),
            "held": str(sizes.held), "outputs": str(sizes.outputs),
        }  # fmt: skip

    def _steps(self) -> dict[str, str]:
        if isinstance(self.integrator, ExplicitRungeKutta):
            step = c_number(self.integrator.step)
            return {"first_step": step, "close": f"(1e-9 * {step})"}
        return {"first_step": "0.0", "close": "0.0"}

    def _enumerations(self) -> str:
        kinds: Mapping[str, Sequence[str]] = {
            "STATE": self.system.state_names, "INPUT": self.system.input_names, "OUTPUT": self.system.output_names,
            "PARAMETER": [leaf.path for leaf in self.system.tunable],
        }  # fmt: skip
        text = ""
        for kind, names in kinds.items():
            words = [f"{self.upper}_{kind}_{word.upper()}" for word in make_identifiers(names)]
            rows = "".join(f"  {word} = {i},\n" for i, word in enumerate(words)).removesuffix(",\n")
            text += f"enum {{\n{rows}\n}};\n" if words else ""
        return text

    def _constants(self) -> str:
        known, units, system = self.system.compiled.description, self.system.units, self.system
        texts: dict[str, tuple[Any, Sequence[str]]] = {
            "state": (system.state_names, [units[n] for n in system.state_names]),
            "input": (system.input_names, [units[n] for n in system.input_names]),
            "output": (system.output_names, [units[n] for n in system.output_names]),
            "parameter": ([p.path for p in system.tunable], [p.declared.unit for p in system.tunable]),
        }
        text, m, upper = "", self.name, self.upper
        for kind, (names, of) in texts.items():
            size = f"{upper}_{kind.upper()}S + 1"
            text += c_strings(f"const char *const {m}_{kind}_names[{size}]", names)
            text += c_strings(f"const char *const {m}_{kind}_units[{size}]", of)
        text += c_array(f"const double {m}_defaults[{upper}_PARAMETERS + 1]", system.defaults, 1)
        text += c_array(f"const double {m}_nominal[{upper}_STATES]", system.nominal)
        text += c_array(f"const double {m}_state_minimum[{upper}_STATES]", known.lower_bounds)
        text += c_array(f"const double {m}_input_minimum[{upper}_INPUTS + 1]", known.input_minimum, 1)
        return text + c_array(f"const double {m}_input_maximum[{upper}_INPUTS + 1]", known.input_maximum, 1)

    def _solver(self, sizes: ArraySizes) -> str:
        head = filled("solver_head.c", {}, self.name)
        if isinstance(self.integrator, Rodas4):
            values = {f"{self.upper}_RTOL": self.integrator.rtol, **COEFFICIENTS}
            defined = "".join(f"#define {name} {_in_brackets(value)}\n" for name, value in values.items())
            defined += f"#define {self.upper}_JACOBIAN {sizes.jacobian}\n#define {self.upper}_FACTORS {sizes.factors}\n"
            return defined + head + filled("rodas4.c", {}, self.name)
        assert isinstance(self.integrator, ExplicitRungeKutta)
        rows, weights, nodes = tableau_arrays(self.integrator)
        count = len(weights)
        arrays = (
            f"#define {self.upper}_RTOL 0.0\n#define {self.upper}_STAGES {count}\n"
            + c_array(f"static const double ROWS[{count}][{count}]", rows)
            + c_array(f"static const double WEIGHTS[{count}]", weights)
            + c_array(f"static const double NODES[{count}]", nodes)
        )
        return arrays + head + filled("explicit.c", {}, self.name)


def _in_brackets(value: float) -> str:
    return c_number(value) if value >= 0 else f"({c_number(value)})"


def csv_header(columns: Sequence[str]) -> str:
    """The line with the headings of time and these columns."""
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerow([column_heading(name) for name in ("time", *columns)])
    return file.getvalue()
