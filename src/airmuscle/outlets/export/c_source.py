"""C99 sources of a system: header, source with solver, and main programs that run a scenario or a control loop."""

import csv
import dataclasses
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ...engine import Integrator, PiecewiseLinear
from ...engine.compile.functions import ArraySizes, Extension
from ...engine.compile.kernel_text import CKernels
from ...engine.compile.text.languages import CLanguage
from ...recording.recording import column_heading
from .exported_run import BETWEEN, SHAPES, STEP, TABLEAU, ExportedLoop, ExportedRun, SolverText
from .identifiers import block_comment, c_integers, c_number, c_string, c_strings, c_values, filled, make_identifiers
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
            **{key: str(number) for key, number in numbers.items()}, **self._constants(),
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

    def _constants(self) -> dict[str, str]:
        """The elements of the arrays of names, units and numbers, by the places of the template."""
        known, system = self.system.known, self.system
        units = system.units | {leaf.path: leaf.declared.unit for leaf in system.tunable}
        places = {f"{kind}_names": c_strings(names) for kind, names in self._kinds.items()}
        places |= {f"{kind}_units": c_strings(units[name] for name in names) for kind, names in self._kinds.items()}
        return places | {
            "defaults": c_values(system.defaults, 1), "nominal": c_values(system.compiled.nominal),
            "state_minimum": c_values(known.lower_bounds), "input_minimum": c_values(known.input_minimum, 1),
            "input_maximum": c_values(known.input_maximum, 1),
        }  # fmt: skip

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
            text += f"static double {key}{f'[{len(value)}]' * value.ndim} = {{{c_values(value)}}};\n"
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
    places = {
        "provenance": block_comment(program.provenance), "file": name, "valid": filled("valid.c", {}, name),
        "header": c_string(csv_header(columns)), "start": c_number(program.problem.start_time),
        "initial": c_values(program.problem.initial_vector), "times": c_values(program.times),
        **_signal("", program.segments),
    }  # fmt: skip
    if loop is None:
        every = program.system.known.column_names
        places["columns_at"] = ", ".join(str(every.index(each)) for each in columns)
    else:
        numbers |= {
            "samples": loop.numbers["samples"], "pieces": loop.prepared.setpoint_signal.ends.size,
            "drivers": len(loop.drivers.kinds), "capacity": loop.capacity,
        }  # fmt: skip
        places |= _loop_places(program, loop)
    places |= {key: str(number) for key, number in numbers.items()}
    places["program"] = filled("program.c", {"failures": filled("not_commanded.c", {}, name) if loop else ""}, name)
    return filled("loop.c" if loop else "main.c", places, name)


def _signal(kind: str, signal: PiecewiseLinear) -> dict[str, str]:
    """The places of the segments of a signal."""
    tables = {"values": c_values(signal.values, 1), "slopes": c_values(signal.slopes, 1), "ends": c_values(signal.ends)}
    return {f"{kind}{name}": text for name, text in tables.items()}


def _loop_places(program: ExportedRun, loop: ExportedLoop) -> dict[str, str]:
    """The places of a control loop; its arrays, which its kernels are given, are not const."""
    name, known, table = program.name, program.system.known, loop.drivers
    tables = {
        "kinds": c_integers(list(map(tuple, table.kinds.tolist()))), "settings": c_values(table.settings),
        "states": c_values(table.kept),
    }  # fmt: skip
    driven = len(table.kinds) > 0
    return {
        **{key: c_number(loop.numbers[key]) for key in ("sample_time", "near", "finish")},
        "columns_at": c_integers(loop.column_at(known, program.columns)),
        "measured_at": c_integers(loop.measured_at(known)), "commanded": c_integers(loop.prepared.commanded),
        **_signal("setpoint_", loop.prepared.setpoint_signal),
        "driver_tables": filled("driver_tables.c", tables, name) if driven else "",
        "apply_drivers": filled("apply_drivers.c", {}, name) if driven else "",
        "kernels": CKernels(_shapes(f"{name.upper()}_INPUTS")).text("driven_inputs", loop.kernels),
    }  # fmt: skip


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
