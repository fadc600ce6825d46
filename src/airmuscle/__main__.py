"""Entry point of the command `airmuscle` and of `python -m airmuscle`: an interruption during the start is no error.

Only modules that Python loads in less than a millisecond are imported here, because an interruption before `main` is
called cannot be handled.
"""

import importlib
import sys


def main() -> None:
    """Run the command line and exit with its exit code; an interruption exits with 130 (128 + SIGINT)."""
    try:
        importlib.import_module("airmuscle.outlets.cli.entry_point").main()
    except KeyboardInterrupt:
        sys.stderr.write("interrupted\n")
        raise SystemExit(130) from None


if __name__ == "__main__":
    main()
