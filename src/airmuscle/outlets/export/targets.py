"""Targets of an export: C99, JavaScript, MATLAB and Octave, the files that each makes of a program
and of a law.
"""

import abc
import dataclasses
import functools
import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ...core import (
    Leaf,
    Node,
    ParameterError,
    autodiff,
    leaves,
    nodes,
    one_line,
    parts_of,
    printable,
    slopes,
)
from ...engine.compile.functions import PARAMETERS, Printer
from ...engine.compile.ir.emission import TargetLanguage
from ...engine.compile.kernel_text import JavaScriptKernels, MatlabKernels
from ...engine.compile.kernel_text.printer import KernelPrinter
from ...engine.compile.text.languages import (
    DEFINITION,
    CLanguage,
    JavaScriptLanguage,
    MatlabLanguage,
)
from ...engine.run import Integrator
from ...physics.muscle.characteristic import Characteristic, ContractionLaw, ForceLaw, PressureLaw
from ...physics.muscle.characteristic.calls import recorded_force
from .c_source import c_files, csv_header, main_program
from .exported_run import BETWEEN, SHAPES, STEP, TABLEAU, ExportedRun, SolverText, solver_text
from .identifiers import (
    block_comment,
    c_strings,
    c_values,
    filled,
    line_comment,
    m_array,
    m_number,
    provenance,
    template,
    with_cmake,
)
from .parameter_bounds import ParameterBounds

FORMS: tuple[tuple[type[Characteristic], str, tuple[str, str], tuple[str, str, str]], ...] = (
    (ForceLaw, "force", ("pressure", "contraction"), ("force", "force_by_pressure", "stiffness")),
    (
        ContractionLaw,
        "contraction",
        ("pressure", "force"),
        ("contraction", "contraction_by_pressure", "contraction_by_force"),
    ),
    (
        PressureLaw,
        "pressure",
        ("contraction", "force"),
        ("pressure", "pressure_by_contraction", "pressure_by_force"),
    ),
)
"""The closed form of each kind of law: method, arguments, and results; the stiffness is -dF/deps
[N].
"""
UNITS = {"pressure": "Pa", "contraction": "1", "force": "N"}
_json = functools.partial(json.dumps, default=np.ndarray.tolist)
"""A value as JavaScript text: ASCII only, numbers bit by bit, infinities by name."""


@dataclasses.dataclass(frozen=True, eq=False)
class PrintedLaw:
    """A law as expressions, with what its files state."""

    name: str
    arguments: tuple[str, str]
    results: tuple[str, str, str]
    symbols: list[Node]
    parameters: list[Node]
    values: list[Node]
    known: tuple[Leaf, ...]
    provenance: Sequence[str]

    @property
    def defaults(self) -> list[float]:
        """The values of the parameters."""
        return [float(leaf.value) for leaf in self.known]

    @property
    def bounds(self) -> ParameterBounds:
        """The bounds of the parameters."""
        return ParameterBounds.of(self.known)

    def places(self, language: TargetLanguage) -> dict[str, str]:
        """The places of a template, with `prepare` and the function `evaluate(argument, argument,
        c, result)`.
        """
        printer = Printer(language)
        first, second = self.arguments
        inputs = {name: [symbol] for name, symbol in zip(self.arguments, self.symbols, strict=True)}
        printer.add(
            "evaluate",
            {**inputs, PARAMETERS: self.parameters},
            {"result": self.values},
            self.arguments,
        )
        return {
            "provenance": block_comment(self.provenance),
            "file": self.name,
            "functions": printer.module(),
            "held": str(printer.held),
            "parameters": str(len(self.known)),
            "first": first,
            "second": second,
            "first_unit": UNITS[first],
            "second_unit": UNITS[second],
            "results": ", ".join(self.results),
        }


def print_law(law: Characteristic, name: str, title: str) -> PrintedLaw:
    """A law ready for printing. Raises ParameterError for a law without closed form, which it
    names.
    """
    if not isinstance(law, Characteristic):
        raise ParameterError(
            f"{one_line(law)} is not a characteristic; pass load('dmsp-20-300').characteristic,"
            " say."
        )
    for _, part in parts_of(law):
        if not autodiff.is_traceable(type(part)):
            raise ParameterError(
                f"{type(part).__name__} has no closed form and cannot be exported. Approximate it"
                " first, with its error: as_force_law(law, validity_range) for a characteristic,"
                " as_polynomial for a geometry."
            )
    _, method, arguments, results = next(form for form in FORMS if isinstance(law, form[0]))
    model, parameters = autodiff.symbolic(law)
    x = nodes.symbols("x", 2)
    if method == "force":
        value = nodes.as_node(recorded_force(law, model, *x))
    else:
        value = nodes.as_node(getattr(model, method)(*x))
    autodiff.check_finite([value], f"{type(law).__name__}.{method}")
    first, second = slopes.gradient(value, x)
    if method == "force":
        second = -second
    # NaN for a missing argument: a printed comparison takes one of its branches, such as the lower
    # limit of the force.
    known = nodes.logical_and(*(nodes.logical_or(argument >= 0, argument < 0) for argument in x))
    answered = refused_beyond(model, method, x, (value, first, second))
    values = [nodes.where(known, result, x[0] + x[1]) for result in answered]
    lines = provenance(title, law)
    return PrintedLaw(name, arguments, results, x, parameters, values, tuple(leaves(law)), lines)


def refused_beyond(
    law: Characteristic, method: str, x: Sequence[Node], results: Sequence[Node]
) -> list[Node]:
    """The results of a printed law; NaN beyond the range of a law for the contraction that refuses
    what lies there.
    """
    if method != "contraction" or not hasattr(law, "inside_validity_range"):
        return list(results)
    inside = nodes.as_node(law.inside_validity_range(*x))
    return [nodes.where(inside, result, math.nan) for result in results]


class Target(abc.ABC):
    """A language that plants, with their controllers, and laws are exported to."""

    @abc.abstractmethod
    def run_files(self, program: ExportedRun) -> dict[str, str]:
        """The files of a system and its run, by name."""

    @abc.abstractmethod
    def law_files(self, law: PrintedLaw) -> dict[str, str]:
        """The files of a law, by name."""


@dataclasses.dataclass(frozen=True)
class C99(Target):
    """C99 without memory allocation, which also compiles as C++: header, source, a main program
    that runs the scenario, and a CMakeLists.txt.

    A controller has a header and a source of its own.
    """

    def run_files(self, program: ExportedRun) -> dict[str, str]:
        source = c_files(program.name, program.system, program.integrator, program.provenance)
        controller = program.loop.controller.source_files() if program.loop else {}
        return with_cmake(program.name, {**source, **controller, "main.c": main_program(program)})

    def law_files(self, law: PrintedLaw) -> dict[str, str]:
        constants = {
            **law.bounds.c_places(law.name),
            "defaults": c_values(law.defaults, 1),
            "parameter_names": c_strings(p.path for p in law.known),
        }
        places = law.places(CLanguage("double", f"{law.name}_", None)) | constants
        return with_cmake(
            law.name, {f"{law.name}.{end}": filled(f"law.{end}", places, law.name) for end in "hc"}
        )


@dataclasses.dataclass(frozen=True)
class JavaScript(Target):
    """An ECMAScript module for browsers and Node, and a program for Node that runs the scenario."""

    def run_files(self, program: ExportedRun) -> dict[str, str]:
        name = program.name
        loop = program.loop
        solver = _javascript_solver(program.integrator)
        functions, sizes = program.system.printed(JavaScriptLanguage(), implicit=solver.implicit)
        functions = functions.replace("export function outputs(", "export function outputsOf(", 1)
        text = "".join(
            f"export const {key} = {_json(value)};\n"
            for key, value in _camel(program.data()).items()
        )
        text += (
            "const SIZES ="
            f" {_json({key: getattr(sizes, key) for key in ('held', 'jacobian', 'factors')})};\n"
        )
        text += "".join(
            f"const {key} = {_json(value)};\n" for key, value in solver.constants.items()
        )
        if loop is not None:
            text += f"export const loop = {_json(_camel(loop.data(program.system.known)))};\n"
            functions += f"\n{loop.controller.sample_in(JavaScriptLanguage('control_'))}"
        places = {
            "provenance": block_comment(program.provenance),
            "file": name,
            "constants": text,
            "functions": functions,
            "solver": filled("solver.mjs", solver.places, name),
            "arguments": filled("arguments.mjs", {}, name),
            "simulate": _simulation(program, "mjs", JavaScriptKernels(), {}),
            "columns": _json(["time", *program.columns]),
            "header": _json(csv_header(program.columns)),
            "package": name.replace("_", "-"),
            "description": json.dumps(program.provenance[0]),
        }
        return {
            f"{name}.mjs": filled("program.mjs", places, name),
            f"{name}.d.mts": filled("program.d.mts", {**places, **_types(program)}, name),
            f"{name}.run.mjs": filled("run.mjs", places, name),
            "package.json": filled("package.json", places, name),
        }

    def law_files(self, law: PrintedLaw) -> dict[str, str]:
        stated = {
            "parameters": [p.path for p in law.known],
            "defaults": law.defaults,
            **_camel(law.bounds.data),
            "results": law.results,
        }
        constants = "".join(
            f"export const {name} = {_json(value)};\n" for name, value in stated.items()
        )
        places = law.places(JavaScriptLanguage()) | {"constants": constants}
        return {f"{law.name}.mjs": filled("law.mjs", places, law.name)}


@dataclasses.dataclass(frozen=True)
class Octave(Target):
    """Functions for GNU Octave and MATLAB, and a function that runs the scenario."""

    def run_files(self, program: ExportedRun) -> dict[str, str]:
        name = program.name
        loop = program.loop
        system = program.system
        fields = {key: f"s.{key}" for key in {*STEP.values(), *BETWEEN.values()}} | {
            "end": "s.finish"
        }
        sizes = {
            "STATES": "s.n",
            "INPUTS": "numel(s.u)",
            "STAGES": "numel(s.weights)",
            "JACOBIAN": "0",
            "FACTORS": "0",
        }
        solver = solver_text(MatlabKernels(SHAPES), program.integrator, fields, sizes)
        functions, _ = system.printed(MatlabLanguage(), implicit=solver.implicit)
        method = solver.constants
        data = program.data()
        steps = {key.lower(): m_number(method.pop(key)) for key in ("FIRST_STEP", "CLOSE")}
        data |= {"units": tuple(system.units[column] for column in system.known.column_names)}
        data["output_names"] = data.pop("outputs")
        data["run"] |= data["run"].pop("segments")
        if loop is not None:
            functions += f"\n{loop.controller.sample_in(MatlabLanguage('control_'))}"
            data["loop"] = loop.data(system.known)
        places = {
            "provenance": line_comment(program.provenance),
            "file": name,
            "functions": f"{DEFINITION}\n{functions}",
            "constants": _fields("model", data),
            **steps,
            "solver": filled("solver.m", {**solver.places, **steps}, name),
            "solver_constants": "".join(
                _fields(f"s.{key.lower()}", value) for key, value in method.items()
            ),
            "simulate": _simulation(program, "m", MatlabKernels(), steps),
            "loop_help": template("loop_help.m") if loop else "",
            "check_parameters": template("check_parameters.m"),
            "columns": m_strings(["time", *program.columns]),
            "header": m_string(csv_header(program.columns).strip("\n")),
        }
        return {
            f"{name}.m": filled("program.m", places, name),
            f"run_{name}.m": filled("run.m", places, name),
        }

    def law_files(self, law: PrintedLaw) -> dict[str, str]:
        places = law.places(MatlabLanguage())
        places |= {
            "provenance": line_comment(law.provenance),
            "defaults": m_array(law.defaults),
            **{key: m_array(values) for key, values in law.bounds.data.items()},
            "check_parameters": template("check_parameters.m"),
            "names": m_strings(p.path for p in law.known),
            "functions": f"{DEFINITION}\n{places['functions']}",
        }
        return {f"{law.name}.m": filled("law.m", places, law.name)}


@functools.lru_cache(maxsize=16)
def _javascript_solver(integrator: Integrator) -> SolverText:
    """The solver of a module, whose text is that of no other system: the page asks for one with
    every plant.
    """
    names = {*STEP.values(), *BETWEEN.values()}
    fields = {
        key: f"this.{word}" for key, word in zip(names, _camel(dict.fromkeys(names)), strict=True)
    }
    fields |= {"nominal": "nominal"} | {key: key.upper() for key in TABLEAU}
    lengths = {
        "STATES": "states.length",
        "INPUTS": "inputs.length",
        "STAGES": "WEIGHTS.length",
        "JACOBIAN": "SIZES.jacobian",
        "FACTORS": "SIZES.factors",
    }
    return solver_text(JavaScriptKernels(), integrator, fields, lengths, "work.")


def _types(program: ExportedRun) -> dict[str, str]:
    """The places of the TypeScript declarations."""
    known = program.system.known
    loop = program.loop
    names = {
        "states": known.state_names,
        "inputs": known.input_names,
        "outputs": known.output_names,
        "parameters": program.system.paths,
    }
    types = {kind: _union(of) for kind, of in names.items()}
    if loop is None:
        return {**types, "columns": "", "changes": "", "results": ""}
    changes = f"  controllerParameters?: Values<{_union(loop.controller.paths)}>;\n"
    changes += (
        f"  /** Set points {', '.join(loop.controller.law.setpoints) or 'none'}. */\n  setpoint?:"
        " Segments;\n"
    )
    columns = f" | {_union(sum(loop.added_columns, ()))}"
    return {**types, "columns": columns, "changes": changes, "results": "  samples: number;\n"}


def _camel(data: dict[str, Any]) -> dict[str, Any]:
    """The values by their names in the style of JavaScript."""
    return {
        re.sub("_(.)", lambda mark: mark[1].upper(), name): value for name, value in data.items()
    }


def _union(names: Iterable[str]) -> str:
    """The TypeScript type of a text that is one of these names."""
    return " | ".join(map(json.dumps, names)) or "never"


def _simulation(
    program: ExportedRun, suffix: str, kernels: KernelPrinter, places: Mapping[str, str]
) -> str:
    """The function `simulate`; in a loop with drivers also their arrays, and the lines that pass
    commands to them.
    """
    loop = program.loop
    name = program.name
    if loop is None:
        return filled(f"simulate.{suffix}", places, name)
    driven = len(loop.drivers.kinds) > 0
    first = template("ulp.mjs") if driven and suffix == "mjs" else ""
    driver_texts = {
        name: template(f"{name}.{suffix}") if driven else ""
        for name in ("driver_arrays", "apply_drivers")
    }
    driver_texts["kernels"] = f"{first}{kernels.text('driven_inputs', loop.kernels)}"
    return filled(f"loop.{suffix}", {**places, **driver_texts}, name)


def _fields(name: str, value: Any) -> str:
    """Assignments of a value to a field, of those of a dictionary to its fields."""
    if isinstance(value, dict):
        return "".join(_fields(f"{name}.{key}", item) for key, item in value.items())
    text = (
        m_strings(value)
        if isinstance(value, tuple)
        else m_array(value)
        if np.ndim(value)
        else m_number(value)
    )
    return f"  {name} = {text};\n"


def m_string(text: str) -> str:
    """A text in single quotes."""
    return "'" + printable(text).replace("\n", " ").replace("'", "''") + "'"


def m_strings(texts: Iterable[str]) -> str:
    """A row of texts (a cell array)."""
    return f"{{{', '.join(map(m_string, texts))}}}"
