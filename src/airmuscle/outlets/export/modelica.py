"""Modelica package of a system: a block of equations."""

import dataclasses
import math
import re
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path

from ...core import Leaf
from ...engine.compile.ir.emission import computed
from ...engine.compile.ir.instructions import instructions
from ...engine.compile.text.body import TextBody, TextLanguage
from ...engine.run import Problem
from .exported_run import ExportedRun
from .identifiers import block_comment, filled, make_identifiers, template
from .write import make_run, write_files

KEYWORDS = frozenset(template("modelica_keywords.txt").split())
"""Words of Modelica, and names in the package, that are no names of variables."""
_WHOLE = re.compile(r"(\d+)\.0")
_FACTORS = r"[A-Za-z]+-?\d*(\.[A-Za-z]+-?\d*)*"
_UNIT = re.compile(rf"(1|{_FACTORS})(/([A-Za-z]+-?\d*|\({_FACTORS}\)))?")
"""Units of the Modelica specification: whole exponents, and one fraction bar."""
_OUTSIDE = {
    "sqrt": ("{0} > 0.0", "0.0"),
    "log": ("{0} > 0.0", "-1e300"),
    "asin": ("abs({0}) <= 1.0", "0.0"),
    "acos": ("abs({0}) <= 1.0", "0.0"),
}
"""Functions with their domains, and the value outside; there a choice leaves the value out, but
tools stop (chosen).
"""
_EVENTS = ("abs", "floor")
"""Functions that would cause events."""


@dataclasses.dataclass(frozen=True, eq=False)
class Modelica(TextLanguage):
    """Equations, of which none causes an event; `variables` are the names of the elements of
    arrays.
    """

    variables: Mapping[str, Sequence[str]]

    language = "Modelica"
    margin = "    "
    branches = False
    infinity = "1.7976931348623157e308"
    not_a_number = "(0.0 / 0.0)"

    def element(self, array: str, index: int) -> str:
        name = self.variables[array][index]
        return f"der({name})" if array == "f" else name

    def call(self, function: str, x: Sequence[str]) -> str:
        if function == "pow":
            integer = _WHOLE.fullmatch(x[1])
            return (
                f"{x[0]} ^ {integer[1]}"
                if integer
                else f"noEvent(if {x[0]} > 0.0 then {x[0]} ^ {x[1]} else 0.0)"
            )
        value = f"{function}({x[0]})"
        if function in _OUTSIDE:
            domain, outside = _OUTSIDE[function]
            value = f"noEvent(if {domain.format(x[0])} then {value} else {outside})"
        return f"noEvent({value})" if function in _EVENTS else value


class ModelicaBody(TextBody):
    """The equations of a block, with the names of their values."""

    def __init__(self, variables: Mapping[str, Sequence[str]]) -> None:
        super().__init__(Modelica(variables))
        self.values: list[str] = []
        self._taken = {name.casefold() for names in variables.values() for name in names}

    def new_name(self) -> str:
        while (name := super().new_name()) in self._taken:
            pass
        self.values.append(name)
        return name

    def load(self, array: str, index: int) -> str:
        return self.syntax.element(array, index)

    def choose(self, comparison: str, a: str, b: str, when_true: str, when_false: str) -> str:
        test = f"{a} {comparison} {b}"
        if comparison in ("==", "!="):  # Modelica has no equality of real numbers in equations
            test = f"{a} < {b} or {a} > {b}"
            when_true, when_false = (
                (when_false, when_true) if comparison == "==" else (when_true, when_false)
            )
        return self.put(f"noEvent(if {test} then {when_true} else {when_false})")


def write_modelica(
    problem: Problem,
    folder: str | Path,
    *,
    name: str = "",
    title: str = "",
    tunable: Sequence[str] | None = None,
) -> tuple[Path, ...]:
    """Write a system as a Modelica package of equations, a folder `NAME` in `folder`; the path of
    its file.

    The block `NAME.Plant` has the inputs, states, outputs and parameters of the system as variables
    with their units, and begins in the initial state of the problem; the simulating tool integrates
    it. Arguments and errors as for `write_program`.
    """
    program = make_run(problem, name=name, title=title, tunable=tunable)
    traced = program.system.traced
    declared = _variables(program)
    code = instructions([traced.x, traced.u, traced.p], [traced.f, traced.o])
    names = {array: list(group) for array, group in declared.items()}
    body = ModelicaBody({**names, "f": names["x"]})
    results = computed(body, code, ["x", "u", "p"])
    for (output, index), value in sorted(results.items()):
        body.store("fo"[output], index, value)
    values = textwrap.wrap(
        f"Real {', '.join(body.values)};", 116, initial_indent="    ", subsequent_indent="      "
    )
    places = {
        "provenance": block_comment(program.provenance),
        "package": program.name,
        "title": _quoted(program.provenance[0]),
        "values": "\n".join(values) if body.values else "",
        "declarations": "\n".join(text for array in "puxo" for text in declared[array].values()),
        "equations": "\n".join(body.lines),
    }
    return write_files(
        {"package.mo": filled("modelica.mo", places, program.name)}, Path(folder) / program.name
    )


def _variables(program: ExportedRun) -> dict[str, dict[str, str]]:
    """Declarations of states, inputs, outputs and parameters by their names in the package, by
    array.
    """
    system = program.system
    known = program.system.known
    initial = program.problem.initial_vector.tolist()
    begins = zip(initial, system.compiled.nominal.tolist(), strict=True)
    states = [
        f"start = {start!r}, fixed = true, nominal = {nominal!r}" for start, nominal in begins
    ]
    inputs = [f"start = {start!r}" for start in program.first_inputs]
    groups = {
        "x": [
            ("Real", name, text, "") for name, text in zip(known.state_names, states, strict=True)
        ],
        "u": [
            ("input Real", name, text, "")
            for name, text in zip(known.input_names, inputs, strict=True)
        ],
        "o": [("output Real", name, "", "") for name in known.output_names],
        "p": [
            ("parameter Real", f"p.{leaf.path}", _bounds(leaf), f" = {float(leaf.value)!r}")
            for leaf in system.tunable
        ],
    }
    units = system.units | {f"p.{leaf.path}": leaf.declared.unit for leaf in system.tunable}
    identifiers = iter(
        make_identifiers([name for group in groups.values() for _, name, *_ in group])
    )
    declarations: dict[str, dict[str, str]] = {array: {} for array in groups}
    for array, group in groups.items():
        for kind, name, text, binding in group:
            word = next(identifiers)
            unit = _modelica_unit(units[name])
            word = f"{word}_" if word.casefold() in KEYWORDS else word
            attributes = ", ".join(filter(None, [f'unit = "{unit}"' if unit else "", text]))
            declarations[array][word] = (
                f'    {kind} {word}({attributes}){binding} "{_quoted(name)}";'
            )
    return declarations


def _bounds(leaf: Leaf) -> str:
    """The attributes of the bounds of a parameter that are finite, which tools check."""
    names = zip(("min", "max"), leaf.declared.bounds, strict=True)
    return ", ".join(f"{name} = {float(bound)!r}" for name, bound in names if math.isfinite(bound))


def _quoted(text: str) -> str:
    """A text between double quotes."""
    return text.replace("\\", " ").replace('"', "'")


def _modelica_unit(unit: str) -> str:
    """A unit in the syntax of Modelica: `N.m/rad` for `N m/rad`, `N/(m.Pa)` for `N/m/Pa`; empty if
    it has none.
    """
    numerator, *denominators = (
        unit.replace("Pa(a)", "Pa").replace("^", "").replace("*", " ").split("/")
    )
    below = ".".join(word for part in denominators for word in part.strip("()").split())
    fraction = f"/({below})" if "." in below else f"/{below}" if below else ""
    text = (".".join(numerator.split()) or "1") + fraction
    return text if _UNIT.fullmatch(text) else ""
