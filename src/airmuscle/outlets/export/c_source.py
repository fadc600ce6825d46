"""C99 sources of a system: header, source with solver, and main programs that run a scenario or a control loop."""

import csv
import dataclasses
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ...engine.compile.functions import ArraySizes, Extension
from ...engine.compile.kernel_text import CKernels
from ...engine.compile.text.programs import CLanguage
from ...engine.run.integrators import Integrator
from ...recording.recording import column_heading
from .exported_run import BETWEEN, SHAPES, STEP, TABLEAU, ExportedLoop, ExportedRun, SolverText
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
        numbers = {
            "states": sizes.states, "inputs": sizes.inputs, "parameters": len(self.system.tunable), "held": sizes.held,
            "outputs": sizes.outputs,
        }  # fmt: skip
        places = {
            "provenance": block_comment(self.provenance), "file": self.name, "enumerations": self._enumerations(),
            **{key: str(number) for key, number in numbers.items()}, "constants": self._constants(),
            **{key.lower(): c_number(constants[key]) for key in ("FIRST_STEP", "CLOSE")}, "functions": functions,
            "solver": self._solver_constants(sizes, constants) + filled("solver.c", solver.places, self.name),
        }  # fmt: skip
        return {f"{self.name}.{end}": filled(f"model.{end}", places, self.name) for end in "hc"}

    @property
    def upper(self) -> str:
        """Beginning of the macros."""
        return self.name.upper()

    @property
    def _kinds(self) -> dict[str, Sequence[str]]:
        """The names of the elements of the arrays."""
        known = self.system.known
        names = known.state_names, known.input_names, known.output_names, self.system.paths
        return dict(zip(("state", "input", "output", "parameter"), names, strict=True))

    def _enumerations(self) -> str:
        text = ""
        for kind, names in self._kinds.items():
            words = [f"{self.name}_{kind}_{word}".upper() for word in make_identifiers(names)]
            rows = ",\n".join(f"  {word} = {i}" for i, word in enumerate(words))
            text += f"enum {{\n{rows}\n}};\n" if words else ""
        return text

    def _constants(self) -> str:
        known, system, text, m, upper = self.system.known, self.system, "", self.name, self.upper
        units = system.units | {leaf.path: leaf.declared.unit for leaf in system.tunable}
        for kind, names in self._kinds.items():
            size = f"{upper}_{kind.upper()}S + 1"
            text += c_strings(f"const char *const {m}_{kind}_names[{size}]", names)
            text += c_strings(f"const char *const {m}_{kind}_units[{size}]", [units[name] for name in names])
        text += c_array(f"const double {m}_defaults[{upper}_PARAMETERS + 1]", system.defaults, 1)
        text += c_array(f"const double {m}_nominal[{upper}_STATES]", system.compiled.nominal)
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


def main_program(program: ExportedRun) -> str:
    """A main program that runs a scenario, with its control loop if it has one, and writes columns as CSV."""
    name, loop = program.name, program.loop
    columns, segments = program.columns, program.segments.ends
    numbers: dict[str, float] = {"rows": program.times.size, "segments": segments.size, "columns": len(columns)}
    places = {"provenance": block_comment(program.provenance), "file": name, "valid": filled("valid.c", {}, name)}
    if loop is None:
        every = program.system.known.column_names
        columns_at = ", ".join(str(every.index(each)) for each in columns)
        places["constants"] = "".join((
            f"static const char header[] = {c_string(csv_header(columns))};\n",
            f"static const int columns[COLUMNS] = {{{columns_at}}};\n",
            f"static const double start = {c_number(program.problem.start_time)};\n", *_run_arrays(program),
        ))  # fmt: skip
    else:
        drivers = len(loop.drivers.kinds)
        numbers |= {
            "samples": loop.numbers["samples"], "pieces": loop.prepared.setpoint_signal.ends.size, "drivers": drivers,
            "capacity": loop.capacity,
        }  # fmt: skip
        places |= {
            "apply_drivers": filled("apply_drivers.c", {}, name) if drivers else "",
            "constants": _loop_constants(program, loop),
            "kernels": CKernels(_shapes(f"{name.upper()}_INPUTS")).text("driven_inputs", loop.kernels),
        }  # fmt: skip
    places |= {key: str(number) for key, number in numbers.items()}
    places["program"] = filled("program.c", {"failures": filled("not_commanded.c", {}, name) if loop else ""}, name)
    return filled("loop.c" if loop else "main.c", places, name)


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


def _run_arrays(program: ExportedRun) -> Iterator[str]:
    """The arrays of a run; those of a loop, which its kernels are given, are not const."""
    upper, loop = program.name.upper(), program.loop
    yield c_array(f"static const double initial[{upper}_STATES]", program.problem.initial_vector)
    yield c_array("static const double times[ROWS]", program.times)
    signals = [("", program.segments, "SEGMENTS", f"{upper}_INPUTS")]
    if loop is not None:
        signals.append(("setpoint_", loop.prepared.setpoint_signal, "PIECES", "SETPOINTS"))
    for kind, signal, count, width in signals:
        yield c_array(f"static const double {kind}ends[{count}]", signal.ends)
        for name, table in (("values", signal.values), ("slopes", signal.slopes)):
            yield c_array(f"static {'' if loop else 'const '}double {kind}{name}[{count}][{width} + 1]", table, 1)


def _loop_constants(program: ExportedRun, loop: ExportedLoop) -> str:
    known, numbers = program.system.known, loop.numbers
    stated = {
        "SAMPLE_TIME": numbers["sample_time"], "NEAR": numbers["near"], "start": program.problem.start_time,
        "finish": numbers["finish"],
    }  # fmt: skip
    text = "".join(f"static const double {key} = {c_number(value)};\n" for key, value in stated.items())
    text += f"static const char header[] = {c_string(csv_header(program.columns))};\n"
    text += "/* Kind of each column (state, input, output, set point, measurement, command), and its number there. */\n"
    text += c_integers("static const int columns[COLUMNS][2]", loop.column_at(known, program.columns))
    text += c_integers("static const int measured_at[MEASUREMENTS][2]", loop.measured_at(known))
    text += c_integers("static const int commanded[COMMANDS]", loop.prepared.commanded)
    text += "".join(_run_arrays(program))
    if len(loop.drivers.kinds):
        text += c_integers("static int driver_kinds[DRIVERS][2]", list(map(tuple, loop.drivers.kinds.tolist())))
        text += c_array("static double driver_settings[DRIVERS][4]", loop.drivers.settings)
        text += c_array("static double driver_states[DRIVERS][4]", loop.drivers.kept)
        text += "static double scratch[2][3][CAPACITY];\n"
    return text
