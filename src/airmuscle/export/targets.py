"""Targets of an export: the languages, and the files that each makes of a program."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Sequence

from .c_source import CSource
from .identifiers import make_identifier
from .javascript_module import JavaScriptModule
from .law import PrintedLaw
from .octave_functions import OctaveFunctions
from .printed_system import ExportedSystem
from .run_data import RunData


@dataclasses.dataclass(frozen=True, eq=False)
class ExportedRun:
    """A system with its run, ready for a target; `columns` are written by the program after time."""

    name: str
    system: ExportedSystem
    run: RunData
    provenance: Sequence[str]
    columns: Sequence[str]


class Target(abc.ABC):
    """A language that plants and laws are exported to."""

    @abc.abstractmethod
    def run_files(self, program: ExportedRun) -> dict[str, str]:
        """The files of a system and its run, by name."""

    @abc.abstractmethod
    def law_files(self, law: PrintedLaw) -> dict[str, str]:
        """The files of a law, by name."""


@dataclasses.dataclass(frozen=True)
class C99(Target):
    """C99 without memory allocation: header, source, and a main program that runs the scenario."""

    def run_files(self, program: ExportedRun) -> dict[str, str]:
        source = CSource(program.name, program.system, program.run.integrator, program.provenance)
        return {**source.files(), "main.c": source.main(program.run, program.columns)}

    def law_files(self, law: PrintedLaw) -> dict[str, str]:
        return law.c_files()


@dataclasses.dataclass(frozen=True)
class JavaScript(Target):
    """An ECMAScript module for browsers and Node, and a program for Node that runs the scenario."""

    def run_files(self, program: ExportedRun) -> dict[str, str]:
        module = JavaScriptModule(program.name, program.system, program.run, program.provenance)
        return module.files(program.columns)

    def law_files(self, law: PrintedLaw) -> dict[str, str]:
        return law.javascript_files()


@dataclasses.dataclass(frozen=True)
class Octave(Target):
    """Functions for GNU Octave and MATLAB, and a function that runs the scenario."""

    def run_files(self, program: ExportedRun) -> dict[str, str]:
        functions = OctaveFunctions(program.name, program.system, program.run, program.provenance)
        return functions.files(program.columns)

    def law_files(self, law: PrintedLaw) -> dict[str, str]:
        return law.octave_files()


def program_name(title: str) -> str:
    """The name of a program from a title of the user, in lower case."""
    return make_identifier(make_identifier(title).lower())
