"""Targets of an export: the languages, the files that each makes of a program, and printed laws."""

import abc
import dataclasses
from collections.abc import Sequence
from typing import Any

from ...core import Leaf, ParameterError, autodiff, leaves, one_line, parts_of
from ...engine.compile.functions import PARAMETERS, Printer
from ...engine.compile.ir.emission import TargetLanguage
from ...engine.compile.text.languages import DEFINITION, CLanguage, JavaScriptLanguage, MatlabLanguage
from ...physics.muscle.characteristic import Characteristic, ContractionLaw, ForceLaw, PressureLaw
from .c_source import CSource, main_program
from .exported_run import ExportedRun
from .identifiers import block_comment, c_strings, c_values, filled, line_comment, provenance, with_cmake
from .scripting import javascript_files, m_array, m_strings, octave_files, to_json

FORMS: tuple[tuple[type[Characteristic], str, tuple[str, str], tuple[str, str, str]], ...] = (
    (ForceLaw, "force", ("pressure", "contraction"), ("force", "force_by_pressure", "stiffness")),
    (ContractionLaw, "contraction", ("pressure", "force"),
     ("contraction", "contraction_by_pressure", "contraction_by_force")),
    (PressureLaw, "pressure", ("contraction", "force"), ("pressure", "pressure_by_contraction", "pressure_by_force")),
)  # fmt: skip
"""The closed form of each kind of law: method, arguments, and results; the stiffness is -dF/deps [N]."""
UNITS = {"pressure": "Pa", "contraction": "1", "force": "N"}


@dataclasses.dataclass(frozen=True, eq=False)
class PrintedLaw:
    """A law as expressions, with what its files state."""

    name: str
    arguments: tuple[str, str]
    results: tuple[str, str, str]
    symbols: tuple[Any, Any]
    parameters: Any
    values: Any
    known: tuple[Leaf, ...]
    provenance: Sequence[str]

    @property
    def defaults(self) -> list[float]:
        """The values of the parameters."""
        return [float(leaf.value) for leaf in self.known]

    def places(self, language: TargetLanguage) -> dict[str, str]:
        """The places of a template, with `prepare` and the function `evaluate(argument, argument, c, result)`."""
        printer, (first, second) = Printer(language), self.arguments
        inputs = dict(zip(self.arguments, self.symbols, strict=True))
        printer.add("evaluate", {**inputs, PARAMETERS: self.parameters}, {"result": self.values}, self.arguments)
        return {
            "provenance": block_comment(self.provenance), "file": self.name, "functions": printer.module(),
            "held": str(printer.held), "parameters": str(len(self.known)), "first": first, "second": second,
            "first_unit": UNITS[first], "second_unit": UNITS[second], "results": ", ".join(self.results),
        }  # fmt: skip


def print_law(law: Characteristic, name: str, title: str) -> PrintedLaw:
    """A law ready for printing. Raises ParameterError for a law without closed form, which it names."""
    import casadi

    if not isinstance(law, Characteristic):
        raise ParameterError(f"{one_line(law)} is not a characteristic; pass load('dmsp-20-300').characteristic, say.")
    for _, part in parts_of(law):
        if not autodiff.is_traceable(type(part)):
            raise ParameterError(
                f"{type(part).__name__} has no closed form and cannot be exported. Approximate it first, with its "
                "error: as_force_law(law, validity_range) for a characteristic, as_polynomial for a geometry."
            )
    _, method, arguments, results = next(form for form in FORMS if isinstance(law, form[0]))
    model, parameters = autodiff.symbolic(law)
    x = casadi.SX.sym("x"), casadi.SX.sym("y")
    value = casadi.SX(getattr(model, method)(*x))
    autodiff.check_finite(value, f"{type(law).__name__}.{method}")
    slopes = [casadi.jacobian(value, each) for each in x]
    if method == "force":
        slopes[1] = -slopes[1]
    # NaN for a missing argument: a printed comparison takes one of its branches, such as the lower limit of the force.
    known = casadi.logic_and(*(casadi.logic_or(each >= 0, each < 0) for each in x))
    values = casadi.if_else(known, casadi.densify(casadi.vertcat(value, *slopes)), x[0] + x[1])
    lines = provenance(title, law)
    return PrintedLaw(name, arguments, results, x, parameters, casadi.cse(values), tuple(leaves(law)), lines)


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
    """C99 without memory allocation, which also compiles as C++: header, source, a main program that runs the scenario,
    and a CMakeLists.txt.

    A controller has a header and a source of its own.
    """

    def run_files(self, program: ExportedRun) -> dict[str, str]:
        source = CSource(program.name, program.system, program.integrator, program.provenance).files()
        controller = program.loop.controller.source_files() if program.loop else {}
        return with_cmake(program.name, {**source, **controller, "main.c": main_program(program)})

    def law_files(self, law: PrintedLaw) -> dict[str, str]:
        constants = {"defaults": c_values(law.defaults, 1), "parameter_names": c_strings(p.path for p in law.known)}
        places = law.places(CLanguage("double", f"{law.name}_", None)) | constants
        return with_cmake(law.name, {f"{law.name}.{end}": filled(f"law.{end}", places, law.name) for end in "hc"})


@dataclasses.dataclass(frozen=True)
class JavaScript(Target):
    """An ECMAScript module for browsers and Node, and a program for Node that runs the scenario."""

    def run_files(self, program: ExportedRun) -> dict[str, str]:
        return javascript_files(program)

    def law_files(self, law: PrintedLaw) -> dict[str, str]:
        stated = {"parameters": [p.path for p in law.known], "defaults": law.defaults, "results": law.results}
        constants = "".join(f"export const {name} = {to_json(value)};\n" for name, value in stated.items())
        places = law.places(JavaScriptLanguage()) | {"constants": constants}
        return {f"{law.name}.mjs": filled("law.mjs", places, law.name)}


@dataclasses.dataclass(frozen=True)
class Octave(Target):
    """Functions for GNU Octave and MATLAB, and a function that runs the scenario."""

    def run_files(self, program: ExportedRun) -> dict[str, str]:
        return octave_files(program)

    def law_files(self, law: PrintedLaw) -> dict[str, str]:
        places = law.places(MatlabLanguage())
        places |= {
            "provenance": line_comment(law.provenance), "defaults": m_array(law.defaults),
            "names": m_strings(p.path for p in law.known), "functions": f"{DEFINITION}\n{places['functions']}",
        }  # fmt: skip
        return {f"{law.name}.m": filled("law.m", places, law.name)}
