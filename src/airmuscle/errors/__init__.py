"""Exceptions and warnings: all that the functions of airmuscle raise and issue.

`except airmuscle.errors.AirmuscleError` catches every exception; the classes below it state the kind of the cause:

    AirmuscleError
        InputError                    invalid input
            FileError (and FolderInUseError), ColumnError, UnitError, ParameterError, UnknownNameError
        PhysicsError                  the model has no solution
            SolveError, GeometryLimitError, RatingError, EquilibriumError
        TraceError                    a model cannot be compiled
        IdentificationError           the data cannot determine the requested quantities
        SimulationError               a simulation ended early; `.solution` contains the partial results
    AirmuscleWarning                  a result that may differ from what the user expects
"""

from ..core.errors import (
    AirmuscleError,
    AirmuscleWarning,
    ColumnError,
    EquilibriumError,
    FileError,
    FolderInUseError,
    GeometryLimitError,
    IdentificationError,
    InputError,
    ParameterError,
    PhysicsError,
    RatingError,
    SimulationError,
    SolveError,
    TraceError,
    UnitError,
    UnknownNameError,
)

__all__ = [
    "AirmuscleError",
    "AirmuscleWarning",
    "ColumnError",
    "EquilibriumError",
    "FileError",
    "FolderInUseError",
    "GeometryLimitError",
    "IdentificationError",
    "InputError",
    "ParameterError",
    "PhysicsError",
    "RatingError",
    "SimulationError",
    "SolveError",
    "TraceError",
    "UnitError",
    "UnknownNameError",
]
