"""Everything airmuscle raises on purpose. A message says where, what, what is allowed, what to do.

AirmuscleError
├── InputError               something given from outside cannot be used
│   ├── FileError            a file or folder that cannot be read or written
│   ├── ColumnError          a recording lacks a column, or a column holds no numbers
│   ├── UnitError            a unit that is unknown or of the wrong kind
│   ├── ParameterError       a parameter missing, misspelt, mistyped or physically impossible
│   └── UnknownName          no muscle, characteristic, component or paper of that name
├── PhysicsError             the question has no answer in this model
│   ├── NoSolution           no pressure, contraction or force satisfies the request
│   ├── OutOfReach           a contraction that the geometry cannot take
│   └── NoEquilibrium        a plant that cannot rest: names the muscle and the forces
├── TraceError               a law that cannot be traced into a program
├── IdentificationError      data that cannot determine what is asked
└── SimulationError          a run that ended early; `.solution` is what was computed

AirmuscleWarning             works, but not as expected: a Python warning, not an error
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any


class AirmuscleError(Exception):
    """Base of everything airmuscle raises on purpose."""


class AirmuscleWarning(UserWarning):
    """Something that works, but not as its reader may expect; the message says what."""


class InputError(AirmuscleError):
    """Something given from outside cannot be used."""


class FileError(InputError):
    """A file or folder that cannot be read or written."""


class ColumnError(InputError):
    """A recording lacks a column, or a column holds no numbers."""


class UnitError(InputError):
    """A unit that is unknown or of the wrong kind."""


class ParameterError(InputError):
    """A parameter that is missing, misspelt, mistyped or physically impossible."""


class UnknownNameError(InputError):
    """No muscle, characteristic, component or paper of that name."""


class PhysicsError(AirmuscleError):
    """The question has no answer in this model."""


class SolveError(PhysicsError):
    """No pressure, contraction or force satisfies the request."""


class GeometryLimitError(PhysicsError):
    """A contraction that the geometry cannot take."""


class EquilibriumError(PhysicsError):
    """A plant that cannot rest; the message names the muscle and the forces."""


class TraceError(AirmuscleError):
    """A law that cannot be traced into a program."""


class IdentificationError(AirmuscleError):
    """Data that cannot determine what is asked."""


class SimulationError(AirmuscleError):
    """A run that ended early; `.solution` is what was computed until then, or None.

    `.recording` is the recording of the solution, `.interrupted` says whether the user ended the run.
    """

    def __init__(self, message: str, solution: Any = None, *, interrupted: bool = False) -> None:
        super().__init__(message)
        self.solution = solution
        self.interrupted = interrupted

    @property
    def recording(self) -> Any:
        """The rows that were computed, or None."""
        return None if self.solution is None else self.solution.recording


def suggestion(name: str, known: Iterable[str]) -> str:
    """A closing sentence for messages about unknown names: the nearest known one, or nothing."""
    near = difflib.get_close_matches(str(name), list(known), n=1)
    return f" Did you mean '{near[0]}'?" if near else ""
