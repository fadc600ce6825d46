"""Targets of an export: the languages, and the files that each makes of a program."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Sequence
from typing import ClassVar

from .c_source import CSource, loop_main
from .c_text import with_cmake
from .exported_loop import ExportedLoop
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
    loop: ExportedLoop | None = None


class Target(abc.ABC):
    """A language that plants and laws are exported to."""

    has_loops: ClassVar[bool] = False
    """Whether a plant can be exported together with its controller."""

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

    has_loops: ClassVar[bool] = True

    def run_files(self, program: ExportedRun) -> dict[str, str]:
        source = CSource(program.name, program.system, program.run.integrator, program.provenance)
        if program.loop is None:
            files = {**source.files(), "main.c": source.main(program.run, program.columns)}
            return with_cmake(program.name, files)
        main = loop_main(program.name, program.system, program.run, program.loop, program.columns, program.provenance)
        files = {**source.files(), **program.loop.controller.source_files(), "main.c": main}
        return with_cmake(program.name, files)

    def law_files(self, law: PrintedLaw) -> dict[str, str]:
        return with_cmake(law.name, law.c_files())


@dataclasses.dataclass(frozen=True)
class JavaScript(Target):
    """An ECMAScript module for browsers and Node, and a program for Node that runs the scenario."""

    has_loops: ClassVar[bool] = True

    def run_files(self, program: ExportedRun) -> dict[str, str]:
        module = JavaScriptModule(program.name, program.system, program.run, program.provenance, program.loop)
        return module.files(program.columns)

    def law_files(self, law: PrintedLaw) -> dict[str, str]:
        return law.javascript_files()


@dataclasses.dataclass(frozen=True)
class Octave(Target):
    """Functions for GNU Octave and MATLAB, and a function that runs the scenario."""

    has_loops: ClassVar[bool] = True

    def run_files(self, program: ExportedRun) -> dict[str, str]:
        functions = OctaveFunctions(program.name, program.system, program.run, program.provenance, program.loop)
        return functions.files(program.columns)

    def law_files(self, law: PrintedLaw) -> dict[str, str]:
        return law.octave_files()


def program_name(title: str) -> str:
    """The name of a program from a title of the user, in lower case."""
    return make_identifier(make_identifier(title).lower())
