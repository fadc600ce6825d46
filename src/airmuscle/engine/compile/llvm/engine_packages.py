"""Packages of the engine, the extra `sim`: llvmlite, which makes machine code, and numba, which
translates kernels for it. Whoever reads, fits and evaluates alone needs neither.
"""

import importlib
from typing import Any

from ....core import MissingPackageError, install_command


def llvm_binding() -> Any:
    """The module llvmlite.binding. Raises MissingPackageError where it cannot be imported."""
    return _imported("llvmlite.binding")


def numba_module() -> Any:
    """The module numba. Raises MissingPackageError where it cannot be imported."""
    return _imported("numba")


def _imported(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        missing = isinstance(error, ModuleNotFoundError)
        reason = "of which one is not installed" if missing else f"which do not start ({error})"
        raise MissingPackageError(
            f"simulation needs the packages numba and llvmlite, {reason}. Install them:"
            f" {install_command('sim')}"
        ) from None
