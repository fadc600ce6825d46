"""C99 sources of a system: header, source with solver, and main programs that run a scenario or a control loop."""

import csv
import dataclasses
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ...engine.compile.functions import ArraySizes, Extension
from ...engine.compile.kernel_text import CKernels
from ...engine.compile.text.programs import CLanguage
from ...engine.run.integrators import Integrator
from ...recording.recording import column_heading
from .exported_run import BETWEEN, SHAPES, STEP, TABLEAU, ExportedLoop, RunData, SolverText
from .identifiers import block_comment, c_array, c_integers, c_number, c_string, c_strings, filled, make_identifiers
from .printed_system import ExportedSystem

PUBLIC = frozenset({"prepare", "rhs", "outputs", "partials", "indicators"})
"""Printed functions that other files may call."""


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
        solver = self._solver()
        constants = solver.constants
        functions, sizes = self.system.printed(language, implicit=solver.implicit, extend=self.extend)
        common = {"provenance": block_comment(self.provenance), "file": self.name}
        steps = {key.lower(): c_number(constants[key]) for key in ("FIRST_STEP", "CLOSE")}
        header = {**common, **self._sizes(sizes), **steps, "enumerations": self._enumerations()}
        text = self._solver_constants(sizes, constants) + filled("solver.c", solver.places, self.name)
        source = {**common, "constants": self._constants(), "functions": functions, "solver": text}
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

    def _solver(self) -> SolverText:
        shapes = {name: tuple(f"{self.upper}_{size}" for size in sizes) for name, sizes in SHAPES.items()}
        fields = {name: f"s->{name}" for name in {*STEP.values(), *BETWEEN.values()}}
        fields |= {"c": "c", "nominal": f"{self.name}_nominal"} | {key: key.upper() for key in TABLEAU}
        sizes = {size: f"{self.upper}_{size}{'' if size in {'STATES', 'STAGES'} else ' + 1'}"
                 for each in SHAPES.values() for size in each}  # fmt: skip
        return SolverText(CKernels(shapes, f"{self.name}_"), self.integrator, fields, sizes)

    def _solver_constants(self, sizes: ArraySizes, constants: Mapping[str, Any]) -> str:
        tableau = {key: value for key, value in constants.items() if isinstance(value, np.ndarray)}
        numbers = {"RTOL": c_number(constants["RTOL"]), "JACOBIAN": sizes.jacobian, "FACTORS": sizes.factors}
        if tableau:
            numbers["STAGES"] = len(tableau["NODES"])
        text = "".join(f"#define {self.upper}_{key} {value}\n" for key, value in numbers.items())
        for key, value in tableau.items():
            text += c_array(f"static double {key}{f'[{len(value)}]' * value.ndim}", value)
        return text


def csv_header(columns: Sequence[str]) -> str:
    """The line with the headings of time and these columns."""
    return csv_text([column_heading(name) for name in ("time", *columns)], ())


def csv_text(headings: Sequence[str], rows: Iterable[Sequence[float]]) -> str:
    """Rows as CSV; the numbers are read back bit by bit."""
    file = io.StringIO()
    csv.writer(file, lineterminator="\n").writerows([headings, *rows])
    return file.getvalue()


NOT_COMMANDED = '         : status == NOT_COMMANDED      ? "a measurement or a command is not finite\\n"\n'
"""A further reason for which a control loop ends early."""

APPLY_DRIVERS = """  apply_drivers(driver_kinds, driver_settings, driver_states, driver_states, signals, counts,
                scratch, begin, nextafter(fabs(end), HUGE_VAL) - fabs(end));
"""
"""The lines that pass commands through their drivers."""


def loop_main(
    name: str, system: ExportedSystem, run: RunData, loop: ExportedLoop, columns: Sequence[str],
    provenance: Sequence[str],
) -> str:  # fmt: skip
    """A main program that runs a control loop and writes these columns, after time, as CSV."""
    drivers = len(loop.drivers.kinds)
    places = {
        "provenance": block_comment(provenance), "file": name, "rows": str(run.times.size),
        "samples": str(loop.samples), "segments": str(loop.others.ends.size),
        "pieces": str(loop.prepared.setpoint_signal.ends.size), "columns": str(len(columns)), "drivers": str(drivers),
        "capacity": str(loop.capacity), "apply_drivers": APPLY_DRIVERS if drivers else "",
        "kernels": CKernels(_shapes(f"{name.upper()}_INPUTS")).text("driven_inputs", loop.kernels),
        "valid": filled("valid.c", {}, name), "program": filled("program.c", {"failures": NOT_COMMANDED}, name),
        "constants": _constants(name, system, run, loop, columns),
    }  # fmt: skip
    return filled("loop.c", places, name)


def _shapes(inputs: str) -> dict[str, tuple[str, ...]]:
    """The sizes of the arrays of the printed kernels."""
    signal, table, common = ("", "CAPACITY"), ("DRIVERS", "4"), ("", inputs)
    return {
        "columns": (inputs, "3", "CAPACITY"), "scratch": ("2", "3", "CAPACITY"), "kinds": ("DRIVERS", "2"),
        **dict.fromkeys(("signal", "result", "events"), signal),
        **dict.fromkeys(("settings", "states", "later"), table),
        **dict.fromkeys(("values", "slopes"), common), "setpoint": ("SETPOINTS",), "command": ("COMMANDS",),
        **dict.fromkeys(("given_values", "given_slopes"), ("", f"{inputs} + 1")),
        **dict.fromkeys(("setpoint_values", "setpoint_slopes"), ("", "SETPOINTS + 1")),
    }  # fmt: skip


def _constants(name: str, system: ExportedSystem, run: RunData, loop: ExportedLoop, columns: Sequence[str]) -> str:
    upper, others, setpoints = name.upper(), loop.others, loop.prepared.setpoint_signal
    numbers = (
        ("SAMPLE_TIME", loop.sample_time), ("NEAR", loop.near), ("start", run.start),
        ("finish", float(loop.prepared.instants[-1])),
    )  # fmt: skip
    text = "".join(f"static const double {key} = {c_number(value)};\n" for key, value in numbers)
    text += f"static const char header[] = {c_string(csv_header(columns))};\n"
    text += "/* Kind of each column (state, input, output, set point, measurement, command), and its number there. */\n"
    text += c_integers("static const int columns[COLUMNS][2]", loop.column_at(system, columns))
    text += c_integers("static const int measured_at[MEASUREMENTS][2]", loop.measured_at(system))
    text += c_integers("static const int commanded[COMMANDS]", loop.prepared.commanded)
    text += c_array(f"static const double initial[{upper}_STATES]", run.initial)
    text += c_array("static const double times[ROWS]", run.times)
    for kind, signal, width in (("", others, f"{upper}_INPUTS"), ("setpoint_", setpoints, "SETPOINTS")):
        count = "PIECES" if kind else "SEGMENTS"
        text += c_array(f"static const double {kind}ends[{count}]", signal.ends)
        text += c_array(f"static double {kind}values[{count}][{width} + 1]", signal.values, 1)
        text += c_array(f"static double {kind}slopes[{count}][{width} + 1]", signal.slopes, 1)
    if len(loop.drivers.kinds):
        text += c_integers(
            "static int driver_kinds[DRIVERS][2]", [(int(i), int(kind)) for i, kind in loop.drivers.kinds]
        )
        text += c_array("static double driver_settings[DRIVERS][4]", loop.drivers.settings)
        text += c_array("static double driver_states[DRIVERS][4]", loop.drivers.kept)
        text += "static double scratch[2][3][CAPACITY];\n"
    return text
