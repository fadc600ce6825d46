"""Modelica package of a system: a block whose rates and outputs are external C functions."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Sequence
from pathlib import Path

from ...core.atomic_output import atomic_folder
from ...engine.run import Problem
from .c_source import CSource
from .fmi_variables import first_inputs
from .identifiers import block_comment, filled, make_identifiers
from .targets import ExportedRun
from .write import make_run

_WORDS = """
    algorithm and annotation block break class connect connector constant constrainedby der discrete each else
    elseif elsewhen encapsulated end enumeration equation expandable extends external false final flow for
    function if import impure in initial inner input loop model not operator or outer output package parameter
    partial protected public pure record redeclare replaceable return stream then true type when while within
    time rates outputs plant
"""
KEYWORDS = frozenset(_WORDS.split())
"""Words of Modelica, and names in the package, that are no names of variables."""
_FACTORS = r"[A-Za-z]+-?\d*(\.[A-Za-z]+-?\d*)*"
_UNIT = re.compile(rf"(1|{_FACTORS})(/([A-Za-z]+-?\d*|\({_FACTORS}\)))?")
"""Units of the Modelica specification: whole exponents, and one fraction bar."""


@dataclasses.dataclass(frozen=True)
class ModelicaVariable:
    """A variable with the text of its declaration."""

    name: str
    declaration: str


def write_modelica(
    problem: Problem, folder: str | Path, *, name: str = "", title: str = "", tunable: Sequence[str] | None = None
) -> tuple[Path, ...]:
    """Write a system as a Modelica package, a folder `NAME` in `folder`, with C sources; the paths of its files.

    The block `NAME.Plant` has the inputs, states, outputs and parameters of the system as variables with their units,
    and begins in the initial state of the problem; the simulating tool integrates it. Arguments and errors as for
    `write_program`.
    """
    program = make_run(problem, name=name, title=title, tunable=tunable)
    files = modelica_files(program)
    target = Path(folder) / program.name
    with atomic_folder(target) as staging:
        for file, text in files.items():
            (staging / file).parent.mkdir(parents=True, exist_ok=True)
            (staging / file).write_bytes(text.encode("utf-8", "replace"))
    return tuple(target / file for file in files)


def modelica_files(program: ExportedRun) -> dict[str, str]:
    """The files of the package by their paths in it."""
    source = CSource(program.name, program.system, program.run.integrator, program.provenance).files()
    include = {f"Resources/Include/{file}": text for file, text in source.items()}
    wrapper = filled("modelica.c", {"file": program.name}, program.name)
    return {"package.mo": _package(program), **include, f"Resources/Include/{program.name}_modelica.c": wrapper}


def _package(program: ExportedRun) -> str:
    system, run = program.system, program.run
    states, inputs, outputs, parameters = _variables(program)
    assigned = [f"    {v.name} = x_[{i}];" for i, v in enumerate(states, 1)]
    assigned += [f"    {v.name} = o_[{i}];" for i, v in enumerate(outputs, 1)]
    values = {
        "provenance": block_comment(program.provenance), "package": program.name, "file": program.name,
        "title": program.provenance[0].replace("\\", " ").replace('"', "'"),
        "declarations": "\n".join(v.declaration for v in (*parameters, *inputs, *states, *outputs)),
        "states": str(len(states)), "inputs": str(len(inputs) or 1), "parameters": str(len(parameters) or 1),
        "outputs": str(len(outputs) or 1), "start": ", ".join(repr(x) for x in run.initial.tolist()),
        "nominal": ", ".join(repr(x) for x in system.nominal.tolist()), "equations": "\n".join(assigned),
        "input_names": ", ".join(v.name for v in inputs) or "0.0",
        "parameter_names": ", ".join(v.name for v in parameters) or "0.0",
    }  # fmt: skip
    return filled("modelica.mo", values, program.name)


def _variables(program: ExportedRun) -> tuple[list[ModelicaVariable], ...]:
    """States, inputs, outputs and parameters, with distinct names."""
    system = program.system
    leaves = system.tunable
    groups = (
        [(n, "Real", system.units[n], "") for n in system.state_names],
        [
            (n, "input Real", system.units[n], f"start = {start!r}")
            for n, start in zip(system.input_names, first_inputs(program.run), strict=True)
        ],
        [(n, "output Real", system.units[n], "") for n in system.output_names],
        [(f"p.{leaf.path}", "parameter Real", leaf.declared.unit, repr(float(leaf.value))) for leaf in leaves],
    )
    words = iter(_identifiers([name for group in groups for name, *_ in group]))
    variable_groups: list[list[ModelicaVariable]] = []
    for group in groups:
        variables = []
        for name, kind, unit, value in group:
            word, in_units = next(words), _modelica_unit(unit)
            text = [f'unit = "{in_units}"'] if in_units else []
            binding = f" = {value}" if kind.startswith("parameter") else ""
            text += [value] if value and not binding else []
            label = name.replace("\\", " ").replace('"', "'")
            variables.append(ModelicaVariable(word, f'    {kind} {word}({", ".join(text)}){binding} "{label}";'))
        variable_groups.append(variables)
    return tuple(variable_groups)


def _identifiers(names: Sequence[str]) -> list[str]:
    return [f"{word}_" if word.casefold() in KEYWORDS else word for word in make_identifiers(names)]


def _modelica_unit(unit: str) -> str:
    """A unit in the syntax of Modelica: `N.m/rad` for `N m/rad`, `N/(m.Pa)` for `N/m/Pa`; empty if it has none."""
    numerator, *denominators = unit.replace("Pa(a)", "Pa").replace("^", "").replace("*", " ").split("/")
    below = ".".join(word for part in denominators for word in part.strip("()").split())
    fraction = f"/({below})" if "." in below else f"/{below}" if below else ""
    text = (".".join(numerator.split()) or "1") + fraction
    return text if _UNIT.fullmatch(text) else ""
