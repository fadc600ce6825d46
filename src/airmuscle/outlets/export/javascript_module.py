"""JavaScript module of a system: functions, solver and the run of a scenario, for Node and browsers."""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from ...engine.compile.kernel_text import JavaScriptKernels
from ...engine.compile.text.programs import JavaScriptLanguage
from .c_source import csv_header
from .exported_run import BETWEEN, STEP, TABLEAU, ExportedLoop, RunData, SolverText, program_data
from .identifiers import block_comment, filled
from .printed_system import ExportedSystem

ULP = """/** The distance from a number to the next. */
function ulp(value) {
  const bits = new DataView(new ArrayBuffer(8));
  bits.setFloat64(0, Math.abs(value));
  bits.setBigInt64(0, bits.getBigInt64(0) + 1n);
  return bits.getFloat64(0) - Math.abs(value);
}

"""
DRIVER_ARRAYS = """  const {kinds, settings} = loop.drivers;
  const driverStates = loop.drivers.states.map((state) => [...state]);
  const scratch = [[[], [], []], [[], [], []]];
"""
APPLY_DRIVERS = (
    "      apply_drivers(kinds, settings, driverStates, driverStates, signals, counts, scratch, begin, ulp(end));\n"
)
"""The lines that pass commands through their drivers."""


@dataclasses.dataclass(frozen=True, eq=False)
class JavaScriptModule:
    """The ECMAScript module of one system and its run; `name` is the name of the files."""

    name: str
    system: ExportedSystem
    run: RunData
    provenance: Sequence[str]
    loop: ExportedLoop | None = None

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
            "arguments": filled("arguments.mjs", {}, self.name), "simulate": self._simulation(),
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

    def _simulation(self) -> str:
        """The function `simulate`."""
        if self.loop is None:
            return filled("simulate.mjs", {}, self.name)
        driven = len(self.loop.drivers.kinds)
        places = {
            "kernels": f"{ULP if driven else ''}{JavaScriptKernels().text('driven_inputs', self.loop.kernels)}",
            "driver_arrays": DRIVER_ARRAYS if driven else "", "apply_drivers": APPLY_DRIVERS if driven else "",
        }  # fmt: skip
        return filled("loop.mjs", places, self.name)

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
