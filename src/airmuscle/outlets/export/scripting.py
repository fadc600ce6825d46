"""JavaScript module, and MATLAB and Octave functions, of a system: functions, solver and the run of a scenario."""

import functools
import json
import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ...core import printable
from ...engine.compile.kernel_text import JavaScriptKernels, MatlabKernels
from ...engine.compile.kernel_text.printer import KernelPrinter
from ...engine.compile.text.languages import DEFINITION, JavaScriptLanguage, MatlabLanguage
from ...engine.run import Integrator
from .c_source import csv_header
from .exported_run import BETWEEN, SHAPES, STEP, TABLEAU, ExportedRun, SolverText
from .identifiers import block_comment, filled, line_comment, template


def javascript_files(program: ExportedRun) -> dict[str, str]:
    """The ECMAScript module of a program, its types, a program for Node that writes the columns as CSV, and the
    package.json of a folder that npm installs, by file name."""
    name, loop = program.name, program.loop
    solver = javascript_solver(program.integrator)
    functions, sizes = program.system.printed(JavaScriptLanguage(), implicit=solver.implicit)
    functions = functions.replace("export function outputs(", "export function outputsOf(", 1)
    text = "".join(f"export const {key} = {to_json(value)};\n" for key, value in _camel(program.data()).items())
    text += f"const SIZES = {to_json({key: getattr(sizes, key) for key in ('held', 'jacobian', 'factors')})};\n"
    text += "".join(f"const {key} = {to_json(value)};\n" for key, value in solver.constants.items())
    if loop is not None:
        text += f"export const loop = {to_json(_camel(loop.data(program.system.known)))};\n"
        functions += f"\n{loop.controller.sample_in(JavaScriptLanguage('control_'))}"
    places = {
        "provenance": block_comment(program.provenance), "file": name, "constants": text, "functions": functions,
        "solver": filled("solver.mjs", solver.places, name), "arguments": filled("arguments.mjs", {}, name),
        "simulate": _simulation(program, "mjs", JavaScriptKernels(), {}),
        "columns": to_json(["time", *program.columns]), "header": to_json(csv_header(program.columns)),
        "package": name.replace("_", "-"), "description": json.dumps(program.provenance[0]),
    }  # fmt: skip
    return {
        f"{name}.mjs": filled("program.mjs", places, name),
        f"{name}.d.mts": filled("program.d.mts", {**places, **_types(program)}, name),
        f"{name}.run.mjs": filled("run.mjs", places, name),
        "package.json": filled("package.json", places, name),
    }


@functools.lru_cache(maxsize=16)
def javascript_solver(integrator: Integrator) -> SolverText:
    """The solver of a module, whose text is that of no other system: the page asks for one with every plant."""
    names = {*STEP.values(), *BETWEEN.values()}
    fields = {key: f"this.{word}" for key, word in zip(names, _camel(dict.fromkeys(names)), strict=True)}
    fields |= {"nominal": "nominal"} | {key: key.upper() for key in TABLEAU}
    lengths = {"STATES": "states.length", "INPUTS": "inputs.length", "STAGES": "WEIGHTS.length",
               "JACOBIAN": "SIZES.jacobian", "FACTORS": "SIZES.factors"}  # fmt: skip
    return SolverText(JavaScriptKernels(), integrator, fields, lengths, "work.")


def _types(program: ExportedRun) -> dict[str, str]:
    """The places of the TypeScript declarations."""
    known, loop = program.system.known, program.loop
    names = {"states": known.state_names, "inputs": known.input_names, "outputs": known.output_names,
             "parameters": program.system.paths}  # fmt: skip
    types = {kind: _union(of) for kind, of in names.items()}
    if loop is None:
        return {**types, "columns": "", "changes": "", "results": ""}
    changes = f"  controllerParameters?: Values<{_union(loop.controller.paths)}>;\n"
    changes += f"  /** Set points {', '.join(loop.controller.law.setpoints) or 'none'}. */\n  setpoint?: Segments;\n"
    columns = f" | {_union(sum(loop.added_columns, ()))}"
    return {**types, "columns": columns, "changes": changes, "results": "  samples: number;\n"}


def _camel(data: dict[str, Any]) -> dict[str, Any]:
    """The values by their names in the style of JavaScript."""
    return {re.sub("_(.)", lambda mark: mark[1].upper(), name): value for name, value in data.items()}


def _union(names: Iterable[str]) -> str:
    """The TypeScript type of a text that is one of these names."""
    return " | ".join(map(json.dumps, names)) or "never"


def to_json(value: Any) -> str:
    """A value as JavaScript text: ASCII only, numbers bit by bit, infinities by name."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, dict):
        return f"{{{', '.join(f'{json.dumps(key)}: {to_json(each)}' for key, each in value.items())}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(to_json, value))}]"
    return json.dumps(value)


_LANGUAGE = MatlabLanguage()
_IN_LINE = 6
"""Numbers in a line."""


def octave_files(program: ExportedRun) -> dict[str, str]:
    """The function of a program, and a function that writes its columns as CSV, by file name."""
    name, loop, system = program.name, program.loop, program.system
    fields = {key: f"s.{key}" for key in {*STEP.values(), *BETWEEN.values()}} | {"end": "s.finish"}
    sizes = {"STATES": "s.n", "INPUTS": "numel(s.u)", "STAGES": "numel(s.weights)", "JACOBIAN": "0", "FACTORS": "0"}
    solver = SolverText(MatlabKernels(SHAPES), program.integrator, fields, sizes)
    functions, _ = system.printed(MatlabLanguage(), implicit=solver.implicit)
    method, data = solver.constants, program.data()
    steps = {key.lower(): m_number(method.pop(key)) for key in ("FIRST_STEP", "CLOSE")}
    data |= {"units": tuple(system.units[column] for column in system.known.column_names)}
    data["output_names"] = data.pop("outputs")
    data["run"] |= data["run"].pop("segments")
    if loop is not None:
        functions += f"\n{loop.controller.sample_in(MatlabLanguage('control_'))}"
        data["loop"] = loop.data(system.known)
    places = {
        "provenance": line_comment(program.provenance), "file": name, "functions": f"{DEFINITION}\n{functions}",
        "constants": _fields("model", data), "solver": filled("solver.m", {**solver.places, **steps}, name), **steps,
        "solver_constants": "".join(_fields(f"s.{key.lower()}", value) for key, value in method.items()),
        "simulate": _simulation(program, "m", MatlabKernels(), steps),
        "loop_help": template("loop_help.m") if loop else "",
        "columns": m_strings(["time", *program.columns]), "header": m_string(csv_header(program.columns).strip("\n")),
    }  # fmt: skip
    return {f"{name}.m": filled("program.m", places, name), f"run_{name}.m": filled("run.m", places, name)}


def _simulation(program: ExportedRun, suffix: str, kernels: KernelPrinter, places: Mapping[str, str]) -> str:
    """The function `simulate`; in a loop with drivers also their arrays, and the lines that pass commands to them."""
    loop, name = program.loop, program.name
    if loop is None:
        return filled(f"simulate.{suffix}", places, name)
    driven = len(loop.drivers.kinds) > 0
    first = template("ulp.mjs") if driven and suffix == "mjs" else ""
    own = {each: template(f"{each}.{suffix}") if driven else "" for each in ("driver_arrays", "apply_drivers")}
    own["kernels"] = f"{first}{kernels.text('driven_inputs', loop.kernels)}"
    return filled(f"loop.{suffix}", {**places, **own}, name)


def _fields(name: str, value: Any) -> str:
    """Assignments of a value to a field, of those of a dictionary to its fields."""
    if isinstance(value, dict):
        return "".join(_fields(f"{name}.{key}", each) for key, each in value.items())
    text = m_strings(value) if isinstance(value, tuple) else m_array(value) if np.ndim(value) else m_number(value)
    return f"  {name} = {text};\n"


def m_number(value: float) -> str:
    """A number as MATLAB text; it is read back bit by bit."""
    return _LANGUAGE.constant(float(value)).strip("()")


def m_array(values: Any) -> str:
    """An array (N,) as a column, or a table (N, m)."""
    table = np.asarray(values, dtype=float)
    if not table.size:
        return f"zeros({', '.join(map(str, table.shape if table.ndim == 2 else (0, 1)))})"
    if table.ndim == 2:
        lines = [", ".join(map(m_number, row)) for row in table.tolist()]
    else:
        numbers = [m_number(value) for value in table.tolist()]
        lines = ["; ".join(numbers[i : i + _IN_LINE]) for i in range(0, len(numbers), _IN_LINE)]
    return f"[{f'; ...{chr(10)}    '.join(lines)}]"


def m_string(text: str) -> str:
    """A text in single quotes."""
    return "'" + printable(text).replace("\n", " ").replace("'", "''") + "'"


def m_strings(texts: Iterable[str]) -> str:
    """A row of texts (a cell array)."""
    return f"{{{', '.join(map(m_string, texts))}}}"
