"""Printed system: the functions of a system in a language of text, with the names, units and
defaults of its arrays.
"""

import dataclasses
import itertools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core import Array, Leaf, ParameterError, alternatives, leaves, nodes, printable
from ...engine.compile.functions import ArraySizes, Extension, TracedSystem, system_module
from ...engine.compile.ir.emission import TargetLanguage
from ...engine.compile.program import CompiledSystem, Description
from ...engine.compile.text.body import Label, Labels
from ...recording.columns import column_units, quantity_of
from .identifiers import make_identifiers


@dataclasses.dataclass(frozen=True, eq=False)
class ExportedSystem:
    """A system ready for printing: its expressions, of which some parameters are arguments and the
    others constants.
    """

    compiled: CompiledSystem
    traced: TracedSystem
    tunable: tuple[Leaf, ...]
    """The parameters that remain arguments, in the order of their vector."""

    @property
    def known(self) -> Description:
        """Names, sizes and limits of the states, inputs and outputs."""
        return self.compiled.description

    @property
    def units(self) -> dict[str, str]:
        """The units of all columns; empty where none is known."""
        return column_units(self.compiled.system, self.known.output_names)

    @property
    def paths(self) -> list[str]:
        """The paths of the tunable parameters."""
        return [leaf.path for leaf in self.tunable]

    @property
    def defaults(self) -> Array:
        """The values of the tunable parameters."""
        return np.array([leaf.value for leaf in self.tunable], dtype=float)

    def printed(
        self, language: TargetLanguage, *, implicit: bool = True, extend: Extension | None = None
    ) -> tuple[str, ArraySizes]:
        """The functions `prepare`, `rhs` and `outputs` of arrays; with `implicit` also those of a
        Rosenbrock step.
        """
        states = self.compiled.system.states
        inputs = self.compiled.system.input_variables
        units = self.units
        outputs = self.known.output_names
        labels = make_labels(
            {
                "x": [(s.name, s.unit, s.meaning) for s in states],
                "u": [(i.name, i.unit, i.meaning) for i in inputs],
                "o": [(name, units[name], meaning_of(name)) for name in outputs],
                "p": [
                    (leaf.path, leaf.declared.unit, leaf.declared.meaning) for leaf in self.tunable
                ],
                "f": [(f"{s.name}_rate", per_second(s.unit), "") for s in states],
                "w": [(f"{i.name}_slope", per_second(i.unit), "") for i in inputs],
            }
        )
        language = dataclasses.replace(language, labels=labels)  # type: ignore[type-var]
        return system_module(self.traced, language, extend, implicit=implicit)


def meaning_of(output: str) -> str:
    """The meaning of an output; empty where it is no known quantity."""
    known = quantity_of(output)
    return known.meaning if known else ""


def make_labels(tables: Mapping[str, Sequence[tuple[str, str, str]]]) -> Labels:
    """Labels of arrays from the name, unit and meaning of each element; no two have the same
    name.
    """
    rows = [(array, *row) for array, table in tables.items() for row in table]
    labels: dict[str, list[Label]] = {array: [] for array in tables}
    for identifier, (array, _, unit, meaning) in zip(
        make_identifiers([row[1] for row in rows]), rows, strict=True
    ):
        shown = f"[{unit}]" if unit not in ("", "1") else ""
        text = printable(f"{shown} {meaning}").encode("ascii", "replace").decode()
        labels[array].append(
            Label(identifier, text.replace("*/", "* /").replace("??", "? ?").strip())
        )
    return labels


def per_second(unit: str) -> str:
    """The unit of the derivative of a quantity by time."""
    if unit in ("", "1"):
        return "1/s"
    above, slash, below = unit.partition("/")
    if not slash:
        return f"{unit}/s"
    return f"{above}/s2" if below == "s" else f"{above}/({below.strip('()')} s)"


def export_system(compiled: CompiledSystem, tunable: Sequence[str] | None = None) -> ExportedSystem:
    """A compiled system ready for printing, with the paths of its tunable parameters, all by
    default; the others are constants, which makes it smaller. Raises ParameterError for a path that
    is not a parameter of the system.
    """
    traced = compiled.program.traced
    known = list(leaves(compiled.system))
    if tunable is None:
        return ExportedSystem(compiled, traced, tuple(known))
    chosen = [find_leaf(compiled.system, known, path) for path in dict.fromkeys(tunable)]
    symbols = nodes.symbols("p", len(chosen))
    values = [
        symbols[chosen.index(i)] if i in chosen else nodes.constant(leaf.value)
        for i, leaf in enumerate(known)
    ]
    results = nodes.replaced([*traced.f, *traced.o], traced.p, values)
    f = results[: len(traced.f)]
    o = results[len(traced.f) :]
    return ExportedSystem(
        compiled, dataclasses.replace(traced, p=symbols, f=f, o=o), tuple(known[i] for i in chosen)
    )


def acting_parameters(compiled: CompiledSystem) -> list[str]:
    """The paths of the parameters on which a rate or an output depends."""
    traced = compiled.program.traced
    paths = [leaf.path for leaf in leaves(compiled.system)]
    return list(itertools.compress(paths, nodes.occurring([*traced.f, *traced.o], traced.p)))


def find_leaf(model: Any, known: Sequence[Leaf], path: str) -> int:
    """The number of the parameter at a path. Raises ParameterError; for a part of the structure it
    says so.
    """
    paths = [leaf.path for leaf in known]
    if path in paths:
        return paths.index(path)
    part = model
    for word in path.replace("[", ".").replace("]", "").split("."):
        if isinstance(part, tuple) and word.isdecimal() and int(word) < len(part):
            part = part[int(word)]
        elif dataclasses.is_dataclass(part) and word in {f.name for f in dataclasses.fields(part)}:
            part = getattr(part, word)
        else:
            raise ParameterError(
                f"{type(model).__name__} has no parameter"
                f" '{path}'{alternatives(path, paths, 'tunable parameters are')}"
            )
    raise ParameterError(
        f"'{path}' is fixed when a program is printed, because it determines the equations and is"
        f" not a number in them{alternatives('', paths, 'tunable parameters are')} Change it in the"
        " model, and export again."
    )
