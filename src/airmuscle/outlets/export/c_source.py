"""C99 sources of a system: header, source with solver, and main programs that run a scenario or a
control loop.
"""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ...engine import Integrator, PiecewiseLinear
from ...engine.compile.functions import ArraySizes, Extension
from ...engine.compile.kernel_text import CKernels
from ...engine.compile.text.languages import CLanguage
from ...recording.recording import column_heading
from .exported_run import BETWEEN, SHAPES, STEP, TABLEAU, ExportedRun, places_of, solver_text
from .identifiers import (
    block_comment,
    c_integers,
    c_number,
    c_string,
    c_strings,
    c_values,
    filled,
    make_identifiers,
)
from .parameter_bounds import ParameterBounds
from .printed_system import ExportedSystem

PUBLIC = frozenset({"prepare", "rhs", "outputs", "partials", "indicators"})
"""Printed functions that other files may call."""


def c_files(
    name: str,
    system: ExportedSystem,
    integrator: Integrator,
    provenance: Sequence[str],
    extend: Extension | None = None,
) -> dict[str, str]:
    """The C99 header and source of a system, by file name.

    name        beginning of every name in the files, and their name
    provenance  lines of the comment at their beginning
    extend      further functions; those named in PUBLIC can be called by other files
    """
    upper = name.upper()
    known = system.known
    shapes = {array: tuple(f"{upper}_{size}" for size in sizes) for array, sizes in SHAPES.items()}
    fields = {field: f"s->{field}" for field in {*STEP.values(), *BETWEEN.values()}}
    fields |= {"c": "c", "nominal": f"{name}_nominal"} | {key: key.upper() for key in TABLEAU}
    lengths = {
        size: f"{upper}_{size}{'' if size in {'STATES', 'STAGES'} else ' + 1'}"
        for shape in SHAPES.values()
        for size in shape
    }
    solver = solver_text(CKernels(shapes, f"{name}_"), integrator, fields, lengths)
    functions, sizes = system.printed(
        CLanguage("double", f"{name}_", PUBLIC), implicit=solver.implicit, extend=extend
    )
    numbers = {
        "states": sizes.states,
        "inputs": sizes.inputs,
        "parameters": len(system.tunable),
        "held": sizes.held,
        "outputs": sizes.outputs,
    }
    names = {
        "state": known.state_names,
        "input": known.input_names,
        "output": known.output_names,
        "parameter": system.paths,
    }
    units = system.units | {leaf.path: leaf.declared.unit for leaf in system.tunable}
    places = {
        "provenance": block_comment(provenance),
        "file": name,
        "functions": functions,
        **{key: str(number) for key, number in numbers.items()},
        "enumerations": "".join(
            _enumeration(f"{name}_{kind}", texts) for kind, texts in names.items() if texts
        ),
        **{f"{kind}_names": c_strings(texts) for kind, texts in names.items()},
        **{
            f"{kind}_units": c_strings(units[word] for word in texts)
            for kind, texts in names.items()
        },
        "defaults": c_values(system.defaults, 1),
        **ParameterBounds.of(system.tunable).c_places(name),
        "nominal": c_values(system.compiled.nominal),
        "state_minimum": c_values(known.lower_bounds),
        "input_minimum": c_values(known.input_minimum, 1),
        "input_maximum": c_values(known.input_maximum, 1),
        **{key.lower(): c_number(solver.constants[key]) for key in ("FIRST_STEP", "CLOSE")},
        "solver": (
            _solver_constants(upper, sizes, solver.constants)
            + filled("solver.c", solver.places, name)
        ),
    }
    return {f"{name}.{end}": filled(f"model.{end}", places, name) for end in "hc"}


def _enumeration(prefix: str, names: Sequence[str]) -> str:
    rows = ",\n".join(
        f"  {f'{prefix}_{word}'.upper()} = {i}" for i, word in enumerate(make_identifiers(names))
    )
    return f"enum {{\n{rows}\n}};\n"


def _solver_constants(upper: str, sizes: ArraySizes, constants: Mapping[str, Any]) -> str:
    tableau = {key: value for key, value in constants.items() if isinstance(value, np.ndarray)}
    numbers = {
        "RTOL": c_number(constants["RTOL"]),
        "JACOBIAN": sizes.jacobian,
        "FACTORS": sizes.factors,
    }
    if tableau:
        numbers["STAGES"] = len(tableau["NODES"])
    text = "".join(f"#define {upper}_{key} {value}\n" for key, value in numbers.items())
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
    """A main program that runs a scenario, with its control loop if it has one, and writes columns
    as CSV.
    """
    name = program.name
    loop = program.loop
    columns = program.columns
    segments = program.segments.ends
    numbers: dict[str, float] = {
        "rows": program.times.size,
        "segments": segments.size,
        "columns": len(columns),
    }
    places = {
        "provenance": block_comment(program.provenance),
        "file": name,
        "valid": filled("valid.c", {}, name),
        "header": c_string(csv_header(columns)),
        "start": c_number(program.problem.start_time),
        "initial": c_values(program.problem.initial_vector),
        "times": c_values(program.times),
        **_signal(program.segments),
    }
    if loop is None:
        every = program.system.known.column_names
        places["columns_at"] = ", ".join(str(every.index(column)) for column in columns)
    else:
        known = program.system.known
        table = loop.drivers
        driven = len(loop.drivers.kinds) > 0
        groups = known.state_names, known.input_names, known.output_names, *loop.added_columns
        tables = {
            "kinds": c_integers(list(map(tuple, table.kinds.tolist()))),
            "settings": c_values(table.settings),
            "states": c_values(table.kept),
        }
        numbers |= {
            "samples": loop.numbers["samples"],
            "pieces": loop.prepared.setpoint_signal.ends.size,
            "drivers": len(table.kinds),
            "capacity": loop.capacity,
        }
        places |= {
            **{key: c_number(loop.numbers[key]) for key in ("sample_time", "near", "finish")},
            "columns_at": c_integers(places_of(columns, groups)),
            "measured_at": c_integers(loop.measured_at(known)),
            "commanded": c_integers(loop.prepared.commanded),
            **_signal(loop.prepared.setpoint_signal, "setpoint_"),
            "driver_tables": filled("driver_tables.c", tables, name) if driven else "",
            "apply_drivers": filled("apply_drivers.c", {}, name) if driven else "",
            "kernels": (
                CKernels(_shapes(f"{name.upper()}_INPUTS")).text("driven_inputs", loop.kernels)
            ),
        }
    places |= {key: str(number) for key, number in numbers.items()}
    places["program"] = filled(
        "program.c", {"failures": filled("not_commanded.c", {}, name) if loop else ""}, name
    )
    return filled("loop.c" if loop else "main.c", places, name)


def _signal(signal: PiecewiseLinear, kind: str = "") -> dict[str, str]:
    """The places of the segments of a signal."""
    return {
        f"{kind}values": c_values(signal.values, 1),
        f"{kind}slopes": c_values(signal.slopes, 1),
        f"{kind}ends": c_values(signal.ends),
    }


def _shapes(inputs: str) -> dict[str, tuple[str, ...]]:
    """The sizes of the arrays of the printed kernels."""
    signal = ("", "CAPACITY")
    table = ("DRIVERS", "4")
    common = ("", inputs)
    return {
        "columns": (inputs, "3", "CAPACITY"),
        "scratch": ("2", "3", "CAPACITY"),
        "kinds": ("DRIVERS", "2"),
        **dict.fromkeys(("signal", "result", "events"), signal),
        **dict.fromkeys(("settings", "states", "later"), table),
        **dict.fromkeys(("values", "slopes"), common),
        "setpoint": ("SETPOINTS",),
        "command": ("COMMANDS",),
        **dict.fromkeys(("given_values", "given_slopes"), ("", f"{inputs} + 1")),
        **dict.fromkeys(("setpoint_values", "setpoint_slopes"), ("", "SETPOINTS + 1")),
    }
