"""JavaScript module, and MATLAB and Octave functions, of a system: functions, solver and the run of a scenario."""

import dataclasses
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ...core import printable
from ...engine.compile.kernel_text import JavaScriptKernels, MatlabKernels
from ...engine.compile.kernel_text.printer import KernelPrinter
from ...engine.compile.text.programs import DEFINITION, JavaScriptLanguage, MatlabBody, MatlabLanguage
from .c_source import csv_header
from .exported_run import BETWEEN, SHAPES, STEP, TABLEAU, ExportedLoop, RunData, SolverText, program_data
from .identifiers import block_comment, filled, line_comment
from .printed_system import ExportedSystem

ULP = """/** The distance from a number to the next. */
function ulp(value) {
  const bits = new DataView(new ArrayBuffer(8));
  bits.setFloat64(0, Math.abs(value));
  bits.setBigInt64(0, bits.getBigInt64(0) + 1n);
  return bits.getFloat64(0) - Math.abs(value);
}

"""
JS_DRIVER_ARRAYS = """  const {kinds, settings} = loop.drivers;
  const driverStates = loop.drivers.states.map((state) => [...state]);
  const scratch = [[[], [], []], [[], [], []]];
"""
JS_DRIVEN = (
    ULP,
    JS_DRIVER_ARRAYS,
    "      apply_drivers(kinds, settings, driverStates, driverStates, signals, counts, scratch, begin, ulp(end));\n",
)
"""A function, the arrays of drivers, and the line that passes commands through their drivers."""


@dataclasses.dataclass(frozen=True, eq=False)
class ScriptText:
    """What the program of a system, its run and its loop is printed from; `name` is that of the program."""

    name: str
    system: ExportedSystem
    run: RunData
    provenance: Sequence[str]
    loop: ExportedLoop | None = None


class JavaScriptModule(ScriptText):
    """The ECMAScript module of one system and its run; `name` is the name of the files."""

    def files(self, columns: Sequence[str]) -> dict[str, str]:
        """Contents of the module, and of a program that writes these columns, after time, as CSV, by file name."""
        solver = self._solver()
        functions, sizes = self.system.printed(JavaScriptLanguage(), implicit=solver.implicit)
        functions = functions.replace("export function outputs(", "export function outputsOf(", 1)
        constants = {
            "SIZES": {"held": sizes.held, "jacobian": sizes.jacobian, "factors": sizes.factors},
            **solver.constants,
        }
        text = "".join(
            f"export const {name} = {to_json(value)};\n"
            for name, value in _camel(program_data(self.system, self.run)).items()
        )
        text += "".join(f"const {name} = {to_json(value)};\n" for name, value in constants.items())
        comment = block_comment(self.provenance)
        if self.loop is not None:
            text += f"export const loop = {to_json(_camel(self.loop.data(self.system)))};\n"
            functions += f"\n{self.loop.controller.sample_in(JavaScriptLanguage('control_'))}"
        places = {
            "provenance": comment, "constants": text, "functions": functions,
            "solver": filled("solver.mjs", solver.places, self.name),
            "arguments": filled("arguments.mjs", {}, self.name),
            "simulate": _simulation(self, "mjs", JavaScriptKernels(), JS_DRIVEN, {}),
        }  # fmt: skip
        run = {
            "provenance": comment, "file": self.name, "columns": to_json(["time", *columns]),
            "header": to_json(csv_header(columns)),
        }  # fmt: skip
        return {
            f"{self.name}.mjs": filled("program.mjs", places, self.name),
            f"{self.name}.d.mts": filled("program.d.mts", self._types(comment), self.name),
            f"{self.name}.run.mjs": filled("run.mjs", run, self.name),
            "package.json": self._package(),
        }

    def _types(self, comment: str) -> dict[str, str]:
        """The places of the TypeScript declarations."""
        system, loop = self.system, self.loop
        names = {
            "states": system.state_names, "inputs": system.input_names, "outputs": system.output_names,
            "parameters": [leaf.path for leaf in system.tunable],
        }  # fmt: skip
        types = {kind: _union(of) for kind, of in names.items()}
        changes = columns = ""
        if loop is not None:
            columns = f" | {_union(loop.added_columns)}"
            changes = f"  controllerParameters?: Values<{_union(leaf.path for leaf in loop.controller.tunable)}>;\n"
            wanted = ", ".join(loop.controller.law.setpoints) or "none"
            changes += f"  /** Set points {wanted}. */\n  setpoint?: Segments;\n"
        results = "  samples: number;\n" if loop is not None else ""
        return {"provenance": comment, **types, "columns": columns, "changes": changes, "results": results}

    def _package(self) -> str:
        """The package.json of a folder that npm installs."""
        module = {"types": f"./{self.name}.d.mts", "default": f"./{self.name}.mjs"}
        content = {
            "name": self.name.replace("_", "-"), "version": "1.0.0", "private": True, "description": self.provenance[0],
            "type": "module", "types": module["types"], "exports": {".": module},
        }  # fmt: skip
        return json.dumps(content, indent=2) + "\n"

    def _solver(self) -> SolverText:
        names = {*STEP.values(), *BETWEEN.values()}
        fields = {name: f"this.{word}" for name, word in zip(names, _camel(dict.fromkeys(names)), strict=True)}
        fields |= {"nominal": "nominal"} | {key: key.upper() for key in TABLEAU}
        sizes = {"STATES": "states.length", "INPUTS": "inputs.length", "STAGES": "WEIGHTS.length",
                 "JACOBIAN": "SIZES.jacobian", "FACTORS": "SIZES.factors"}  # fmt: skip
        return SolverText(JavaScriptKernels(), self.run.integrator, fields, sizes, "work.")


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


_BODY = MatlabBody()
_IN_LINE = 6
"""Numbers in a line."""
LOOP_HELP = """% In addition: controller_parameters, those of the control law; setpoint, with the fields ends, values
% and slopes.
"""
M_DRIVEN = (
    "",
    """  states = loop.drivers.states;
  scratch = {zeros(3, 0), zeros(3, 0)};
""",
    """    [states, signals, counts, scratch] = apply_drivers( ...
      loop.drivers.kinds, loop.drivers.settings, states, states, signals, counts, scratch, start, eps(finish));
""",
)
"""The arrays of drivers, and the lines that pass commands through their drivers."""


class OctaveFunctions(ScriptText):
    """The function file of one system and that of its run; `name` is the name of the function."""

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
            "simulate": _simulation(self, "m", MatlabKernels(), M_DRIVEN, steps),
            "loop_help": LOOP_HELP if self.loop else "",
            "columns": m_strings(["time", *columns]), "header": m_string(csv_header(columns).strip("\n")),
        }  # fmt: skip
        return {
            f"{self.name}.m": filled("program.m", places, self.name),
            f"run_{self.name}.m": filled("run.m", places, self.name),
        }

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


def _simulation(
    program: JavaScriptModule | OctaveFunctions, suffix: str, kernels: KernelPrinter, driven: tuple[str, str, str],
    places: Mapping[str, str],
) -> str:  # fmt: skip
    """The function `simulate`; `driven` are the texts of a loop with drivers: a function, their arrays, their call."""
    loop, name = program.loop, program.name
    if loop is None:
        return filled(f"simulate.{suffix}", places, name)
    first, arrays, call = driven if len(loop.drivers.kinds) else ("", "", "")
    text = f"{first}{kernels.text('driven_inputs', loop.kernels)}"
    return filled(f"loop.{suffix}", {**places, "kernels": text, "driver_arrays": arrays, "apply_drivers": call}, name)


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
