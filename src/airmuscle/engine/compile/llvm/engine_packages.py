"""Packages of the engine, the extra `sim`: llvmlite, which makes machine code, and numba, which
translates kernels for it. Whoever reads, fits and evaluates alone needs neither.
"""

from typing import Any

from ....core import MissingPackageError, install_command


def llvm_binding() -> Any:
    """The module llvmlite.binding. Raises MissingPackageError where it cannot be imported."""
    try:
        import llvmlite.binding as llvm
    except ImportError as error:
        raise _missing(error) from None
    return llvm


def numba_module() -> Any:
    """The module numba. Raises MissingPackageError where it cannot be imported."""
    try:
        import numba
    except ImportError as error:
        raise _missing(error) from None
    return numba


def _missing(error: ImportError) -> MissingPackageError:
    """The error of a missing engine, or of one that does not start with the other packages."""
    is_absent = isinstance(error, ModuleNotFoundError)
    reason = "are not both installed" if is_absent else f"do not start ({error})"
    return MissingPackageError(
        f"simulation needs the engine, the packages numba and llvmlite, which {reason}; install"
        f" them: {install_command('sim')}"
    )
