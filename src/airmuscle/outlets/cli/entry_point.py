"""Entry point of the command `airmuscle`: interruptions are handled before anything else is imported."""

import importlib
import os
import sys

from .interruption import INTERRUPTED, check_interrupted, deferred_sigint

_BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables of the threads of linear algebra. By default a command uses one: its matrices are small, and
threads that wait for each other take the cores from its processes and from other programs."""


def main() -> None:
    """Run the command line and exit with its exit code; an interruption, also of an import, exits with 130."""
    for name in _BLAS_THREADS:
        os.environ.setdefault(name, "1")
    try:
        with deferred_sigint():
            app = importlib.import_module(".commands", __package__).app
            check_interrupted()
            app(prog_name="airmuscle")
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        raise SystemExit(INTERRUPTED) from None
