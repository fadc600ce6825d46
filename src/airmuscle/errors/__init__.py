"""Exceptions and warnings: all that the functions of airmuscle raise and issue.

`except airmuscle.errors.AirmuscleError` catches every exception; the classes below it state the
kind of the cause:

    AirmuscleError
        InputError                    invalid input
            FileError (and FolderInUseError), ColumnError, UnitError, ParameterError,
                UnknownNameError
        PhysicsError                  the model has no solution
            SolveError, GeometryLimitError, RatingError, EquilibriumError
        RigError                      a test rig does not answer, or refuses a command
        MissingPackageError           a package of an extra is not installed
        TraceError                    a model cannot be compiled
        IdentificationError           the data cannot determine the requested quantities
        SimulationError               a simulation ended early; `.solution` contains the partial
                                      results
    AirmuscleWarning                  a result that may differ from what the user expects
"""

from ..core.stubs import attach_stub

__getattr__, __dir__, __all__ = attach_stub(__name__, __file__)
