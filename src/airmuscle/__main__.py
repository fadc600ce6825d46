"""Entry point of the command `airmuscle` and of `python -m airmuscle`: an interruption during the
start is no error.

Only modules that Python loads in less than a millisecond are imported here, because an interruption
before `main` is called cannot be handled.
"""

import importlib
import os
import sys

_BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
"""Environment variables of the threads of linear algebra. By default a command uses one: its
matrices are small, and threads that wait for each other take the cores from its processes and from
other programs."""


def main() -> None:
    """Run the command line and exit with its exit code; an interruption, also of an import, exits
    with 130.
    """
    for name in _BLAS_THREADS:
        os.environ.setdefault(name, "1")
    os.environ["MPLBACKEND"] = "Agg"  # figures are files; another name may be unknown here
    try:
        importlib.import_module("airmuscle.outlets.cli.streams").prepare_streams()
        interruption = importlib.import_module("airmuscle.outlets.cli.interruption")
        interruption.end_on_sigterm()
        with interruption.deferred_sigint():
            app = importlib.import_module("airmuscle.outlets.cli.commands").app
            interruption.check_interrupted()
            app(prog_name="airmuscle")
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        raise SystemExit(130) from None


if __name__ == "__main__":
    main()
